//! One axis of a panel: its range, its ticks and what is written at them.
//!
//! A logarithmic axis is a linear one of log10 of the values.

use std::ops::Range;

/// How values are laid out along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Scale {
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
        place.is_finite().then_some(place)
    }
}

/// An axis with its ticks.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axis {
    /// From end to end, as [`Scale::place`] says.
    range: Range<f64>,
    /// Places and texts of the ticks.
    pub(super) ticks: Vec<(f64, String)>,
}

impl Axis {
    /// An axis from the least to the greatest of these places, with some room beyond them; `None`
    /// without any.
    pub(super) fn around(scale: Scale, places: impl Iterator<Item = f64>) -> Option<Self> {
        // Share of the range that is added at either end.
        const ROOM: f64 = 0.06;
        let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| {
            (low.min(place), high.max(place))
        });
        let room = match high - low {
            size if size > 0.0 => ROOM * size,
            // A single value gets a range of its own size, or of 1 around zero.
            _ if low == 0.0 => 0.5,
            _ => 0.1 * low.abs(),
        };
        (low <= high).then(|| Self::over(scale, low - room..high + room))
    }

    /// An axis over just this range of places.
    pub(super) fn over(scale: Scale, range: Range<f64>) -> Self {
        let ticks = match scale {
            Scale::Linear => linear_ticks(&range),
            Scale::Log => log_ticks(&range),
        };
        Self { range, ticks }
    }

    /// How far along the axis a place is: 0 at its start, 1 at its end.
    pub(super) fn share(&self, place: f64) -> f64 {
        (place - self.range.start) / (self.range.end - self.range.start)
    }
}

/// About six ticks at multiples of 1, 2 or 5 times a power of ten.
fn linear_ticks(range: &Range<f64>) -> Vec<(f64, String)> {
    let rough = (range.end - range.start) / 6.0;
    let power = 10f64.powf(rough.log10().floor());
    let digits = [1.0, 2.0, 5.0].into_iter();
    let digit = digits.rev().fold(
        10.0,
        |found, digit| {
            if rough <= digit * power { digit } else { found }
        },
    );
    let step = digit * power;
    // Rounding must not cost the first or the last tick.
    let slack = 1e-9;
    let first = (range.start / step - slack).ceil() as i64;
    let last = (range.end / step + slack).floor() as i64;
    let decimals = (-step.log10() - slack).ceil().max(0.0) as usize;
    let text = |value: f64| format!("{value:.decimals$}");
    (first..=last)
        .map(|count| count as f64 * step)
        .map(|value| (value, text(value)))
        .collect()
}

/// Ticks at 1, 2 and 5 times powers of ten, at powers alone over many decades, and at evenly spaced
/// values where less than a factor of three is shown.
fn log_ticks(range: &Range<f64>) -> Vec<(f64, String)> {
    let decades = range.end - range.start;
    if decades < 3f64.log10() {
        let values = linear_ticks(&(10f64.powf(range.start)..10f64.powf(range.end)));
        let placed = |(value, text)| Some((Scale::Log.place(value)?, text));
        return values.into_iter().filter_map(placed).collect();
    }
    let digits: &[f64] = if decades <= 3.0 {
        &[1.0, 2.0, 5.0]
    } else {
        &[1.0]
    };
    let every = (decades / 8.0).ceil() as usize;
    (range.start.floor() as i32..=range.end.ceil() as i32)
        .step_by(every)
        .flat_map(|power| digits.iter().map(move |digit| (*digit, power)))
        .map(|(digit, power)| (digit.log10() + f64::from(power), decimal(digit, power)))
        .filter(|(place, _)| range.contains(place))
        .collect()
}

/// `digit` times ten to the `power`: 0.02, or 2e-6 where there would be many zeros.
fn decimal(digit: f64, power: i32) -> String {
    if power.abs() > 4 {
        return format!("{digit}e{power}");
    }
    let decimals = usize::try_from(-power).unwrap_or(0);
    format!("{:.decimals$}", digit * 10f64.powi(power))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(scale: Scale, range: Range<f64>) -> Vec<String> {
        let ticks = Axis::over(scale, range).ticks;
        ticks.into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn linear_ticks_are_round_numbers() {
        let one = ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"];
        assert_eq!(texts(Scale::Linear, 0.0..1.0), one);
        let fifty = ["0", "10", "20", "30", "40"];
        assert_eq!(texts(Scale::Linear, -3.0..47.0), fifty);
    }

    #[test]
    fn log_ticks_are_1_2_and_5_times_powers_of_ten_or_fewer_over_many_decades() {
        let two = ["0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1"];
        assert_eq!(texts(Scale::Log, -2.1..0.1), two);
        let twelve = ["1e-8", "1e-6", "0.0001", "0.01", "1", "100"];
        assert_eq!(texts(Scale::Log, -8.0..4.0), twelve);
        // From 3.1 to 3.9.
        let narrow = ["3.2", "3.4", "3.6", "3.8"];
        assert_eq!(texts(Scale::Log, 3.1f64.log10()..3.9f64.log10()), narrow);
    }

    #[test]
    fn a_single_value_lies_inside_its_axis() {
        for value in [0.0, 2.0, -1.5] {
            let axis = Axis::around(Scale::Linear, std::iter::once(value)).expect("a value");
            let share = axis.share(value);
            assert!(
                share > 0.0 && share < 1.0 && axis.ticks.len() >= 2,
                "{axis:?}"
            );
        }
        assert_eq!(Axis::around(Scale::Linear, std::iter::empty()), None);
    }

    #[test]
    fn what_is_not_above_zero_has_no_place_on_a_log_axis() {
        assert_eq!(
            [0.0, -1.0, f64::NAN].map(|value| Scale::Log.place(value)),
            [None; 3]
        );
        assert_eq!(Scale::Log.place(100.0), Some(2.0));
        assert_eq!(Scale::Linear.place(-1.0), Some(-1.0));
    }
}
