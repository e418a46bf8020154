//! Corresponding vertices of two shapes, found from the shapes alone, and a picture of how far to trust them.

use std::borrow::Borrow;
use std::path::Path;

use crate::atomic::write_atomically;
use crate::charts::{ChartError, Line, Panel, line_chart};
use crate::error::{Error, Result};
use crate::event::Event;
use crate::formats::Shape;
use crate::matching::{MatchOptions, Matching, match_shapes};
use crate::shape::Correspondences;

/// Finds which vertices of two shapes correspond: two poses or states of one thing, as meshes or point
/// clouds, complete or with parts missing. The same shapes and options give the same pairs, whatever the
/// number of cores. `on_event` is called with [`Event::Matching`] while the work goes on.
///
/// # Errors
/// An option out of range; a shape without area; no pair that is sure enough.
pub fn find(
    source: &Shape,
    target: &Shape,
    options: &MatchOptions,
    on_event: impl FnMut(&Event),
) -> Result<Matching> {
    find_around(source, target, &Correspondences::none(), options, on_event)
}

/// The same with some pairs given, in a file as `data.correspondences` reads it, such as one that was picked by
/// hand. The search follows them, and the result holds them as they are.
///
/// # Errors
/// Those of [`find`], and what is wrong with the file.
pub fn find_from(
    source: &Shape,
    target: &Shape,
    given: &Path,
    options: &MatchOptions,
    on_event: impl FnMut(&Event),
) -> Result<Matching> {
    let given = Correspondences::read(given, source, target)?;
    find_around(source, target, &given, options, on_event)
}

/// How many pairs a file holds from each of two shapes or more to the next, in all, as `data.correspondences` reads it.
///
/// # Errors
/// What is wrong with the file.
pub fn known_pairs(path: &Path, shapes: &[impl Borrow<Shape>]) -> Result<usize> {
    let between = shapes.windows(2).enumerate().map(|(k, two)| {
        let two = [two[0].borrow(), two[1].borrow()];
        Ok(
            Correspondences::read_between(path, k, [shapes.len(); 2], two)?
                .pairs
                .len(),
        )
    });
    between.sum()
}

fn find_around(
    source: &Shape,
    target: &Shape,
    given: &Correspondences,
    options: &MatchOptions,
    mut on_event: impl FnMut(&Event),
) -> Result<Matching> {
    let mut report = |stage, done, total| {
        on_event(&Event::Matching {
            stage,
            done,
            total,
            interval: [0, 1],
        });
    };
    Ok(match_shapes(source, target, given, options, &mut report)?)
}

impl Matching {
    /// Writes `source_index,target_index,confidence` lines, as `data.correspondences` reads them.
    ///
    /// # Errors
    /// What the file system says; the message names the file.
    pub fn write_pairs(&self, path: &Path) -> Result<()> {
        Ok(self.write_csv(path)?)
    }

    /// Draws the round-trip error: the share of points that come back to within a distance, as SVG.
    ///
    /// # Errors
    /// A file whose name does not end in `.svg`; what the file system says.
    pub fn write_picture(&self, path: &Path) -> Result<()> {
        let is_svg = |extension: &std::ffi::OsStr| extension.eq_ignore_ascii_case("svg");
        if !path.extension().is_some_and(is_svg) {
            let path = path.display();
            return Err(Error::usage(format!("{path}: must end in .svg")));
        }
        let figure = figure(self)?;
        write_atomically(path, |out| out.write_all(figure.as_bytes()))?;
        Ok(())
    }
}

/// Places at which a distribution is drawn.
const PLACES: usize = 200;

/// The share of points that come back to within a distance, over the distance.
fn figure(found: &Matching) -> std::result::Result<String, ChartError> {
    let line = |label: &str, sorted: &[f64]| {
        let last = sorted.len() - 1;
        let place = |k: usize| {
            let share = k as f64 / PLACES as f64;
            [
                sorted[(share * last as f64).round() as usize],
                100.0 * share,
            ]
        };
        Line {
            label: label.to_owned(),
            points: (0..=PLACES).map(place).collect(),
            ..Line::default()
        }
    };
    let cycle = &found.cycle;
    let most = cycle.source.quantile_95.max(cycle.target.quantile_95);
    let panel = Panel {
        title: "share of points that come back to within a distance".to_owned(),
        x_label: "distance from where they began (normalised)".to_owned(),
        y_label: "points (%)".to_owned(),
        x_range: (most > 0.0).then_some([0.0, 1.5 * most]),
        lines: vec![
            line("source to target and back", &cycle.source.sorted),
            line("target to source and back", &cycle.target.sorted),
        ],
        ..Panel::default()
    };
    line_chart("Round-trip error", &[panel])
}
