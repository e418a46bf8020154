//! How the lines of a chart look, in the panels and in the legend alike.

use plotters::element::{DashedPathElement, DynElement, IntoDynElement};
use plotters::prelude::*;

use super::chart::FINE;

/// Colours of solid lines, in order.
pub(super) const PALETTE: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];
const GREY: RGBColor = RGBColor(120, 120, 120);

/// Of a mark, in units of the drawing.
const RADIUS: i32 = 7 * FINE as i32 / 2;

/// How a line is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stroke {
    /// Solid, in the next colour of the palette: a method.
    #[default]
    Solid,
    /// Dashed and black: something to hold the methods against.
    Dashed,
    /// Dotted and grey: a bound.
    Dotted,
}

/// A label and how its lines look.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Key {
    /// What the legend says.
    pub(super) label: String,
    stroke: Stroke,
    colour: RGBColor,
    /// How often the palette has been used up before.
    round: usize,
}

/// Something to draw in coordinates of kind `C`.
type Element<'a, C> = DynElement<'static, SVGBackend<'a>, C>;

impl Key {
    /// The look of a line; `solids` solid ones have come before.
    pub(super) fn new(label: String, stroke: Stroke, solids: usize) -> Self {
        let (colour, round) = match stroke {
            Stroke::Solid => (PALETTE[solids % PALETTE.len()], solids / PALETTE.len()),
            Stroke::Dashed => (BLACK, 0),
            Stroke::Dotted => (GREY, 0),
        };
        Self {
            label,
            stroke,
            colour,
            round,
        }
    }

    /// Whether it is a solid one.
    pub(super) fn is_solid(&self) -> bool {
        self.stroke == Stroke::Solid
    }

    /// A line through these points.
    pub(super) fn line<'a, C: Clone + 'static>(&self, points: Vec<C>) -> Element<'a, C> {
        let style = self.colour.stroke_width(2 * FINE);
        let dashed = |dash: u32, gap: u32| {
            let path = points.clone().into_iter();
            DashedPathElement::new(path, dash * FINE, gap * FINE, style).into_dyn()
        };
        match self.stroke {
            Stroke::Solid => PathElement::new(points, style).into_dyn(),
            Stroke::Dashed => dashed(8, 5),
            Stroke::Dotted => dashed(2, 4),
        }
    }

    /// A point that no line leads to.
    pub(super) fn dot<'a, C: Clone + 'static>(&self, point: C) -> Element<'a, C> {
        let alone = self.mark(point.clone());
        alone.unwrap_or_else(|| Circle::new(point, RADIUS, self.colour.filled()).into_dyn())
    }

    /// The mark on a point of it; none while the colours alone tell the lines apart.
    pub(super) fn mark<'a, C: Clone + 'static>(&self, point: C) -> Option<Element<'a, C>> {
        let style = self.colour.filled();
        match self.round {
            0 => None,
            1 => Some(Circle::new(point, RADIUS, style).into_dyn()),
            2 => Some(TriangleMarker::new(point, RADIUS + 2 * FINE as i32, style).into_dyn()),
            _ => Some(Cross::new(point, RADIUS, self.colour.stroke_width(2 * FINE)).into_dyn()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_of_the_first_24_solid_lines_look_alike() {
        let keys: Vec<Key> = (0..24)
            .map(|solids| Key::new("same".to_owned(), Stroke::Solid, solids))
            .collect();
        for (place, key) in keys.iter().enumerate() {
            assert!(!keys[..place].contains(key), "line {place}");
        }
        // The first six need no marks, the next do.
        assert!(keys[..6].iter().all(|key| key.mark((0, 0)).is_none()));
        assert!(keys[6..].iter().all(|key| key.mark((0, 0)).is_some()));
    }
}
