//! Single points, each with its label beside it.
//!
//! A label goes where it hides no point and no other label: to the right of its point if there is room, else to the
//! left, above or below, and else some rows away, with a thin line to its point.

use super::svg::{self, Anchor, text, text_width};

/// Radius of a point.
const DOT: f64 = 4.0;
/// Size of the labels.
const SIZE: f64 = 12.0;
/// From a point to its label.
const GAP: f64 = 7.0;
/// From one row to the next.
const ROW: f64 = 15.0;
/// How many rows away a label may go.
const ROWS: usize = 12;
const LEADER: &str = "#9a9a9a";

/// A point of a panel that is named where it lies.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Mark {
    /// What stands beside it.
    pub label: String,
    /// (x, y).
    pub at: [f64; 2],
}

/// A rectangle: left, top, right, bottom.
#[derive(Clone, Copy, Debug)]
pub(super) struct Area(pub(super) [f64; 4]);

impl Area {
    fn meets(self, other: Self) -> bool {
        let (Self(a), Self(b)) = (self, other);
        a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
    }

    fn lies_in(self, other: Self) -> bool {
        let (Self(a), Self(b)) = (self, other);
        a[0] >= b[0] && a[1] >= b[1] && a[2] <= b[2] && a[3] <= b[3]
    }

    fn around((x, y): (f64, f64)) -> Self {
        Self([x - DOT, y - DOT, x + DOT, y + DOT])
    }
}

/// Where a label stands: the middle of its height, how it lies about that, and what it covers.
#[derive(Clone, Copy, Debug)]
struct Spot {
    at: (f64, f64),
    anchor: Anchor,
    area: Area,
}

impl Spot {
    fn new(at: (f64, f64), anchor: Anchor, width: f64) -> Self {
        let (x, y) = at;
        let left = match anchor {
            Anchor::Start => x,
            Anchor::End => x - width,
            Anchor::Middle | Anchor::Upwards => x - width / 2.0,
        };
        let half = SIZE / 2.0;
        Self {
            at,
            anchor,
            area: Area([left, y - half, left + width, y + half]),
        }
    }

    /// All places for a label, the best first.
    fn around((x, y): (f64, f64), width: f64) -> impl Iterator<Item = Self> {
        let right = move |rows: f64| Self::new((x + GAP, y + rows * ROW), Anchor::Start, width);
        let left = move |rows: f64| Self::new((x - GAP, y + rows * ROW), Anchor::End, width);
        let over = move |rows: f64| Self::new((x, y + rows * ROW), Anchor::Middle, width);
        let near = [right(0.0), left(0.0), over(-1.0), over(1.0)];
        let away = (1..=ROWS).flat_map(move |rows| {
            let rows = rows as f64;
            [right(-rows), right(rows), left(-rows), left(rows)]
        });
        near.into_iter().chain(away)
    }
}

/// The points and their labels; `places` are theirs in the drawing, `frame` is the panel.
pub(super) fn draw(places: &[(&str, (f64, f64))], frame: Area) -> String {
    let dots: Vec<Area> = places.iter().map(|(_, at)| Area::around(*at)).collect();
    let mut taken: Vec<Area> = Vec::new();
    let mut drawn = String::new();
    for (label, at) in places {
        let width = text_width(label, SIZE);
        let free = |spot: &Spot| {
            let hides = |other: &Area| spot.area.meets(*other);
            spot.area.lies_in(frame) && !dots.iter().chain(&taken).any(hides)
        };
        // With no room anywhere labels meet: better than a point without a name.
        let first = Spot::new((at.0 + GAP, at.1), Anchor::Start, width);
        let spot = Spot::around(*at, width).find(free).unwrap_or(first);
        taken.push(spot.area);
        if (spot.at.1 - at.1).abs() > 1.5 * ROW {
            let line = format!("M{:.2} {:.2}L{:.2} {:.2}", at.0, at.1, spot.at.0, spot.at.1);
            drawn += &svg::path(&line, LEADER);
        }
        drawn += &svg::dot(*at, DOT);
        drawn += &text(spot.at, spot.anchor, SIZE, label);
    }
    drawn
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Area = Area([0.0, 0.0, 300.0, 200.0]);

    fn spots(places: &[(&str, (f64, f64))]) -> Vec<Area> {
        let svg = format!("<svg>{}</svg>", draw(places, FRAME));
        let document = roxmltree::Document::parse(&svg).expect("XML");
        let texts = document
            .descendants()
            .filter(|node| node.has_tag_name("text"));
        let spot = |node: roxmltree::Node<'_, '_>| {
            let number = |name: &str| node.attribute(name).and_then(|text| text.parse().ok());
            let at = (number("x").expect("x"), number("y").expect("y"));
            let anchor = match node.attribute("text-anchor") {
                Some("start") => Anchor::Start,
                Some("end") => Anchor::End,
                _ => Anchor::Middle,
            };
            Spot::new(at, anchor, text_width(node.text().expect("a label"), SIZE)).area
        };
        texts.map(spot).collect()
    }

    #[test]
    fn labels_of_points_close_together_hide_neither_each_other_nor_a_point() {
        let names = [
            "quick",
            "default",
            "eigenbasis",
            "nise-velocity",
            "lipmlp",
            "efis",
        ];
        let places: Vec<_> = names
            .iter()
            .enumerate()
            .map(|(k, name)| (*name, (140.0 + 3.0 * k as f64, 100.0 + 2.0 * k as f64)))
            .collect();
        let found = spots(&places);
        assert_eq!(found.len(), names.len());
        for (k, area) in found.iter().enumerate() {
            assert!(area.lies_in(FRAME), "{area:?}");
            let mut others = found[..k].iter();
            assert!(!others.any(|other| other.meets(*area)), "{found:?}");
            let mut dots = places.iter().map(|(_, at)| Area::around(*at));
            assert!(!dots.any(|dot| dot.meets(*area)), "{found:?}");
        }
    }

    #[test]
    fn a_label_at_the_right_border_goes_to_the_left_of_its_point() {
        let Area([_, _, right, _]) = spots(&[("default", (290.0, 100.0))])[0];
        assert!(right <= 290.0 - GAP, "{right}");
    }

    #[test]
    fn a_label_without_room_anywhere_is_drawn_all_the_same() {
        let long = "a label that is longer than the whole panel is wide, whatever the font may be";
        assert_eq!(spots(&[(long, (150.0, 100.0))]).len(), 1);
    }
}
