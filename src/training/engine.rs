//! The border to training: a backend, and a method in training on it, without their types.
//!
//! ```text
//! Engine --method(recipe, bounds)--> Trainer --deformation()--> Deformation
//! ```
//!
//! [`On`] is generic, and each package beside this one instantiates it once.

use std::io;
use std::marker::PhantomData;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use burn::tensor::backend::Backend;
use burn::tensor::{Distribution, Tensor};
use isomorph_model::{TrainBackend, product};

use crate::data::{Bounds, Guide, TrainingData};
use crate::deformation::{Deformation, OnHost};
use crate::in_turns::{InTurns, Kept};
use crate::method::{self, Method, Through};
use crate::posed::{Slopes, mean_of};
use crate::probe::{self, Reading};
use crate::recipe::Recipe;
use crate::records::{RecordError, Records};
use crate::report::{Phase, Rates, TermReport};
use crate::samples::Part;
use crate::weights::Weights;
use crate::workers::Workers;

/// Why a device cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DeviceError {
    /// It has another name or number.
    #[error("{found}: {allowed}")]
    Name {
        /// What was asked for.
        found: String,
        /// What there is.
        allowed: &'static str,
    },
    /// The driver gave none.
    #[error("no device could be opened ({0})")]
    None(String),
}

/// The method of a recipe does not run on this backend.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "method.name = \"{method}\": runs on the backend flex only, like all methods that isomorph is compared with; use that backend"
)]
pub struct NotHere {
    /// Its name.
    pub method: String,
}

/// A backend on one of its devices.
pub trait Engine: Send + Sync {
    /// The backend's own name.
    fn backend(&self) -> String;

    /// The device's own name.
    fn device(&self) -> String;

    /// The method of a recipe before its first step; `bounds` encloses all key frames, normalised.
    ///
    /// # Errors
    /// [`NotHere`] if it is not compiled for this backend.
    fn method(&self, recipe: &Recipe, bounds: &Bounds) -> Result<Box<dyn Trainer>, NotHere>;

    /// Whether it computes on the processor itself, in the host's memory.
    fn is_processor(&self) -> bool;

    /// What the networks of a recipe and their layers give here ([`crate::probe`]).
    fn readings(&self, recipe: &Recipe) -> Vec<Reading>;

    /// GFLOP per second of a product of `4000 x 512` by `512 x 512`, the median of seven.
    fn product_rate(&self) -> f64;
}

/// A method in training.
pub trait Trainer {
    /// Makes step `step`, counted from 0: one step of the optimisers. The unweighted terms with their
    /// weights if `read` asks for them.
    fn advance(&mut self, data: &TrainingData, step: usize, read: bool) -> Option<Vec<TermReport>>;

    /// Waits until the device has done all that it was given.
    fn wait(&self);

    /// The phase of a step, counted from 0.
    fn phase(&self, step: usize) -> Phase;

    /// The learning rates of a step.
    fn rates(&self, step: usize) -> Rates;

    /// The networks and how many weights each has.
    fn networks(&self) -> Vec<(&'static str, usize)>;

    /// Networks and optimiser states.
    ///
    /// # Errors
    /// What burn's recorder says.
    fn records(&self) -> io::Result<Records>;

    /// Takes networks and optimiser states.
    ///
    /// # Errors
    /// [`RecordError`] if one is missing or is not of this method.
    fn restore(&mut self, records: &Records) -> Result<(), RecordError>;

    /// Starts with a velocity field that is there already: see [`Method::take`].
    fn take(&mut self, _: &dyn Guide) {}

    /// Takes what a run through the first `known` key frames has learned, and goes on with further ones.
    ///
    /// # Errors
    /// As of [`Self::restore`].
    fn grow(&mut self, records: &Records, known: usize) -> Result<(), RecordError>;

    /// Learns little of the first `known` key frames: see [`Method::spare`].
    fn spare(&mut self, known: usize);

    /// What the networks have learned, as plain arrays; `None` if the method has none that others can use.
    fn weights(&self) -> Option<Weights>;

    /// What has been learned so far.
    fn deformation(&self) -> Box<dyn Deformation>;
}

/// Which methods are compiled for a backend: each is a large part of the build.
pub trait MethodSet: Send + Sync + 'static {
    /// The method of a recipe, `None` if it is not among these.
    fn build<B: TrainBackend>(
        recipe: &Recipe,
        bounds: &Bounds,
        device: &B::Device,
    ) -> Option<Box<dyn Method<B>>>;
}

/// The default method and the paper's.
pub struct OwnMethods;

impl MethodSet for OwnMethods {
    fn build<B: TrainBackend>(
        recipe: &Recipe,
        bounds: &Bounds,
        device: &B::Device,
    ) -> Option<Box<dyn Method<B>>> {
        method::own(recipe, bounds, device)
    }
}

/// These and all that they are compared with.
pub struct AllMethods;

impl MethodSet for AllMethods {
    fn build<B: TrainBackend>(
        recipe: &Recipe,
        bounds: &Bounds,
        device: &B::Device,
    ) -> Option<Box<dyn Method<B>>> {
        method::own(recipe, bounds, device).or_else(|| method::baseline(recipe, bounds, device))
    }
}

/// A backend `B` on a device, with the methods of `M`.
pub struct On<B: TrainBackend, M> {
    device: B::Device,
    /// The device's own name, where it has one.
    name: Option<String>,
    methods: PhantomData<M>,
}

impl<B: TrainBackend, M: MethodSet> On<B, M> {
    /// On this device.
    pub fn new(device: B::Device) -> Self {
        Self {
            device,
            name: None,
            methods: PhantomData,
        }
    }

    /// The same with the device's own name.
    #[must_use]
    pub fn named(self, name: String) -> Self {
        Self {
            name: Some(name),
            ..self
        }
    }

    /// Makes one value on the device: drivers that are missing make burn-wgpu panic.
    ///
    /// # Errors
    /// [`DeviceError::None`] with the first line that the driver gave.
    pub fn opens(&self) -> Result<(), DeviceError> {
        caught(|| {
            Tensor::<B::InnerBackend, 1>::ones([1], &self.device).into_data();
        })
    }
}

/// What `open` gives; burn-wgpu panics where a driver is missing.
///
/// # Errors
/// [`DeviceError::None`] with the first line that the driver gave.
pub fn caught<T>(open: impl FnOnce() -> T) -> Result<T, DeviceError> {
    // The first panic, on whichever thread, says why; those that follow only pass it on.
    let first = Arc::new(Mutex::new(None));
    let seen = Arc::clone(&first);
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let text = panic
            .payload_as_str()
            .unwrap_or("the driver gave no reason");
        if let Ok(mut first) = seen.lock() {
            first.get_or_insert_with(|| text.lines().next().unwrap_or_default().to_owned());
        }
    }));
    let opened = catch_unwind(AssertUnwindSafe(open));
    std::panic::set_hook(hook);
    opened.map_err(|_panic| {
        let problem = first.lock().ok().and_then(|mut first| first.take());
        DeviceError::None(problem.unwrap_or_default())
    })
}

impl<B: TrainBackend, M: MethodSet> Engine for On<B, M> {
    fn backend(&self) -> String {
        B::InnerBackend::name(&self.device)
    }

    fn device(&self) -> String {
        let name = self.name.clone();
        name.unwrap_or_else(|| format!("{:?}", self.device))
    }

    fn is_processor(&self) -> bool {
        B::POINTS_AT_A_TIME.is_some()
    }

    fn readings(&self, recipe: &Recipe) -> Vec<Reading> {
        probe::readings::<B>(recipe, &self.device)
    }

    fn method(&self, recipe: &Recipe, bounds: &Bounds) -> Result<Box<dyn Trainer>, NotHere> {
        let method = M::build::<B>(recipe, bounds, &self.device).ok_or_else(|| NotHere {
            method: recipe.method.name.to_string(),
        })?;
        Ok(Box::new(InTraining {
            method,
            device: self.device.clone(),
        }))
    }

    fn product_rate(&self) -> f64 {
        let matrix = |rows| {
            Tensor::<B::InnerBackend, 2>::random([rows, 512], Distribution::Default, &self.device)
        };
        let (a, b) = (matrix(4000), matrix(512));
        let multiply = || {
            let clock = Instant::now();
            let c = product(a.clone(), b.clone());
            // A device that fails shows in the next value read from it.
            let _ = B::sync(&self.device);
            drop(c);
            clock.elapsed().as_secs_f64()
        };
        multiply();
        let mut seconds: Vec<f64> = (0..7).map(|_| multiply()).collect();
        seconds.sort_by(f64::total_cmp);
        2.0 * 4000.0 * 512.0 * 512.0 / 1e9 / seconds[seconds.len() / 2]
    }
}

/// A method on its backend.
struct InTraining<B: TrainBackend> {
    method: Box<dyn Method<B>>,
    device: B::Device,
}

impl<B: TrainBackend> Trainer for InTraining<B> {
    fn advance(&mut self, data: &TrainingData, step: usize, read: bool) -> Option<Vec<TermReport>> {
        let method = &*self.method;
        let parts = match B::POINTS_AT_A_TIME {
            Some(_) => method.parts(),
            None => 1,
        };
        // Once for all parts: each takes its share.
        let drawn = method.draw(data, step);
        let done = Workers::shared().map(parts, |index| {
            let part = Part { index, of: parts };
            method
                .objective(data, &drawn.part(part), step)
                .solve(parts, read)
        });
        let (reports, gradients): (Vec<_>, Vec<_>) = done.into_iter().unzip();
        self.method.descend(step, &mut Slopes::new(gradients));
        read.then(|| mean_of(&reports))
    }

    fn wait(&self) {
        // A device that fails shows in the next value read from it.
        let _ = B::sync(&self.device);
    }

    fn phase(&self, step: usize) -> Phase {
        self.method.phase(step)
    }

    fn rates(&self, step: usize) -> Rates {
        self.method.rates(step)
    }

    fn networks(&self) -> Vec<(&'static str, usize)> {
        self.method.networks()
    }

    fn records(&self) -> io::Result<Records> {
        self.method.records()
    }

    fn restore(&mut self, records: &Records) -> Result<(), RecordError> {
        self.method.restore(records)
    }

    fn take(&mut self, guide: &dyn Guide) {
        self.method.take(guide);
    }

    fn grow(&mut self, records: &Records, known: usize) -> Result<(), RecordError> {
        self.method.grow(records, known)
    }

    fn spare(&mut self, known: usize) {
        self.method.spare(known);
    }

    fn weights(&self) -> Option<Weights> {
        self.method.weights()
    }

    fn deformation(&self) -> Box<dyn Deformation> {
        let device = self.device.clone();
        let on_host = move |geometry, motion| OnHost {
            geometry,
            motion,
            device: device.clone(),
        };
        match self.method.through() {
            Some(Through { times, part }) => {
                let of = move |s, _: &Kept<_>| {
                    let (geometry, motion) = part(s);
                    on_host(Some(geometry), Some(motion))
                };
                Box::new(InTurns::new(times, Box::new(of)))
            }
            None => Box::new(on_host(self.method.geometry(), self.method.motion())),
        }
    }
}
