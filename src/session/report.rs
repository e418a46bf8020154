//! `report.html`: the page of a run, written from what the run holds.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::extract::{even_times, show};
use super::folder::RunFolder;
use super::report_data::ReportData;
use super::report_truth::TrueShapes;
use super::trained::Trained;
use crate::atomic::write_atomically;
use crate::cubes::Grid;
use crate::error::Result;
use crate::evaluate::GroundTruth;
use crate::formats;
use crate::surface::frames::{Frame, FrameEntry};
use crate::viewer::Page;

/// Surfaces that are computed for a page alone have at most so many cells along the longest side of the box.
const CELLS: usize = 96;

/// And there are at least so many.
const FEWEST_SURFACES: usize = 5;

/// Seconds until the page of a run in training loads itself again.
const RELOADED: u32 = 10;

/// The page of a run if it is there and nothing in the run is newer.
///
/// # Errors
/// A folder that is no run.
pub fn current_report(run: impl AsRef<Path>) -> Result<Option<PathBuf>> {
    let run = RunFolder::open(run.as_ref())?;
    let changed = |path: &Path| {
        std::fs::metadata(path)
            .and_then(|found| found.modified())
            .ok()
    };
    let Some(made) = changed(&run.report()) else {
        return Ok(None);
    };
    let parts = ["metrics.jsonl", "checkpoints", "meshes/frames.json"];
    let newer = |name: &&str| changed(&run.path().join(name)).is_some_and(|time| time > made);
    let is_old = parts.iter().any(newer) || changed(&run.recipe()).is_some_and(|time| time > made);
    Ok((!is_old).then(|| run.report()))
}

impl Trained {
    /// Writes the page of the run, `report.html` in its folder, one file that a browser shows without a network;
    /// returns its path. With a ground truth the surfaces are held against its frames, of which two are the ends
    /// of the run.
    ///
    /// The surfaces are those of the last extraction into the run, if its files can be read again, and else
    /// found anew on a coarse grid.
    ///
    /// # Errors
    /// The shapes of the run cannot be read any more; frames that are not those of the run; the disk.
    pub fn report(&self, truth: Option<(&GroundTruth, [usize; 2])>) -> Result<PathBuf> {
        let frames = match self.extracted() {
            Some(frames) => frames,
            None => self.coarse()?,
        };
        self.write_report(frames, truth)
    }

    /// The page and the picture of a run in training, on a coarse grid. The page loads itself again while it is
    /// open.
    ///
    /// # Errors
    /// Those of [`Self::report`].
    pub(super) fn preview(&self) -> Result<()> {
        let frames = self.coarse()?;
        show(&frames, &self.folder().meshes(), None)?;
        self.write_page(frames, None, Some(RELOADED))?;
        Ok(())
    }

    /// The page of surfaces that are there.
    pub(super) fn write_report(
        &self,
        frames: Vec<Frame>,
        truth: Option<(&GroundTruth, [usize; 2])>,
    ) -> Result<PathBuf> {
        self.write_page(frames, truth, None)
    }

    fn write_page(
        &self,
        frames: Vec<Frame>,
        truth: Option<(&GroundTruth, [usize; 2])>,
        reloaded: Option<u32>,
    ) -> Result<PathBuf> {
        let true_shapes = match truth {
            Some((truth, ends)) => Some(TrueShapes::of(self, truth, ends)?),
            None => None,
        };
        let made = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
        let page = ReportData::gather(self, frames, true_shapes.as_ref())?.page(&made);
        let path = self.folder().report();
        let page = Page { reloaded, ..page };
        let html = page.html();
        write_atomically(&path, |out| out.write_all(html.as_bytes()))?;
        Ok(path)
    }

    /// The surfaces of the last extraction into the run; `None` if one cannot be read.
    fn extracted(&self) -> Option<Vec<Frame>> {
        let folder = self.folder().meshes();
        let text = std::fs::read_to_string(folder.join("frames.json")).ok()?;
        let entries: Vec<FrameEntry> = serde_json::from_str(&text).ok()?;
        let frames = entries.into_iter().map(|entry| {
            let shape = formats::read(&folder.join(&entry.surface)).ok()?;
            let time = self.clock().unit(entry.time).ok()?;
            let place = self.learned().coordinates.at(time);
            let mesh = shape.mesh.moved(|x| place.apply(x));
            Some(Frame {
                time,
                entry,
                components: mesh.components().len(),
                mesh,
                left_out: 0,
                touches_box: false,
                trust: None,
            })
        });
        frames.collect()
    }

    /// Surfaces on a coarse grid.
    fn coarse(&self) -> Result<Vec<Frame>> {
        let (learned, result, clock) = (self.learned(), &self.recipe().result, self.clock());
        let grid = Grid::new(
            learned.bounds.min,
            learned.bounds.max,
            result.resolution.min(CELLS),
        )?;
        let times = even_times(result.frames.max(FEWEST_SURFACES));
        let frame = |time: f64| -> Result<Frame> {
            let found = learned.surface_at(&grid, time, result.smallest_component, &mut |_| ())?;
            let (_, slope_error) = learned.normals(&found.mesh, time);
            let mut frame = Frame::measured(learned, found, time, slope_error)?;
            frame.entry.time = clock.own(time);
            Ok(frame)
        };
        times.into_iter().map(frame).collect()
    }
}
