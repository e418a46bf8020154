//! The backends by value: where networks are trained and evaluated.

use std::fmt;
use std::str::FromStr;

use isomorph_training::engine::{DeviceError, Engine};

use crate::error::Error;

/// Where networks are trained and evaluated. All backends run the same code and agree within the rounding
/// of single precision.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Backend {
    /// burn-ndarray: any CPU.
    Ndarray,
    /// burn-flex: CPUs, with the faster matrix products. The fastest that runs on every machine.
    #[default]
    Flex,
    /// burn-wgpu: GPUs, through Vulkan.
    Wgpu {
        /// `default`, `cpu`, or a kind of GPU with an optional number, as in `discrete:1`; `None` is the
        /// default one.
        device: Option<String>,
    },
}

/// Why a backend cannot be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum BackendError {
    /// Not part of this build.
    #[error("backend {0}: not compiled in; build with the feature {0}")]
    Absent(&'static str),
    /// The device has another name or number.
    #[error("device {found}: {allowed}")]
    Device {
        /// What was requested.
        found: String,
        /// What there is.
        allowed: &'static str,
    },
    /// The driver gave no device.
    #[error(
        "backend {backend}: {problem}; install a GPU driver (or mesa-vulkan-drivers for one in software), or use the backend flex"
    )]
    NoDevice {
        /// The backend.
        backend: &'static str,
        /// What the driver said.
        problem: String,
    },
}

impl Backend {
    /// The names of all backends, compiled in or not.
    pub const NAMES: [&'static str; 3] = ["ndarray", "flex", "wgpu"];

    /// Its name, which is also that of the feature that compiles it in.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Ndarray => "ndarray",
            Self::Flex => "flex",
            Self::Wgpu { .. } => "wgpu",
        }
    }

    /// The backend of a name, on a device or on the default one.
    ///
    /// # Errors
    /// Those of parsing the name, and of [`Self::on`].
    pub fn named(name: &str, device: Option<&str>) -> Result<Self, Error> {
        let backend: Self = name.parse()?;
        match device {
            Some(device) => backend.on(device),
            None => Ok(backend),
        }
    }

    /// The same backend on a device of this name.
    ///
    /// # Errors
    /// A CPU backend has one device only, `cpu` or `default`.
    pub fn on(self, device: &str) -> Result<Self, Error> {
        match self {
            Self::Wgpu { .. } => Ok(Self::Wgpu {
                device: Some(device.to_owned()),
            }),
            _ if matches!(device, "default" | "cpu") => Ok(self),
            _ => Err(BackendError::Device {
                found: device.to_owned(),
                allowed: "this backend has one device, cpu; devices are chosen with the backend wgpu",
            }
            .into()),
        }
    }

    /// Opens its device.
    pub(crate) fn open(&self) -> Result<Box<dyn Engine>, BackendError> {
        match self {
            #[cfg(feature = "ndarray")]
            Self::Ndarray => Ok(isomorph_training_ndarray::engine()),
            #[cfg(feature = "flex")]
            Self::Flex => Ok(isomorph_training_flex::engine()),
            #[cfg(feature = "wgpu")]
            Self::Wgpu { device } => {
                isomorph_training_wgpu::engine(device.as_deref()).map_err(refused)
            }
            #[allow(unreachable_patterns, reason = "reachable where a feature is off")]
            absent => Err(BackendError::Absent(absent.name())),
        }
    }
}

#[cfg_attr(not(feature = "wgpu"), allow(dead_code, reason = "of wgpu alone"))]
fn refused(error: DeviceError) -> BackendError {
    match error {
        DeviceError::Name { found, allowed } => BackendError::Device { found, allowed },
        DeviceError::None(_) => BackendError::NoDevice {
            backend: "wgpu",
            problem: error.to_string(),
        },
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

impl FromStr for Backend {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        match name {
            "ndarray" => Ok(Self::Ndarray),
            "flex" => Ok(Self::Flex),
            "wgpu" => Ok(Self::Wgpu { device: None }),
            _ => Err(Error::usage(format!(
                "backend {name}: must be one of {}",
                Self::NAMES.join(", ")
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back_and_devices_belong_to_wgpu() {
        for name in Backend::NAMES {
            let backend: Backend = name.parse().expect("a name");
            assert_eq!(backend.to_string(), name);
        }
        let text = "gpu".parse::<Backend>().expect_err("none").to_string();
        assert_eq!(text, "backend gpu: must be one of ndarray, flex, wgpu");
        assert_eq!(Backend::Flex.on("cpu").expect("its own"), Backend::Flex);
        let text = Backend::Flex
            .on("discrete:1")
            .expect_err("a GPU")
            .to_string();
        assert!(
            text.contains("discrete:1") && text.contains("wgpu"),
            "{text}"
        );
    }
}
