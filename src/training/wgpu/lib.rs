//! Training on burn-wgpu: GPUs, through Vulkan. The methods that isomorph is compared with run on
//! burn-flex alone.

// The thrice lifted autodiff types nest deeper than the default limit allows.
#![recursion_limit = "256"]

use std::sync::{Mutex, PoisonError};

use burn_autodiff::Autodiff;
use burn_wgpu::graphics::Vulkan;
use burn_wgpu::{RuntimeOptions, Wgpu, WgpuDevice, init_setup};
use isomorph_training::engine::{DeviceError, Engine, On, OwnMethods, caught};

/// The engine of a device: `default`, `cpu`, or a kind of GPU with an optional number, as in `discrete:1`.
///
/// # Errors
/// [`DeviceError`] if the name is none, or the driver gives no device.
pub fn engine(device: Option<&str>) -> Result<Box<dyn Engine>, DeviceError> {
    let device = named(device)?;
    let name = set_up(&device)?;
    let engine = On::<Autodiff<Wgpu>, OwnMethods>::new(device).named(name);
    engine.opens()?;
    Ok(Box::new(engine))
}

/// Sets a device up, the first time that this process opens it, and gives the name that its driver has for it.
fn set_up(device: &WgpuDevice) -> Result<String, DeviceError> {
    static KNOWN: Mutex<Vec<(WgpuDevice, String)>> = Mutex::new(Vec::new());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, name)) = known.iter().find(|(set_up, _)| set_up == device) {
        return Ok(name.clone());
    }
    let setup = caught(|| init_setup::<Vulkan>(device, RuntimeOptions::default()))?;
    let adapter = setup.adapter.get_info();
    let driver = format!("{} {}", adapter.driver, adapter.driver_info);
    let name = format!("{} ({})", adapter.name, driver.trim());
    known.push((device.clone(), name.clone()));
    Ok(name)
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
