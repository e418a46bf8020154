//! What the operators cost in training: the values and derivatives of `f` and `V`, and the backward pass by
//! the weights from the sum of the squares of all of them.
//!
//! An item is a point. `forward` and `nested` are the recipe's `training.derivatives`: one written-out sweep
//! (backwards through `f` and for `J^T w`, forwards through `V`), or repeated autodiff. README.md beside this
//! file says how to read the numbers.

// The thrice lifted autodiff types nest deeper than the default limit allows.
#![recursion_limit = "256"]

mod backends;

use std::fmt;

use burn::module::AutodiffModule;
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;
use divan::Bencher;
use divan::counter::ItemsCount;
use isomorph_model::autodiff::Activation;
use isomorph_model::operators::{Derivatives, Operators, VelocityRequest};
use isomorph_model::{
    ImplicitNet, ImplicitNetConfig, ModelBackend, TrainBackend, VelocityNet, VelocityNetConfig,
};

use backends::{numbers, on_each_backend};

fn main() {
    divan::main();
}

/// Hidden layers and columns of both networks, and how many points they are evaluated at.
#[derive(Clone, Copy, Debug)]
struct Size {
    depth: usize,
    width: usize,
    points: usize,
}

impl Size {
    const fn new(depth: usize, width: usize, points: usize) -> Self {
        Self {
            depth,
            width,
            points,
        }
    }
}

impl fmt::Display for Size {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            depth,
            width,
            points,
        } = self;
        write!(out, "{depth}x{width}, {points} points")
    }
}

/// `bench --size small`; what one core is given at a time of `shipped`; networks of `shipped` as a whole.
const SIZES: [Size; 3] = [
    Size::new(6, 128, 1000),
    Size::new(8, 256, 256),
    Size::new(8, 256, 4000),
];

/// A size, and how derivatives by the input are taken.
#[derive(Clone, Copy, Debug)]
struct Case {
    size: Size,
    derivatives: Derivatives,
}

impl fmt::Display for Case {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = match self.derivatives {
            Derivatives::Nested => "nested",
            Derivatives::Forward => "forward",
        };
        write!(out, "{}, {word}", self.size)
    }
}

/// Every size in both ways.
fn cases() -> impl Iterator<Item = Case> {
    SIZES.into_iter().flat_map(|size| {
        [Derivatives::Forward, Derivatives::Nested].map(|derivatives| Case { size, derivatives })
    })
}

/// Both networks as the preset `paper` makes them, and where they are evaluated.
struct Fixture<B: Backend> {
    f: ImplicitNet<B>,
    v: VelocityNet<B>,
    /// Positions, `[n, 3]`.
    x: Tensor<B, 2>,
    /// Times, `[n, 1]`.
    t: Tensor<B, 2>,
    /// A direction at each point, `[n, 3]`.
    w: Tensor<B, 2>,
}

impl<B: ModelBackend> Fixture<B> {
    fn new(size: Size) -> Self {
        let Size {
            depth,
            width,
            points,
        } = size;
        let activation = Activation::Softplus { beta: 100.0 };
        let implicit = ImplicitNetConfig {
            depth,
            width,
            activation,
            frequencies: 6,
            skip: 0,
            sphere_radius: 0.28,
        };
        let velocity = VelocityNetConfig {
            depth,
            width,
            activation,
            frequencies: 6,
            skip: 0,
            time_dependent: false,
        };
        let device = B::Device::default();
        B::seed(&device, 0);
        Self {
            f: implicit.init(0, &device),
            v: velocity.init(0, &device),
            x: numbers(points, 3),
            t: numbers(points, 1) + 0.5,
            w: numbers(points, 3),
        }
    }

    fn x(&self) -> Tensor<B, 2> {
        self.x.clone()
    }

    fn t(&self) -> Tensor<B, 2> {
        self.t.clone()
    }
}

/// Times `loss` and its backward pass by the weights.
fn trained<B: TrainBackend>(
    bencher: Bencher<'_, '_>,
    size: Size,
    loss: impl Fn(&Fixture<B>) -> Tensor<B, 1>,
) {
    let on = Fixture::new(size);
    bencher
        .counter(ItemsCount::new(size.points))
        .bench_local(|| loss(&on).backward());
}

/// The sum of the squares: a loss on which every element has a bearing of its own.
fn squares<B: Backend, const D: usize>(tensor: Tensor<B, D>) -> Tensor<B, 1> {
    (tensor.clone() * tensor).sum()
}

/// `V`, `J`, and the Laplacian if it is asked for.
fn velocity_jet<B: TrainBackend>(bencher: Bencher<'_, '_>, case: Case, laplacian: bool) {
    let request = VelocityRequest {
        laplacian,
        rate: false,
    };
    trained::<B>(bencher, case.size, |on| {
        let jet = case
            .derivatives
            .velocity_jet(&on.v, on.x(), on.t(), request);
        let first = squares(jet.value) + squares(jet.jacobian);
        match jet.laplacian {
            None => first,
            Some(laplacian) => first + squares(laplacian),
        }
    });
}

on_each_backend! {
    /// `f` without a graph, as in extraction.
    #[divan::bench(args = SIZES, sample_count = 10, sample_size = 1)]
    fn f_value_alone(bencher: Bencher<'_, '_>, size: Size) {
        let on = Fixture::<Train>::new(size);
        let (f, x, t) = (on.f.valid(), on.x().inner(), on.t().inner());
        bencher
            .counter(ItemsCount::new(size.points))
            .bench_local(|| -> Tensor<Plain, 2> { f.forward(x.clone(), t.clone()) });
    }

    /// `f`.
    #[divan::bench(args = SIZES, sample_count = 5, sample_size = 1)]
    fn f_value(bencher: Bencher<'_, '_>, size: Size) {
        trained::<Train>(bencher, size, |on| squares(on.f.forward(on.x(), on.t())));
    }

    /// `f`, `grad f` and `f_t`.
    #[divan::bench(args = cases(), sample_count = 5, sample_size = 1)]
    fn f_jet(bencher: Bencher<'_, '_>, case: Case) {
        trained::<Train>(bencher, case.size, |on| {
            let jet = case.derivatives.implicit_jet(&on.f, on.x(), on.t());
            squares(jet.value) + squares(jet.gradient) + squares(jet.rate)
        });
    }

    /// `V`.
    #[divan::bench(args = SIZES, sample_count = 5, sample_size = 1)]
    fn v_value(bencher: Bencher<'_, '_>, size: Size) {
        trained::<Train>(bencher, size, |on| squares(on.v.forward(on.x(), on.t())));
    }

    /// `V` and `J`.
    #[divan::bench(args = cases(), sample_count = 5, sample_size = 1)]
    fn v_jet(bencher: Bencher<'_, '_>, case: Case) {
        velocity_jet::<Train>(bencher, case, false);
    }

    /// `V`, `J` and the Laplacian.
    #[divan::bench(args = cases(), sample_count = 5, sample_size = 1)]
    fn v_jet_laplacian(bencher: Bencher<'_, '_>, case: Case) {
        velocity_jet::<Train>(bencher, case, true);
    }

    /// `V` and `J^T w`.
    #[divan::bench(args = cases(), sample_count = 5, sample_size = 1)]
    fn v_pulled_back(bencher: Bencher<'_, '_>, case: Case) {
        trained::<Train>(bencher, case.size, |on| {
            let (value, pulled) =
                case.derivatives
                    .pulled_back(&on.v, on.x(), on.t(), on.w.clone());
            squares(value) + squares(pulled)
        });
    }
}
