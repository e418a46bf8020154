//! `isomorph map`: which vertex of the target each vertex of the source goes to.

use std::path::PathBuf;

use clap::Args;
use isomorph::Trained;

use super::{BackendArgs, Result, print};

/// Write for each vertex of the source the vertex of the target that it goes to
///
/// The file has source_index,target_index,confidence on each line, so that data.correspondences takes it.
#[derive(Debug, Args)]
pub(super) struct MapArgs {
    /// Folder of the run
    run: PathBuf,

    /// Output file
    #[arg(long, short, value_name = "FILE", default_value = "map.csv")]
    output: PathBuf,

    #[command(flatten)]
    place: BackendArgs,
}

pub(super) fn run(args: MapArgs) -> Result {
    let trained = Trained::open(&args.run, args.place.backend()?)?;
    let map = trained.dense_map()?;
    map.write_csv(&args.output)?;
    let sure = map.pairs.iter().filter(|pair| pair.confidence >= 0.5);
    print(&format!(
        "{}: {} vertices; {} with a confidence of 0.5 or more\n\
         target      {:.1} % of its vertices are reached\n\
         round trip  {:.3} in the median, {:.3} at 95 %, in the unit of the shapes\n",
        args.output.display(),
        map.pairs.len(),
        sure.count(),
        100.0 * map.reached,
        map.round_trip(0.5),
        map.round_trip(0.95)
    ))
}
