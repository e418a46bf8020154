//! `isomorph pick`: pairs of corresponding points by hand, on a page in the browser.

use std::path::{Path, PathBuf};

use clap::Args;
use isomorph::picking::Picker;

use super::view::open_in_browser;
use super::{Failure, Result, is_same_file, print, stop_on_interrupt};

/// Choose pairs of corresponding points by hand
///
/// A page opens in the browser, with both shapes side by side. Click a point of the source, then the same place of
/// the target. Each click takes the nearest vertex. Save writes the file of pairs, and Done ends the command. The page
/// comes from this machine alone and loads nothing from elsewhere. Go on with `isomorph morph --pairs`, `isomorph match
/// --pairs`, or data.correspondences in a recipe.
#[derive(Debug, Args)]
pub(super) struct PickArgs {
    /// Shape at time 0, a mesh or point cloud: PLY, OBJ, STL, OFF, glTF, NPY or text
    source: PathBuf,

    /// Shape at time 1
    target: PathBuf,

    /// File that Save writes, with lines of source_index,target_index [default: the file of --pairs, or pairs.csv]
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,

    /// Pairs to begin with
    #[arg(long, value_name = "FILE")]
    pairs: Option<PathBuf>,

    /// Replace the output file if it holds other pairs
    #[arg(long)]
    force: bool,

    /// Print the address of the page and open no browser
    #[arg(long, visible_alias = "no-open")]
    no_browser: bool,

    /// Write the page as a file instead, for a browser on any machine; Save is then a download
    #[arg(long, value_name = "FILE.html", conflicts_with = "no_browser")]
    page: Option<PathBuf>,
}

pub(super) fn run(args: PickArgs) -> Result {
    let output = args.output.as_ref().or(args.pairs.as_ref());
    let output = output.map_or(Path::new("pairs.csv"), PathBuf::as_path);
    if args.page.is_none() {
        check_free(output, &args)?;
    }
    let picker = Picker::open(&args.source, &args.target, args.pairs.as_deref(), output)?;
    if let Some(page) = &args.page {
        picker.write_page(page)?;
        return print(&format!("{}\n", page.display()));
    }
    let served = picker.serve()?;
    let address = served.address();
    print(&format!("{address}\n"))?;
    if !args.no_browser
        && let Some(reason) = open_in_browser(address.as_ref())
    {
        let port = served.port();
        eprintln!(
            "no browser was opened ({reason}); open {address} in one on this machine, or from another one after `ssh -L \
             {port}:127.0.0.1:{port}`; `--page FILE.html` writes a page for any machine"
        );
    }
    eprintln!(
        "the page saves {}; Ctrl-C ends without it",
        output.display()
    );
    match served.wait(&stop_on_interrupt()) {
        Ok(Some(count)) => {
            let (source, target) = (args.source.display(), args.target.display());
            let output = output.display();
            eprintln!(
                "{count} pairs; go on with `isomorph morph {source} {target} --pairs {output}`"
            );
            print(&format!("{output}\n"))
        }
        Ok(None) => {
            eprintln!("no pairs were saved");
            Ok(())
        }
        Err(error) => {
            if error.kind() == isomorph::ErrorKind::Interruption {
                eprintln!("{error}");
            }
            Err(error.into())
        }
    }
}

/// Pairs that the page does not begin with are not replaced unless that is asked for.
fn check_free(output: &Path, args: &PickArgs) -> Result {
    let given = args.pairs.as_ref();
    let is_given = given.is_some_and(|given| is_same_file(given, output));
    if args.force || !output.is_file() || is_given {
        return Ok(());
    }
    let output = output.display();
    Err(Failure::Usage(format!(
        "{output}: exists already; begin with its pairs by --pairs {output}, choose another file with -o, or replace it \
         with --force"
    )))
}
