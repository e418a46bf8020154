//! bench
use clap::Args;
/// Bench
#[derive(Debug, Args)] pub(super) struct BenchArgs {}
pub(super) fn run(_: BenchArgs) -> anyhow::Result<super::Ending> { Ok(super::Ending::Done) }
