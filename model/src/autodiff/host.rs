//! The backends whose tensors live in the host's memory: the kernels of this crate in place of composed
//! operations.

use burn::tensor::TensorData;
use burn::tensor::ops::FloatTensor;

use super::activation::Activation;
use super::backend::ModelBackend;
use super::kernel;
use super::lanes::Lanes;
use super::machine::{self, Matrix};

/// Measured on networks from 128 to 512 wide (`model/benches/README.md`): twice as many are a little faster
/// still on two cores, and leave nothing for the others of a machine with more.
const POINTS_AT_A_TIME: usize = 512;

/// Access to the elements.
trait HostBackend: ModelBackend {
    /// Calls `action` with the elements, row by row: where they are if they lie so, else copied.
    fn read<T>(tensor: &FloatTensor<Self>, action: impl FnOnce(&[f32]) -> T) -> T;

    /// Calls `action` with the tensor as a matrix: where it is if its elements lie row by row or column by
    /// column, else copied.
    fn matrix<T>(tensor: &FloatTensor<Self>, action: impl FnOnce(Matrix<'_>) -> T) -> T;

    /// The shape.
    fn shape(tensor: &FloatTensor<Self>) -> [usize; 2];

    /// A tensor of these elements.
    fn from_rows(elements: Vec<f32>, shape: [usize; 2]) -> FloatTensor<Self> {
        // The memory of the host is the only device of these backends.
        Self::float_from_data(TensorData::new(elements, shape), &Default::default())
    }
}

fn product<B: HostBackend>(a: FloatTensor<B>, b: FloatTensor<B>) -> FloatTensor<B> {
    let shape = [B::shape(&a)[0], B::shape(&b)[1]];
    let out = B::matrix(&a, |a| B::matrix(&b, |b| machine::product(a, b)));
    B::from_rows(out, shape)
}

fn jet<B: HostBackend>(
    z: FloatTensor<B>,
    bias: FloatTensor<B>,
    lanes: Lanes,
    activation: Activation,
) -> (FloatTensor<B>, FloatTensor<B>) {
    let [rows, columns] = B::shape(&z);
    let (out, slope) = B::read(&z, |z| {
        B::read(&bias, |bias| kernel::jet(z, bias, lanes, activation))
    });
    (
        B::from_rows(out, [rows, columns]),
        B::from_rows(slope, [rows / lanes.blocks(), columns]),
    )
}

fn jet_backward<B: HostBackend>(
    z: Option<FloatTensor<B>>,
    out: FloatTensor<B>,
    slope: FloatTensor<B>,
    grad: FloatTensor<B>,
    lanes: Lanes,
    activation: Activation,
) -> FloatTensor<B> {
    let with_z = |z: &[f32]| {
        B::read(&out, |out| {
            B::read(&slope, |slope| {
                B::read(&grad, |grad| {
                    kernel::jet_backward(z, out, slope, grad, lanes, activation)
                })
            })
        })
    };
    let by_z = match &z {
        Some(z) => B::read(z, with_z),
        // Without lanes the kernel reads nothing of what entered.
        None => with_z(&[]),
    };
    B::from_rows(by_z, B::shape(&grad))
}

fn slope_backward<B: HostBackend>(
    out: FloatTensor<B>,
    slope: FloatTensor<B>,
    grad: FloatTensor<B>,
    activation: Activation,
) -> FloatTensor<B> {
    let by_z = B::read(&out, |out| {
        B::read(&slope, |slope| {
            B::read(&grad, |grad| {
                kernel::slope_backward(out, slope, grad, activation)
            })
        })
    });
    B::from_rows(by_z, B::shape(&grad))
}

/// The overrides, the same for each of them.
macro_rules! on_the_host {
    ($backend:ty) => {
        impl ModelBackend for $backend {
            const POINTS_AT_A_TIME: Option<usize> = Some(POINTS_AT_A_TIME);

            fn product(a: FloatTensor<Self>, b: FloatTensor<Self>) -> FloatTensor<Self> {
                product::<Self>(a, b)
            }

            fn activation_jet(
                z: FloatTensor<Self>,
                bias: FloatTensor<Self>,
                lanes: Lanes,
                activation: Activation,
            ) -> (FloatTensor<Self>, FloatTensor<Self>) {
                jet::<Self>(z, bias, lanes, activation)
            }

            fn activation_jet_backward(
                z: Option<FloatTensor<Self>>,
                out: FloatTensor<Self>,
                slope: FloatTensor<Self>,
                grad: FloatTensor<Self>,
                lanes: Lanes,
                activation: Activation,
            ) -> FloatTensor<Self> {
                jet_backward::<Self>(z, out, slope, grad, lanes, activation)
            }

            fn activation_slope_backward(
                out: FloatTensor<Self>,
                slope: FloatTensor<Self>,
                grad: FloatTensor<Self>,
                activation: Activation,
            ) -> FloatTensor<Self> {
                slope_backward::<Self>(out, slope, grad, activation)
            }
        }
    };
}

#[cfg(feature = "flex")]
on_the_host!(burn_flex::Flex);

#[cfg(feature = "flex")]
impl HostBackend for burn_flex::Flex {
    fn read<T>(tensor: &FloatTensor<Self>, action: impl FnOnce(&[f32]) -> T) -> T {
        match tensor.layout().contiguous_offsets() {
            Some((from, to)) => action(&tensor.storage()[from..to]),
            None => action(tensor.to_contiguous().storage()),
        }
    }

    fn matrix<T>(tensor: &FloatTensor<Self>, action: impl FnOnce(Matrix<'_>) -> T) -> T {
        let [rows, columns] = Self::shape(tensor);
        match tensor.layout().transpose(0, 1).contiguous_offsets() {
            Some((from, to)) => {
                let elements = &tensor.storage()[from..to];
                action(Matrix::by_columns(elements, rows, columns))
            }
            None => Self::read(tensor, |elements| {
                action(Matrix::by_rows(elements, rows, columns))
            }),
        }
    }

    fn shape(tensor: &FloatTensor<Self>) -> [usize; 2] {
        let shape = tensor.layout().shape();
        [shape[0], shape[1]]
    }
}

#[cfg(feature = "ndarray")]
on_the_host!(burn_ndarray::NdArray);

#[cfg(feature = "ndarray")]
impl HostBackend for burn_ndarray::NdArray {
    fn read<T>(tensor: &FloatTensor<Self>, action: impl FnOnce(&[f32]) -> T) -> T {
        let burn_ndarray::NdArrayTensor::F32(storage) = tensor else {
            unreachable!("the element type of this backend is f32");
        };
        let view = storage.view();
        match view.as_slice() {
            Some(rows) => action(rows),
            None => action(&view.iter().copied().collect::<Vec<_>>()),
        }
    }

    fn matrix<T>(tensor: &FloatTensor<Self>, action: impl FnOnce(Matrix<'_>) -> T) -> T {
        let [rows, columns] = Self::shape(tensor);
        let burn_ndarray::NdArrayTensor::F32(storage) = tensor else {
            unreachable!("the element type of this backend is f32");
        };
        match storage.view().t().as_slice() {
            Some(elements) => action(Matrix::by_columns(elements, rows, columns)),
            None => Self::read(tensor, |elements| {
                action(Matrix::by_rows(elements, rows, columns))
            }),
        }
    }

    fn shape(tensor: &FloatTensor<Self>) -> [usize; 2] {
        let burn_ndarray::NdArrayTensor::F32(storage) = tensor else {
            unreachable!("the element type of this backend is f32");
        };
        [storage.shape()[0], storage.shape()[1]]
    }
}
