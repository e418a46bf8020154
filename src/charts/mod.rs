//! Panels of lines and points as one SVG: title above, three panels to a row, one legend beside them.
//!
//! | file | what it holds |
//! |---|---|
//! | `axis.rs` | linear and logarithmic axes and their ticks |
//! | `look.rs` | colours and dashes of lines |
//! | `marks.rs` | single points with their labels beside them |
//! | `svg.rs` | the elements of the drawing |
//!
//! The SVG uses whatever sans-serif font the viewer has. Lengths are in pixels.

mod axis;
mod look;
mod marks;
mod svg;

pub(crate) use axis::Scale;
pub(crate) use look::Stroke;
pub(crate) use marks::Mark;

use axis::Axis;
use look::Look;
use marks::Area;
use svg::{Anchor, TEXT, path, text, text_width};

/// Panels in a row.
const ABREAST: usize = 3;
/// A panel, its title and the labels of its axes included.
const PANEL: (f64, f64) = (400.0, 320.0);
/// What surrounds the axes of a panel.
const LEFT: f64 = 72.0;
const RIGHT: f64 = 20.0;
const ABOVE: f64 = 32.0;
const BELOW: f64 = 56.0;
const TITLE_HEIGHT: f64 = 44.0;
const TITLE: f64 = 20.0;
const PANEL_TITLE: f64 = 16.0;
/// The legend: height of a row, length of a sample, and the space beside it.
const ROW: f64 = 24.0;
const SAMPLE: f64 = 34.0;
const GAP: f64 = 8.0;
const GRID: &str = "#e1e1e1";
const FRAME: &str = "#6e6e6e";

/// Why a chart cannot be drawn.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ChartError {
    /// Nothing to draw in a panel, whose title this is.
    #[error("panel \"{0}\": has no point that can be drawn; leave the panel out")]
    Empty(String),
    /// No panel at all.
    #[error("a chart of no panels; give at least one")]
    NoPanels,
}

/// One pair of axes and the lines in it. Panels of one chart with the same `y_label` and `y_scale` have
/// the same range of y, so that heights compare.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Panel {
    /// What stands above it.
    pub title: String,
    /// Quantity and unit of x.
    pub x_label: String,
    /// Quantity and unit of y.
    pub y_label: String,
    /// The range of x on a linear axis, from less to more; that of the points without it.
    pub x_range: Option<[f64; 2]>,
    /// How x is laid out.
    pub x_scale: Scale,
    /// How y is laid out.
    pub y_scale: Scale,
    /// The lines, later ones above earlier ones.
    pub lines: Vec<Line>,
    /// Points that are named where they lie, above the lines.
    pub marks: Vec<Mark>,
}

/// A line through points in the order given.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Line {
    /// Its name in the legend; the same in every panel.
    pub label: String,
    /// How it is drawn.
    pub stroke: Stroke,
    /// Points (x, y). Where one has no place on the axis (not finite, or not above zero on a
    /// logarithmic axis), the line is broken.
    pub points: Vec<[f64; 2]>,
}

/// Draws the panels side by side, three to a row, and returns the SVG.
///
/// # Errors
/// [`ChartError`].
pub(crate) fn line_chart(title: &str, panels: &[Panel]) -> Result<String, ChartError> {
    if panels.is_empty() {
        return Err(ChartError::NoPanels);
    }
    let lines = panels.iter().flat_map(|panel| &panel.lines);
    let looks = Look::of_each(lines.map(|line| (line.label.as_str(), line.stroke)));
    let columns = panels.len().min(ABREAST);
    let rows = panels.len().div_ceil(ABREAST);
    // Where texts need more than the panels, the panels grow with them.
    let least = |panel: &Panel| {
        let title = text_width(&panel.title, PANEL_TITLE);
        LEFT + title.max(text_width(&panel.x_label, TEXT)) + RIGHT
    };
    let panel_width = panels.iter().map(least).fold(PANEL.0, f64::max);
    let legend_left = columns as f64 * panel_width;
    let labels = looks.iter().map(|look| text_width(&look.label, TEXT));
    let width = (legend_left + SAMPLE + GAP + labels.fold(0.0, f64::max) + RIGHT)
        .max(text_width(title, TITLE) + 2.0 * RIGHT);
    let height = TITLE_HEIGHT + (rows as f64 * PANEL.1).max(ABOVE + looks.len() as f64 * ROW);
    let heading = (width / 2.0, TITLE_HEIGHT / 2.0);
    let mut body = text(heading, Anchor::Middle, TITLE, title) + &legend(&looks, legend_left);
    for (number, panel) in panels.iter().enumerate() {
        let left = (number % columns) as f64 * panel_width;
        let top = TITLE_HEIGHT + (number / columns) as f64 * PANEL.1;
        let axes = axes(panel, panels).ok_or_else(|| ChartError::Empty(panel.title.clone()))?;
        let plot = Plot {
            left: left + LEFT,
            top: top + ABOVE,
            width: panel_width - LEFT - RIGHT,
            height: PANEL.1 - ABOVE - BELOW,
            x: axes.0,
            y: axes.1,
        };
        body += &plot.axes(panel);
        body += &plot.lines(panel, &looks);
        body += &plot.marks(panel);
    }
    Ok(svg::document(width, height, &body))
}

/// Every label beside a sample of its line, from the top of the panels downwards.
fn legend(looks: &[Look], left: f64) -> String {
    let row = |(number, look): (usize, &Look)| {
        let middle = TITLE_HEIGHT + ABOVE + (number as f64 + 0.5) * ROW;
        let label = (left + SAMPLE + GAP, middle);
        look.draw(&format!("M{left} {middle}h{SAMPLE}"))
            + &text(label, Anchor::Start, TEXT, &look.label)
    };
    looks.iter().enumerate().map(row).collect()
}

/// The axes of a panel, of which y is shared with the panels of the same quantity; `None` without a
/// point.
fn axes(panel: &Panel, panels: &[Panel]) -> Option<(Axis, Axis)> {
    let drawn = |panel: &Panel| -> Vec<(f64, f64)> {
        let lines = panel.lines.iter();
        lines
            .flat_map(|line| places(line, panel))
            .chain(panel.marks.iter().map(|mark| place(&mark.at, panel)))
            .flatten()
            .collect()
    };
    let own = Axis::around(panel.x_scale, drawn(panel).into_iter().map(|place| place.0))?;
    let x = match panel.x_range {
        Some([start, end]) if start < end && panel.x_scale == Scale::Linear => {
            Axis::over(Scale::Linear, start..end)
        }
        _ => own,
    };
    let quantity = |panel: &Panel| (panel.y_label.clone(), panel.y_scale);
    let alike = panels
        .iter()
        .filter(|other| quantity(other) == quantity(panel));
    let y = Axis::around(panel.y_scale, alike.flat_map(drawn).map(|place| place.1))?;
    Some((x, y))
}

/// The places of a line on the axes; `None` where it is broken.
fn places(line: &Line, panel: &Panel) -> impl Iterator<Item = Option<(f64, f64)>> {
    line.points.iter().map(|point| place(point, panel))
}

/// The place of a point on the axes of a panel; `None` if it has none.
fn place([x, y]: &[f64; 2], panel: &Panel) -> Option<(f64, f64)> {
    Some((panel.x_scale.place(*x)?, panel.y_scale.place(*y)?))
}

/// The axes of a panel and where in the drawing they are.
struct Plot {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
    x: Axis,
    y: Axis,
}

impl Plot {
    /// Titles, grid, ticks and frame.
    fn axes(&self, panel: &Panel) -> String {
        let (left, top) = (self.left, self.top);
        let (right, bottom) = (left + self.width, top + self.height);
        let middle = (left + right) / 2.0;
        let mut drawn = text(
            (middle, top - ABOVE / 2.0),
            Anchor::Middle,
            PANEL_TITLE,
            &panel.title,
        );
        drawn += &text(
            (middle, bottom + 42.0),
            Anchor::Middle,
            TEXT,
            &panel.x_label,
        );
        let aside = (left - LEFT + 16.0, (top + bottom) / 2.0);
        drawn += &text(aside, Anchor::Upwards, TEXT, &panel.y_label);
        for (place, label) in &self.x.ticks {
            let x = left + self.x.share(*place) * self.width;
            drawn += &path(&format!("M{x:.2} {top}V{bottom}"), GRID);
            drawn += &text((x, bottom + 16.0), Anchor::Middle, TEXT, label);
        }
        for (place, label) in &self.y.ticks {
            let y = bottom - self.y.share(*place) * self.height;
            drawn += &path(&format!("M{left:.2} {y:.2}H{right:.2}"), GRID);
            drawn += &text((left - 7.0, y), Anchor::End, TEXT, label);
        }
        let frame = format!("M{left:.2} {top}H{right:.2}V{bottom}H{left:.2}z");
        drawn + &path(&frame, FRAME)
    }

    /// The lines, cut off at the frame.
    fn lines(&self, panel: &Panel, looks: &[Look]) -> String {
        let mut drawn = String::new();
        for line in &panel.lines {
            let places: Vec<_> = places(line, panel).collect();
            let runs = places.split(Option::is_none);
            let outline: String = runs.map(|run| self.outline(run)).collect();
            let own = looks.iter().filter(|look| look.label == line.label);
            drawn.extend(own.map(|look| look.draw(&outline)));
        }
        svg::clipped((self.left, self.top), (self.width, self.height), &drawn)
    }

    /// The points that are named where they lie.
    fn marks(&self, panel: &Panel) -> String {
        let drawn = panel.marks.iter().filter_map(|mark| {
            let place = place(&mark.at, panel)?;
            Some((mark.label.as_str(), self.at(&place)))
        });
        let (right, bottom) = (self.left + self.width, self.top + self.height);
        let frame = Area([self.left, self.top, right, bottom]);
        marks::draw(&drawn.collect::<Vec<_>>(), frame)
    }

    /// Where a place on the axes is in the drawing.
    fn at(&self, &(x, y): &(f64, f64)) -> (f64, f64) {
        let right = self.left + self.x.share(x) * self.width;
        (right, self.top + (1.0 - self.y.share(y)) * self.height)
    }

    /// The SVG path of an unbroken piece of a line; a point alone becomes a short dash.
    fn outline(&self, run: &[Option<(f64, f64)>]) -> String {
        let points: Vec<_> = run.iter().flatten().map(|place| self.at(place)).collect();
        match points[..] {
            [] => String::new(),
            [(x, y)] => format!("M{:.2} {y:.2}h6", x - 3.0),
            _ => {
                let points = points.iter().map(|(x, y)| format!("{x:.2} {y:.2}"));
                format!("M{}", points.collect::<Vec<_>>().join("L"))
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;
