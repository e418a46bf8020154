//! `isomorph field`: the distance field and the velocities of a run on a grid, for numpy.

use std::path::PathBuf;

use clap::Args;
use isomorph::Trained;

use super::times::times_of;
use super::{BackendArgs, Result, print};

/// Write the distance field and the velocities on a grid, as an archive that numpy reads
///
/// The arrays are times, x, y, z, f and velocity, in the coordinates and the unit of the shapes. f has a side for
/// the time and one for each axis, and is negative inside.
#[derive(Debug, Args)]
pub(super) struct FieldArgs {
    /// Folder of the run
    run: PathBuf,

    /// Nodes of the grid along the longest side of the box
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(2..=2048))]
    grid: u32,

    /// Number of times, even from the first shape to the last
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    frames: u32,

    /// Times instead of --frames, such as 0.25,0.5: from 0 to 1, or in the unit of the recipe's key frames.
    /// keys: those of all key frames
    #[arg(
        long,
        value_name = "A,B,C",
        value_delimiter = ',',
        allow_hyphen_values = true,
        conflicts_with = "frames"
    )]
    times: Vec<String>,

    /// Output file
    #[arg(long, short, value_name = "FILE", default_value = "field.npz")]
    output: PathBuf,

    #[command(flatten)]
    place: BackendArgs,
}

pub(super) fn run(args: FieldArgs) -> Result {
    let trained = Trained::open(&args.run, args.place.backend()?)?;
    let times = times_of(&trained, &args.times, args.frames as usize)?;
    let found = trained.write_field(args.grid as usize, &times, &args.output, |_, _| {})?;
    let [nx, ny, nz] = found.nodes;
    let arrays = match found.has_velocity {
        true => "times, x, y, z, f and velocity",
        false => "times, x, y, z and f",
    };
    print(&format!(
        "{}: {nx} x {ny} x {nz} nodes at {} times; arrays {arrays}\n",
        args.output.display(),
        found.times
    ))
}
