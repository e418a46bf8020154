//! The processor time of this process.

/// Seconds that all of its threads have worked so far, in the program and in the system for it; `None` where the
/// system does not say.
#[cfg(unix)]
pub(crate) fn seconds() -> Option<f64> {
    use nix::sys::resource::{UsageWho, getrusage};
    let usage = getrusage(UsageWho::RUSAGE_SELF).ok()?;
    let of = |time: nix::sys::time::TimeVal| time.tv_sec() as f64 + time.tv_usec() as f64 / 1e6;
    Some(of(usage.user_time()) + of(usage.system_time()))
}

/// Seconds that all of its threads have worked so far; `None` where the system does not say.
#[cfg(not(unix))]
pub(crate) fn seconds() -> Option<f64> {
    None
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn work_is_counted_in_seconds() {
        let (before, clock) = (
            seconds().expect("a system that says"),
            std::time::Instant::now(),
        );
        let mut sum = 0_u64;
        while clock.elapsed().as_millis() < 200 {
            sum = std::hint::black_box(sum + 1);
        }
        let spent = seconds().expect("a system that says") - before;
        // Other tests work beside this one, and other programs may hold it up.
        assert!(spent > 0.02, "{spent}");
    }
}
