//! What the tests of this crate share: the backends they run on, and the way in and out of tensors.

mod folders;
pub(crate) mod learning;

use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{Tensor, TensorData, backend::Backend};
use burn_autodiff::Autodiff;
use burn_ndarray::NdArray;

/// Values only.
pub(crate) type Plain = NdArray;
/// What training runs on.
pub(crate) type Train = Autodiff<NdArray>;

/// Points as a tensor `[n, 3]`.
pub(crate) fn points<B: Backend>(points: &[[f64; 3]]) -> Tensor<B, 2> {
    let flat: Vec<f64> = points.iter().flatten().copied().collect();
    Tensor::from_data(
        TensorData::new(flat, [points.len(), 3]),
        &Default::default(),
    )
}

/// Values as a tensor `[n, 1]`.
pub(crate) fn column<B: Backend>(values: &[f64]) -> Tensor<B, 2> {
    Tensor::from_data(
        TensorData::new(values.to_vec(), [values.len(), 1]),
        &Default::default(),
    )
}

/// The elements of a tensor, row by row.
pub(crate) fn host<B: Backend, const D: usize>(tensor: Tensor<B, D>) -> Vec<f64> {
    tensor
        .into_data()
        .convert::<f64>()
        .to_vec()
        .expect("a float tensor converts to f64")
}

/// Moves every weight by up to `by`, so that none that starts at zero hides a mistake.
pub(crate) fn shaken<B: Backend, M: Module<B>>(net: M, by: f64) -> M {
    struct Shake {
        by: f64,
        count: f64,
    }
    impl<B: Backend> ModuleMapper<B> for Shake {
        fn map_float<const D: usize>(&mut self, param: Param<Tensor<B, D>>) -> Param<Tensor<B, D>> {
            param.map(|weights| {
                let shape = weights.shape();
                let moved = host(weights).into_iter().map(|w| {
                    self.count += 1.0;
                    w + self.by * (2.3 * self.count).sin()
                });
                let data = TensorData::new(moved.collect::<Vec<f64>>(), shape);
                Tensor::from_data(data, &Default::default()).require_grad()
            })
        }
    }
    net.map(&mut Shake { by, count: 0.0 })
}

/// Numbers between -1 and 1, the same for the same seed, `[rows, columns]`.
pub(crate) fn numbers<B: Backend>(rows: usize, columns: usize, seed: f32) -> Tensor<B, 2> {
    let values = (0..rows * columns).map(|k| (seed + 1.7 * k as f32).sin());
    let data = TensorData::new(values.collect::<Vec<f32>>(), [rows, columns]);
    Tensor::from_data(data, &Default::default())
}

/// Fails unless both have as many numbers, each within the tolerance of the other.
#[track_caller]
pub(crate) fn assert_close(a: Vec<f64>, b: Vec<f64>, tolerance: f64, label: &str) {
    assert_eq!(a.len(), b.len(), "{label}");
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() <= tolerance, "{label}: {a} and {b}");
    }
}
