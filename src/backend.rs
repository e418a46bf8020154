//! The backends by name: the only file that names a concrete one.
//!
//! A [`Task`] is generic over the backend; [`run`] runs it on the one that a user chose. Each task is
//! compiled once per backend, which is most of the build: there are few.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;
use burn_autodiff::Autodiff;
use clap::ValueEnum;
use isomorph_model::TrainBackend;

/// Where networks are evaluated and trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BackendName {
    /// burn-ndarray: any CPU.
    Ndarray,
    /// burn-flex: CPUs, with the faster matrix products.
    Flex,
    /// burn-wgpu: GPUs, through Vulkan.
    Wgpu,
}

impl BackendName {
    /// The feature that compiles it in, which is also its name.
    pub const fn feature(self) -> &'static str {
        match self {
            Self::Ndarray => "ndarray",
            Self::Flex => "flex",
            Self::Wgpu => "wgpu",
        }
    }
}

/// Why a backend cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BackendError {
    /// Not part of this build.
    #[error("--backend {0}: not compiled in; build with `--features {0}`")]
    Absent(&'static str),
    /// The device has another name or number.
    #[error("--device {found}: {allowed}")]
    Device {
        /// What was asked for.
        found: String,
        /// What there is.
        allowed: &'static str,
    },
    /// The driver gave no device.
    #[error(
        "--backend {backend}: no device could be opened ({problem}); install a GPU driver (or mesa-vulkan-drivers for one in software), or use --backend ndarray"
    )]
    NoDevice {
        /// The backend.
        backend: &'static str,
        /// What the driver said.
        problem: String,
    },
}

/// Something to be done on whichever backend was chosen.
pub trait Task {
    /// What it results in.
    type Output;

    /// Does it.
    fn run<B: TrainBackend>(self, device: B::Device) -> Self::Output;
}

/// Runs a task on a backend; `device` is a device's name there, or `None` for the default one.
///
/// # Errors
/// [`BackendError`] if the backend is not compiled in or its device cannot be opened.
pub fn run<T: Task>(
    backend: BackendName,
    device: Option<&str>,
    task: T,
) -> Result<T::Output, BackendError> {
    match backend {
        #[cfg(feature = "ndarray")]
        BackendName::Ndarray => {
            only_cpu(device)?;
            Ok(task.run::<Autodiff<burn_ndarray::NdArray>>(Default::default()))
        }
        #[cfg(feature = "flex")]
        BackendName::Flex => {
            only_cpu(device)?;
            Ok(task.run::<Autodiff<burn_flex::Flex>>(Default::default()))
        }
        #[cfg(feature = "wgpu")]
        BackendName::Wgpu => {
            let device = wgpu_device(device)?;
            opens::<burn_wgpu::Wgpu>("wgpu", &device)?;
            Ok(task.run::<Autodiff<burn_wgpu::Wgpu>>(device))
        }
        #[allow(unreachable_patterns, reason = "reachable where a feature is off")]
        absent => Err(BackendError::Absent(absent.feature())),
    }
}

/// Opens a backend's device and does nothing with it: so that what cannot work fails early.
///
/// # Errors
/// Those of [`run`].
pub fn check(backend: BackendName, device: Option<&str>) -> Result<(), BackendError> {
    struct Nothing;
    impl Task for Nothing {
        type Output = ();
        fn run<B: TrainBackend>(self, _: B::Device) {}
    }
    run(backend, device, Nothing)
}

fn only_cpu(device: Option<&str>) -> Result<(), BackendError> {
    match device {
        None | Some("default" | "cpu") => Ok(()),
        Some(other) => Err(BackendError::Device {
            found: other.to_owned(),
            allowed: "this backend has one device, cpu; devices are chosen with --backend wgpu",
        }),
    }
}

/// `default`, `cpu`, or a kind of GPU with an optional number: `discrete:1`.
#[cfg(feature = "wgpu")]
fn wgpu_device(name: Option<&str>) -> Result<burn_wgpu::WgpuDevice, BackendError> {
    use burn_wgpu::WgpuDevice;
    let name = name.unwrap_or("default");
    let (kind, number) = name.split_once(':').unwrap_or((name, "0"));
    let device = match (kind, number.parse::<usize>()) {
        ("default", Ok(0)) => Some(WgpuDevice::DefaultDevice),
        ("cpu", Ok(0)) => Some(WgpuDevice::Cpu),
        ("discrete", Ok(number)) => Some(WgpuDevice::DiscreteGpu(number)),
        ("integrated", Ok(number)) => Some(WgpuDevice::IntegratedGpu(number)),
        ("virtual", Ok(number)) => Some(WgpuDevice::VirtualGpu(number)),
        _ => None,
    };
    device.ok_or_else(|| BackendError::Device {
        found: name.to_owned(),
        allowed: "must be default, cpu, discrete, integrated or virtual, the last three with an \
                  optional number, as in discrete:1",
    })
}

/// Opens the device and makes one value there: drivers that are missing make burn-wgpu panic.
fn opens<B: Backend>(backend: &'static str, device: &B::Device) -> Result<(), BackendError> {
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
    let opened = catch_unwind(AssertUnwindSafe(|| {
        Tensor::<B, 1>::ones([1], device).into_data();
    }));
    std::panic::set_hook(hook);
    opened.map_err(|_| {
        let problem = first
            .lock()
            .ok()
            .and_then(|mut first| first.take())
            .unwrap_or_default();
        BackendError::NoDevice { backend, problem }
    })
}
