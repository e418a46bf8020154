//! Panels of lines side by side as one SVG, drawn by `plotters`: title above, one legend below.
//!
//! A line has the colour of its label in every panel, from the palette of Okabe and Ito ("Color
//! Universal Design", 2008), which people with any colour vision can tell apart; without its yellow,
//! too pale for a line on white, and its black, which is the dashed lines'. More labels than colours
//! get marks on their points.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axis::Axis;
use super::legend::{self, Area, font};
use super::stroke::Key;

pub use super::axis::Scale;
pub use super::stroke::Stroke;

/// Units of the drawing to one of the picture: `plotters` rounds coordinates to whole units.
pub(super) const FINE: u32 = 4;
/// Panels in a row.
const ABREAST: usize = 3;
/// A panel, its axes included.
const PANEL: (u32, u32) = (400, 320);
const TITLE_HEIGHT: u32 = 44;
const TITLE_SIZE: u32 = 20;
const PANEL_TITLE_HEIGHT: u32 = 28;
const PANEL_TITLE_SIZE: u32 = 16;
const TEXT_SIZE: u32 = 14;
/// Around the axes of a panel, their labels included.
const MARGIN: u32 = 14;
const X_LABELS: u32 = 44;
const Y_LABELS: u32 = 58;
const GRID: RGBColor = RGBColor(225, 225, 225);
const FRAME: RGBColor = RGBColor(110, 110, 110);
/// Why a chart cannot be drawn.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ChartError {
    /// Nothing to draw.
    #[error("panel \"{panel}\": has no point that can be drawn; leave the panel out")]
    Empty {
        /// The title of the panel.
        panel: String,
    },
    /// No panel at all.
    #[error("a chart of no panels; give at least one")]
    NoPanels,
    /// What the drawing library says.
    #[error("the chart cannot be drawn: {0}")]
    Drawing(String),
}

/// One pair of axes and the lines in it. Panels of one chart with the same `y_label` and `y_scale` have
/// the same range of y, so that heights compare.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// What stands above it.
    pub title: String,
    /// Quantity and unit of x.
    pub x_label: String,
    /// Quantity and unit of y.
    pub y_label: String,
    /// The range of x, from less to more; that of the points without it.
    pub x_range: Option<[f64; 2]>,
    /// How y is laid out.
    pub y_scale: Scale,
    /// The lines, later ones above earlier ones.
    pub lines: Vec<Line>,
}

/// A line through points in the order given.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Line {
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
pub fn line_chart(title: &str, panels: &[Panel]) -> Result<String, ChartError> {
    if panels.is_empty() {
        return Err(ChartError::NoPanels);
    }
    let keys = keys(panels);
    let rows = panels.len().div_ceil(ABREAST) as u32;
    let columns = panels.len().min(ABREAST) as u32;
    let title = one_line(title);
    // Where title or legend need more than the panels, the panels grow with them.
    let width = (columns * PANEL.0)
        .max(legend::text_width(&title, TITLE_SIZE) + 2 * MARGIN)
        .max(legend::least_width(&keys));
    let legend_height = legend::height(&keys, width);
    let height = TITLE_HEIGHT + rows * PANEL.1 + legend_height;

    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (width * FINE, height * FINE));
        let root = root.into_drawing_area();
        root.fill(&WHITE).map_err(refused)?;
        let (head, rest) = root.split_vertically(TITLE_HEIGHT * FINE);
        draw_title(&head, &title)?;
        let (body, foot) = rest.split_vertically(rows * PANEL.1 * FINE);
        let areas = body.split_evenly((rows as usize, columns as usize));
        for (panel, area) in panels.iter().zip(&areas) {
            draw_panel(area, panel, y_axis(panel, panels)?, &keys)?;
        }
        legend::draw(&foot, &keys, width)?;
        root.present().map_err(refused)?;
    }
    Ok(in_picture_units(&svg, width, height))
}

pub(super) fn refused(error: impl std::fmt::Display) -> ChartError {
    ChartError::Drawing(error.to_string())
}

/// Every label once, in the order in which they first occur, and how its lines look.
fn keys(panels: &[Panel]) -> Vec<Key> {
    let mut keys: Vec<Key> = Vec::new();
    for line in panels.iter().flat_map(|panel| &panel.lines) {
        let label = one_line(&line.label);
        if !keys.iter().any(|key| key.label == label) {
            let solids = keys.iter().filter(|key| key.is_solid()).count();
            keys.push(Key::new(label, line.stroke, solids));
        }
    }
    // What the methods are held against comes last, though it is drawn first.
    keys.sort_by_key(|key| !key.is_solid());
    keys
}

/// Text without control characters, which neither a line of text nor XML can hold.
fn one_line(text: &str) -> String {
    text.chars()
        .map(|letter| if letter.is_control() { ' ' } else { letter })
        .collect()
}

/// The y axis that a panel shares with those of the same quantity.
fn y_axis(panel: &Panel, panels: &[Panel]) -> Result<Axis, ChartError> {
    let empty = || ChartError::Empty {
        panel: panel.title.clone(),
    };
    let places = |panel: &Panel| -> Vec<f64> {
        let points = panel.lines.iter().flat_map(|line| &line.points);
        let drawn = points.filter(|point| point[0].is_finite());
        drawn
            .filter_map(|point| panel.y_scale.place(point[1]))
            .collect()
    };
    if places(panel).is_empty() {
        return Err(empty());
    }
    let alike = panels
        .iter()
        .filter(|other| (&other.y_label, other.y_scale) == (&panel.y_label, panel.y_scale));
    Axis::around(panel.y_scale, alike.flat_map(places)).ok_or_else(empty)
}

fn x_axis(panel: &Panel) -> Result<Axis, ChartError> {
    let points = panel.lines.iter().flat_map(|line| &line.points);
    let places = points.filter_map(|point| Scale::Linear.place(point[0]));
    let axis = match panel.x_range {
        Some([start, end]) if start < end => Some(Axis::exactly(Scale::Linear, start..end)),
        _ => Axis::around(Scale::Linear, places),
    };
    axis.ok_or_else(|| ChartError::Empty {
        panel: panel.title.clone(),
    })
}

fn draw_title(area: &Area<'_>, title: &str) -> Result<(), ChartError> {
    let (width, height) = area.dim_in_pixel();
    let middle = (width as i32 / 2, height as i32 / 2);
    draw_centred(area, title, TITLE_SIZE, middle)
}

fn draw_centred(
    area: &Area<'_>,
    text: &str,
    size: u32,
    middle: (i32, i32),
) -> Result<(), ChartError> {
    let style = font(size)
        .into_text_style(area)
        .pos(Pos::new(HPos::Center, VPos::Center));
    area.draw_text(text, &style, middle).map_err(refused)
}

fn draw_panel(area: &Area<'_>, panel: &Panel, y: Axis, keys: &[Key]) -> Result<(), ChartError> {
    let (head, body) = area.split_vertically(PANEL_TITLE_HEIGHT * FINE);
    // Above the middle of the axes, not of the panel.
    let left = (MARGIN + Y_LABELS) * FINE;
    let right = area.dim_in_pixel().0 - MARGIN * FINE;
    let middle = ((left + right) / 2, PANEL_TITLE_HEIGHT * FINE / 2);
    let middle = (middle.0 as i32, middle.1 as i32);
    draw_centred(&head, &one_line(&panel.title), PANEL_TITLE_SIZE, middle)?;
    let mut chart = ChartBuilder::on(&body)
        .margin(MARGIN * FINE)
        .margin_top(2 * FINE)
        .x_label_area_size(X_LABELS * FINE)
        .y_label_area_size(Y_LABELS * FINE)
        .build_cartesian_2d(x_axis(panel)?, y)
        .map_err(refused)?;
    chart
        .configure_mesh()
        .x_desc(one_line(&panel.x_label))
        .y_desc(one_line(&panel.y_label))
        .axis_desc_style(font(TEXT_SIZE))
        .label_style(font(TEXT_SIZE))
        .axis_style(FRAME.stroke_width(FINE))
        .bold_line_style(GRID.stroke_width(FINE))
        .light_line_style(TRANSPARENT)
        .set_all_tick_mark_size(3 * FINE)
        .draw()
        .map_err(refused)?;
    for line in &panel.lines {
        let label = one_line(&line.label);
        let key = keys.iter().find(|key| key.label == label);
        let key = key.expect("the keys were made of these lines");
        for run in runs(line, panel.y_scale) {
            let marks: Vec<_> = match run[..] {
                [alone] => vec![key.dot(alone)],
                _ => run.iter().filter_map(|point| key.mark(*point)).collect(),
            };
            let path = std::iter::once(key.line(run));
            chart.draw_series(path.chain(marks)).map_err(refused)?;
        }
    }
    Ok(())
}

/// The unbroken pieces of a line, in places of the axes.
fn runs(line: &Line, scale: Scale) -> Vec<Vec<(f64, f64)>> {
    let place = |point: &[f64; 2]| Some((Scale::Linear.place(point[0])?, scale.place(point[1])?));
    line.points
        .iter()
        .map(place)
        .collect::<Vec<_>>()
        .split(Option::is_none)
        .map(|run| run.iter().flatten().copied().collect::<Vec<_>>())
        .filter(|run| !run.is_empty())
        .collect()
}

/// The drawing at its size in the picture: the finer units stay within the view box.
fn in_picture_units(svg: &str, width: u32, height: u32) -> String {
    let fine = format!("width=\"{}\" height=\"{}\"", width * FINE, height * FINE);
    svg.replacen(&fine, &format!("width=\"{width}\" height=\"{height}\""), 1)
}

/// What tests read out of a chart.
#[cfg(test)]
pub(super) mod testing {
    /// Every text of an SVG, in order.
    pub(in super::super) fn texts(svg: &str) -> Vec<String> {
        let document = roxmltree::Document::parse(svg).expect("XML");
        let texts = document
            .descendants()
            .filter(|node| node.has_tag_name("text"));
        texts
            .map(|node| node.text().unwrap_or_default().trim().to_owned())
            .collect()
    }

    /// The labels of the legend: they alone start at their point, other texts end or are centred there.
    pub(in super::super) fn legend(svg: &str) -> Vec<String> {
        let document = roxmltree::Document::parse(svg).expect("XML");
        let starts = document.descendants().filter(|node| {
            node.has_tag_name("text") && node.attribute("text-anchor") == Some("start")
        });
        starts
            .map(|node| node.text().unwrap_or_default().trim().to_owned())
            .collect()
    }
}

#[cfg(test)]
#[path = "chart_tests.rs"]
mod tests;
