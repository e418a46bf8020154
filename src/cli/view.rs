//! `isomorph view`: a run as a page in the browser.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use clap::Args;
use isomorph::evaluation::GroundTruth;
use isomorph::{Trained, current_report};

use super::{BackendArgs, Result, print};

/// Look at a run in the browser
///
/// The page is report.html in the run: one file that works without a network and can be passed on. It plays the
/// deformation and shows surfaces, the carried source, pairs, velocities, measures, loss curves, recipe and
/// notes. It is written anew where it is missing or something in the run is newer.
#[derive(Debug, Args)]
pub(super) struct ViewArgs {
    /// Folder of the run
    run: PathBuf,

    /// Write the page and print its name only
    #[arg(long)]
    no_browser: bool,

    /// True frames, to colour surfaces by their distance: a .anime sequence, or a folder of meshes
    #[arg(long, value_name = "SEQUENCE", requires_all = ["from", "to"])]
    ground_truth: Option<PathBuf>,

    /// Frame that is the run's source, counted from 0
    #[arg(long, value_name = "FRAME", requires = "ground_truth")]
    from: Option<usize>,

    /// Frame that is the run's target
    #[arg(long, value_name = "FRAME", requires = "ground_truth")]
    to: Option<usize>,

    #[command(flatten)]
    place: BackendArgs,
}

pub(super) fn run(args: ViewArgs) -> Result {
    let backend = args.place.backend()?;
    let open = || Trained::open(&args.run, backend);
    let page = match (&args.ground_truth, args.from, args.to) {
        (Some(path), Some(from), Some(to)) => {
            let truth = GroundTruth::read(path).map_err(isomorph::Error::from)?;
            open()?.report(Some((&truth, [from, to])))?
        }
        _ => match current_report(&args.run)? {
            Some(page) => page,
            None => open()?.report(None)?,
        },
    };
    print(&format!("{}\n", page.display()))?;
    if !args.no_browser {
        show(&page);
    }
    Ok(())
}

/// Opens a page in the browser, or says in a line why not.
pub(super) fn show(page: &Path) {
    if let Some(reason) = open_in_browser(page.as_os_str()) {
        let page = page.display();
        eprintln!("no browser was opened ({reason}); open {page} in one, on any machine");
    }
}

/// Opens a file or an address in the browser, or returns why that is not possible.
pub(super) fn open_in_browser(place: &OsStr) -> Option<String> {
    match has_display() {
        true => open::that(place).err().map(|reason| reason.to_string()),
        false => Some("this machine has no display".to_owned()),
    }
}

/// Whether a browser could show itself. Without a display a terminal's own browser would start instead.
fn has_display() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let needs_one = cfg!(all(unix, not(target_os = "macos")));
    !needs_one
        || ["DISPLAY", "WAYLAND_DISPLAY", "WSL_DISTRO_NAME"]
            .into_iter()
            .any(is_set)
}
