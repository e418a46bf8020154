//! `isomorph warp`: points of any file moved along the motion of a run.

use std::path::PathBuf;

use clap::Args;
use isomorph::Trained;

use super::{BackendArgs, Result, print};

/// Move landmarks, polylines, or any mesh along the motion of a run
///
/// A PLY or OBJ file is written again with its vertices moved. All else in it stays: faces, edges, cells, colours.
/// Files of other formats become PLY, OBJ, text or an array of numpy. The points need not be those that the run was
/// trained on, but should lie near the shapes.
#[derive(Debug, Args)]
pub(super) struct WarpArgs {
    /// Folder of the run
    run: PathBuf,

    /// File of the points, in the coordinates of the shapes
    #[arg(long, value_name = "FILE")]
    points: PathBuf,

    /// Time at which the points are where the file says [default: that of the first shape, 0]
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    from: Option<f64>,

    /// Time to which they are moved [default: that of the last shape, 1]
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    to: Option<f64>,

    /// Output file: .ply or .obj; or .xyz or .npy, which hold the points alone
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,

    #[command(flatten)]
    place: BackendArgs,
}

pub(super) fn run(args: WarpArgs) -> Result {
    let trained = Trained::open(&args.run, args.place.backend()?)?;
    let [first, last] = trained.span();
    let (from, to) = (args.from.unwrap_or(first), args.to.unwrap_or(last));
    let warped = trained.warp(&args.points, [from, to], &args.output, |_| {})?;
    let mut text = format!(
        "{}: {} points moved from time {} to {}, by {:.3} in the mean and {:.3} at most\n",
        args.output.display(),
        warped.points,
        from,
        to,
        warped.mean,
        warped.longest
    );
    if warped.outside > 0 {
        text += &format!(
            "warning: {} of them lie outside the box round the shapes, where the motion is a guess\n",
            warped.outside
        );
    }
    print(&text)
}
