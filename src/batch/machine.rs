//! What this machine has for jobs.

use crate::backend::Backend;

/// Cores of this machine, or of the task that this is of a Slurm job: not all sites bind tasks to their cores.
pub fn cores() -> usize {
    let of_task = std::env::var("SLURM_CPUS_PER_TASK").ok();
    let of_task = of_task.and_then(|text| text.parse().ok());
    of_task.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from))
}

/// Jobs at a time where nothing else is asked for, of `memory_bytes` each: a step gains little from more than two cores.
pub fn at_a_time(memory_bytes: Option<u64>, backend: &Backend) -> usize {
    if matches!(backend, Backend::Wgpu { .. }) {
        return 1;
    }
    let by_cores = (cores() / 2).max(1);
    let memory = memory_bytes.zip(available_memory());
    let by_memory = memory.map_or(by_cores, |(each, all)| (all / each.max(1)) as usize);
    by_cores.min(by_memory).max(1)
}

/// Memory that is free for new processes, where the system says.
fn available_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kilobytes: u64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(1024 * kilobytes)
}
