//! The legend of a chart, below its panels: labels in rows, each beside a sample of its line.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::chart::{ChartError, FINE, refused};
use super::stroke::Key;

const FONT: &str = "sans-serif";
/// Height of a row, in units of the picture as all lengths here.
const ROW: u32 = 24;
const TEXT_SIZE: u32 = 14;
const SAMPLE: u32 = 34;
const GAP: u32 = 8;
/// Between one label and the next sample.
const APART: u32 = 22;
const MARGIN: u32 = 16;

/// A drawing area in whole units of the drawing.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Where labels lie: rows of their places in the list.
type Rows = Vec<Vec<usize>>;

/// A font whose letters are `size` units of the picture high.
pub(super) fn font(size: u32) -> (&'static str, f64) {
    // What plotters calls the size is 1.24 times the size of the font that it writes.
    (FONT, f64::from(size * FINE) * 1.24)
}

/// How wide a text may become. Which font it is shown in nobody knows; few letters of the wide ones
/// (DejaVu, Verdana) exceed 0.64 of their size on average.
pub(super) fn text_width(text: &str, size: u32) -> u32 {
    (text.chars().count() as f64 * f64::from(size) * 0.64).ceil() as u32
}

/// The least width of a picture that holds every label.
pub(super) fn least_width(keys: &[Key]) -> u32 {
    let widest = keys.iter().map(item_width).max().unwrap_or(0);
    widest + 2 * MARGIN
}

/// The height of the legend in a picture of this width.
pub(super) fn height(keys: &[Key], width: u32) -> u32 {
    rows(keys, width).len() as u32 * ROW + MARGIN
}

fn item_width(key: &Key) -> u32 {
    SAMPLE + GAP + text_width(&key.label, TEXT_SIZE)
}

/// As many labels to a row as fit.
fn rows(keys: &[Key], width: u32) -> Rows {
    let mut rows: Rows = Vec::new();
    let mut used = 0;
    for (place, key) in keys.iter().enumerate() {
        let more = APART + item_width(key);
        match rows.last_mut() {
            Some(row) if used + more + 2 * MARGIN <= width => {
                row.push(place);
                used += more;
            }
            _ => {
                rows.push(vec![place]);
                used = item_width(key);
            }
        }
    }
    rows
}

/// Draws the legend at the top of the area, each row in the middle of the picture's width.
///
/// # Errors
/// [`ChartError::Drawing`].
pub(super) fn draw(area: &Area<'_>, keys: &[Key], width: u32) -> Result<(), ChartError> {
    for (number, row) in rows(keys, width).iter().enumerate() {
        let widths = row.iter().map(|place| item_width(&keys[*place]));
        let used = widths.sum::<u32>() + APART * (row.len() as u32 - 1);
        let mut left = (width - used) / 2;
        let middle = number as u32 * ROW + ROW / 2;
        for place in row {
            draw_item(area, &keys[*place], left, middle)?;
            left += item_width(&keys[*place]) + APART;
        }
    }
    Ok(())
}

fn draw_item(area: &Area<'_>, key: &Key, left: u32, middle: u32) -> Result<(), ChartError> {
    let fine = |x: u32| ((x * FINE) as i32, (middle * FINE) as i32);
    let line = key.line(vec![fine(left), fine(left + SAMPLE)]);
    area.draw(&line).map_err(refused)?;
    if let Some(mark) = key.mark(fine(left + SAMPLE / 2)) {
        area.draw(&mark).map_err(refused)?;
    }
    let style = font(TEXT_SIZE)
        .into_text_style(area)
        .pos(Pos::new(HPos::Left, VPos::Center));
    area.draw_text(&key.label, &style, fine(left + SAMPLE + GAP))
        .map_err(refused)
}

#[cfg(test)]
mod tests {
    use super::super::stroke::Stroke;
    use super::*;

    fn keys(labels: &[&str]) -> Vec<Key> {
        let labels = labels.iter().map(|label| (*label).to_owned());
        labels
            .map(|label| Key::new(label, Stroke::Solid, 0))
            .collect()
    }

    #[test]
    fn labels_fill_rows_and_none_is_wider_than_the_picture() {
        let keys = keys(&[
            "quick",
            "default",
            "a label of some length",
            "lipmlp",
            "nise",
        ]);
        let width = least_width(&keys);
        let rows = rows(&keys, width);
        assert!(rows.len() > 1, "{rows:?}");
        let places: Vec<usize> = rows.iter().flatten().copied().collect();
        assert_eq!(places, [0, 1, 2, 3, 4]);
        for row in rows {
            let items: u32 = row.iter().map(|place| item_width(&keys[*place])).sum();
            assert!(items + APART * (row.len() as u32 - 1) + 2 * MARGIN <= width);
        }
    }

    #[test]
    fn a_wide_picture_has_one_row() {
        assert_eq!(rows(&keys(&["a", "b", "c"]), 1000).len(), 1);
    }
}
