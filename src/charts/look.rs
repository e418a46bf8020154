//! How the lines of a chart look, in the panels and in the legend alike.
//!
//! The colours are those of Okabe and Ito ("Color Universal Design", 2008), which people with any
//! colour vision can tell apart. Their yellow is too pale for a line on white.

/// Colours of solid lines, in order.
const PALETTE: [&str; 6] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9",
];
/// Dashes of the first six methods and of those that follow, since colours repeat.
const ROUNDS: [&str; 4] = ["none", "16 3", "10 3 3 3", "5 2"];

/// How a line is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Stroke {
    /// Solid, in the next colour of the palette: a method.
    #[default]
    Solid,
    /// Dashed and black: something to compare the methods with.
    Dashed,
    /// Dotted and grey: a bound.
    Dotted,
}

/// A label and how its lines look.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Look {
    /// What the legend says.
    pub(super) label: String,
    stroke: Stroke,
    colour: &'static str,
    dashes: &'static str,
}

impl Look {
    /// Every label once, in the order in which they first occur, those of solid lines first.
    pub(super) fn of_each<'a>(lines: impl Iterator<Item = (&'a str, Stroke)>) -> Vec<Self> {
        let mut looks: Vec<Self> = Vec::new();
        let mut solids = 0;
        for (label, stroke) in lines {
            if looks.iter().any(|look| look.label == label) {
                continue;
            }
            let (colour, dashes) = match stroke {
                Stroke::Dashed => ("#000000", "8 5"),
                Stroke::Dotted => ("#787878", "2 4"),
                Stroke::Solid => {
                    let round = solids / PALETTE.len() % ROUNDS.len();
                    (PALETTE[solids % PALETTE.len()], ROUNDS[round])
                }
            };
            solids += usize::from(stroke == Stroke::Solid);
            looks.push(Self {
                label: label.to_owned(),
                stroke,
                colour,
                dashes,
            });
        }
        looks.sort_by_key(|look| look.stroke != Stroke::Solid);
        looks
    }

    /// A line through the outline of an SVG path.
    pub(super) fn draw(&self, outline: &str) -> String {
        format!(
            "<path d=\"{outline}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\" \
             stroke-dasharray=\"{}\"/>\n",
            self.colour, self.dashes
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_of_the_first_24_solid_lines_look_alike_and_others_come_last() {
        let labels: Vec<String> = (0..24).map(|number| number.to_string()).collect();
        let solid = labels.iter().map(|label| (label.as_str(), Stroke::Solid));
        let looks = Look::of_each(std::iter::once(("floor", Stroke::Dotted)).chain(solid));
        for (place, look) in looks.iter().enumerate() {
            let drawn = look.draw("");
            assert!(
                !looks[..place].iter().any(|other| other.draw("") == drawn),
                "{drawn}"
            );
        }
        assert!(looks[..6].iter().all(|look| look.dashes == "none"));
        assert_eq!(looks[24].label, "floor");
    }
}
