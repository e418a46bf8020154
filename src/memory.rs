//! The process's peak memory: the largest part of its memory that was ever in RAM at once.
//!
//! Linux: `VmHWM` of `/proc/self/status`. The `ru_maxrss` of `getrusage` will not do there: it
//! outlives `exec`, so that a process started by a larger one, as by `cargo run`, is told the
//! peak of its parent. Other Unix systems: `ru_maxrss`, bytes on Apple's and kibibytes elsewhere.
//!
//! Linux counts pages in batches per processor: the mark is off by some hundred kibibytes on a few
//! processors and by some mebibytes on many, and may fall by as much.

/// Peak resident memory of this process in bytes, or `None` where the system does not say.
///
/// Memory of a graphics card is not part of it.
#[cfg(target_os = "linux")]
pub(crate) fn peak_memory_bytes() -> Option<u64> {
    high_water_mark(&std::fs::read_to_string("/proc/self/status").ok()?)
}

/// Peak resident memory of this process in bytes, or `None` where the system does not say.
///
/// Memory of a graphics card is not part of it.
#[cfg(all(unix, not(target_os = "linux")))]
pub fn peak_memory_bytes() -> Option<u64> {
    use nix::sys::resource::{UsageWho, getrusage};
    let unit = if cfg!(target_vendor = "apple") {
        1
    } else {
        1024
    };
    let peak = getrusage(UsageWho::RUSAGE_SELF).ok()?.max_rss();
    u64::try_from(peak).ok()?.checked_mul(unit)
}

/// Peak resident memory of this process in bytes, or `None` where the system does not say.
///
/// Memory of a graphics card is not part of it.
#[cfg(not(unix))]
pub fn peak_memory_bytes() -> Option<u64> {
    None
}

/// The line `VmHWM:    2180 kB` of a process's status, in bytes; the kernel's kB are kibibytes.
#[cfg(target_os = "linux")]
fn high_water_mark(status: &str) -> Option<u64> {
    let value = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = value.trim().strip_suffix("kB")?.trim_end().parse().ok()?;
    kibibytes.checked_mul(1024)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    const MIB: u64 = 1 << 20;

    #[test]
    fn the_peak_covers_what_was_written_to_and_outlives_it() {
        // A byte in each page of 4096: pages that nobody wrote to are not resident.
        let mut held = vec![0_u8; 64 * MIB as usize];
        held.iter_mut().step_by(4096).for_each(|byte| *byte = 1);
        drop(std::hint::black_box(held));
        let peak = peak_memory_bytes().expect("this system says");
        // A quarter less than was held, for the kernel's counting in batches.
        assert!(
            peak >= 48 * MIB,
            "{peak} bytes after 64 MiB: kibibytes taken for bytes?"
        );
        // 64 MiB taken for kibibytes would be 64 GiB.
        assert!(
            peak < 64 * 1024 * MIB,
            "{peak} bytes: bytes taken for kibibytes?"
        );
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_mark_is_read_in_kibibytes() {
        let status = "Name:\tisomorph\nVmPeak:\t   12345 kB\nVmHWM:\t    2180 kB\nVmRSS:\t 99 kB\n";
        assert_eq!(high_water_mark(status), Some(2_232_320), "2180 * 1024");
        assert_eq!(
            high_water_mark("Name:\tisomorph\n"),
            None,
            "a kernel thread has none"
        );
    }
}
