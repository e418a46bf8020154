//! Training on burn-wgpu: GPUs, through Vulkan. The methods that isomorph is compared with run on
//! burn-flex alone.

// The thrice lifted autodiff types nest deeper than the default limit allows.
#![recursion_limit = "256"]

use burn_autodiff::Autodiff;
use burn_wgpu::{Wgpu, WgpuDevice};
use isomorph_training::engine::{DeviceError, Engine, On, OwnMethods};

/// The engine of a device: `default`, `cpu`, or a kind of GPU with an optional number, as in `discrete:1`.
///
/// # Errors
/// [`DeviceError`] if the name is none, or the driver gives no device.
pub fn engine(device: Option<&str>) -> Result<Box<dyn Engine>, DeviceError> {
    let engine = On::<Autodiff<Wgpu>, OwnMethods>::new(named(device)?);
    engine.opens()?;
    Ok(Box::new(engine))
}

fn named(name: Option<&str>) -> Result<WgpuDevice, DeviceError> {
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
    device.ok_or_else(|| DeviceError::Name {
        found: name.to_owned(),
        allowed: "must be default, cpu, discrete, integrated or virtual, the last three with an \
                  optional number, as in discrete:1",
    })
}
