//! One axis of a panel: its range, its ticks and what is written at them.
//!
//! A logarithmic axis is a linear one of log10 of the values, with ticks at 1, 2 and 5 times powers of ten.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

/// How values are laid out along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences, equal distances.
    #[default]
    Linear,
    /// Equal ratios, equal distances; values must be above zero.
    Log,
}

impl Scale {
    /// Where a value lies on the axis; `None` if it has no place there.
    pub(super) fn place(self, value: f64) -> Option<f64> {
        let place = match self {
            Self::Linear => value,
            Self::Log => value.log10(),
        };
        (place.is_finite() && (self == Self::Linear || value > 0.0)).then_some(place)
    }
}

/// An axis with its ticks.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axis {
    /// From end to end, as [`Scale::place`] says.
    pub(super) range: Range<f64>,
    /// Places and texts of the ticks.
    ticks: Vec<(f64, String)>,
}

impl Axis {
    /// An axis from the least to the greatest of these places, with some room beyond them.
    pub(super) fn around(scale: Scale, places: impl Iterator<Item = f64>) -> Option<Self> {
        // Share of the range that is added at either end.
        const ROOM: f64 = 0.06;
        let (low, high) = places.fold(None, |range: Option<(f64, f64)>, place| {
            Some(range.map_or((place, place), |(low, high)| {
                (low.min(place), high.max(place))
            }))
        })?;
        // A single value gets a range of its own size, or of 1 around zero.
        let alone = if low.abs() > 0.0 {
            0.1 * low.abs()
        } else {
            0.5
        };
        let room = if high > low {
            ROOM * (high - low)
        } else {
            alone
        };
        Some(Self::exactly(scale, low - room..high + room))
    }

    /// An axis over just this range of places.
    pub(super) fn exactly(scale: Scale, range: Range<f64>) -> Self {
        let ticks = match scale {
            Scale::Linear => linear_ticks(&range, 6.0),
            Scale::Log => log_ticks(&range),
        };
        Self { range, ticks }
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, place: &f64, (start, end): (i32, i32)) -> i32 {
        let share = (place - self.range.start) / (self.range.end - self.range.start);
        start + (share * f64::from(end - start)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _hint: Hint) -> Vec<f64> {
        self.ticks.iter().map(|(place, _)| *place).collect()
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, place: &f64) -> String {
        let nearest = self
            .ticks
            .iter()
            .min_by(|(one, _), (other, _)| (one - place).abs().total_cmp(&(other - place).abs()));
        nearest.map_or_else(String::new, |(_, text)| text.clone())
    }
}

/// Ticks at multiples of 1, 2 or 5 times a power of ten, about `wanted` of them.
fn linear_ticks(range: &Range<f64>, wanted: f64) -> Vec<(f64, String)> {
    let rough = (range.end - range.start) / wanted;
    let power = 10f64.powf(rough.log10().floor());
    let step = power
        * match rough / power {
            share if share <= 1.0 => 1.0,
            share if share <= 2.0 => 2.0,
            share if share <= 5.0 => 5.0,
            _ => 10.0,
        };
    let decimals = (-step.log10() - 1e-9).ceil().clamp(0.0, 12.0) as usize;
    let slack = 1e-9 * step;
    let first = ((range.start - slack) / step).ceil() as i64;
    let last = ((range.end + slack) / step).floor() as i64;
    (first..=last)
        .map(|count| count as f64 * step)
        .map(|value| (value, format!("{value:.decimals$}")))
        .collect()
}

/// Ticks at 1, 2 and 5 times powers of ten, at powers alone over many decades, and at evenly spaced
/// values where less than a factor of three is shown.
fn log_ticks(range: &Range<f64>) -> Vec<(f64, String)> {
    let decades = range.end - range.start;
    if decades < 3f64.log10() {
        let values = 10f64.powf(range.start)..10f64.powf(range.end);
        return linear_ticks(&values, 5.0)
            .into_iter()
            .filter_map(|(value, text)| Some((Scale::Log.place(value)?, text)))
            .collect();
    }
    let digits: &[f64] = if decades <= 3.0 {
        &[1.0, 2.0, 5.0]
    } else {
        &[1.0]
    };
    let powers = range.start.floor() as i32..=range.end.ceil() as i32;
    powers
        .flat_map(|power| digits.iter().map(move |digit| (*digit, power)))
        .map(|(digit, power)| (digit.log10() + f64::from(power), decimal(digit, power)))
        .filter(|(place, _)| range.contains(place))
        .collect()
}

/// `digit` times ten to the `power` in plain decimals, such as 0.02.
fn decimal(digit: f64, power: i32) -> String {
    let decimals = usize::try_from(-power).unwrap_or(0);
    format!("{:.decimals$}", digit * 10f64.powi(power))
}

#[cfg(test)]
mod tests {
    use plotters::coord::ranged1d::BoldPoints;

    use super::*;

    /// How many ticks are asked for does not matter: the axis has its own.
    const TICKS: BoldPoints = BoldPoints(10);

    fn texts(axis: &Axis) -> Vec<String> {
        let places = axis.key_points(TICKS);
        places.iter().map(|place| axis.format_ext(place)).collect()
    }

    #[test]
    fn linear_ticks_are_round_numbers() {
        let axis = Axis::exactly(Scale::Linear, 0.0..1.0);
        assert_eq!(texts(&axis), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        let axis = Axis::exactly(Scale::Linear, -3.0..47.0);
        assert_eq!(texts(&axis), ["0", "10", "20", "30", "40"]);
    }

    #[test]
    fn log_ticks_are_1_2_and_5_times_powers_of_ten() {
        let axis = Axis::exactly(Scale::Log, -2.1..0.1);
        assert_eq!(
            texts(&axis),
            ["0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1"]
        );
    }

    #[test]
    fn a_narrow_log_axis_has_ticks_all_the_same() {
        let axis = Axis::exactly(Scale::Log, 3.1f64.log10()..3.9f64.log10());
        assert_eq!(texts(&axis), ["3.2", "3.4", "3.6", "3.8"]);
    }

    #[test]
    fn a_single_value_lies_inside_its_axis() {
        for value in [0.0, 2.0, -1.5] {
            let axis = Axis::around(Scale::Linear, std::iter::once(value)).expect("a value");
            assert!(
                axis.range.start < value && value < axis.range.end,
                "{axis:?}"
            );
            assert!(axis.key_points(TICKS).len() >= 2, "{axis:?}");
        }
        assert_eq!(Axis::around(Scale::Linear, std::iter::empty()), None);
    }

    #[test]
    fn what_is_not_above_zero_has_no_place_on_a_log_axis() {
        assert_eq!(Scale::Log.place(0.0), None);
        assert_eq!(Scale::Log.place(-1.0), None);
        assert_eq!(Scale::Log.place(f64::NAN), None);
        assert_eq!(Scale::Log.place(100.0), Some(2.0));
        assert_eq!(Scale::Linear.place(-1.0), Some(-1.0));
    }
}
