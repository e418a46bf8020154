//! The columns of the table: what each shows of a method, in which unit, and which value is best.

use crate::evaluate::{Compared, FrameResult, Metrics};

/// What a row of the table shows.
#[derive(Clone, Debug, Default)]
pub(super) struct Row {
    /// The name of the method.
    pub(super) label: String,
    /// The surface that the method extracts.
    pub(super) surface: Option<Compared>,
    /// The source's mesh, carried along.
    pub(super) carried: Option<Compared>,
    /// Wall time of the training.
    pub(super) training_seconds: Option<f64>,
}

impl Row {
    /// The row of a method.
    pub(super) fn of_method(label: &str, mean: &FrameResult, training_seconds: f64) -> Self {
        Self {
            label: label.to_owned(),
            surface: mean.surface.clone(),
            carried: mean.carried.clone(),
            training_seconds: Some(training_seconds),
        }
    }

    /// Straight lines: a mesh carried along, which is its surface too.
    pub(super) fn of_linear(mean: &FrameResult) -> Self {
        Self {
            label: "linear".to_owned(),
            surface: Some(mean.linear.clone()),
            carried: Some(mean.linear.clone()),
            training_seconds: None,
        }
    }

    /// The floor: the same whatever the time, and of distances and normals only.
    pub(super) fn of_floor(mean: &FrameResult) -> Self {
        let floor = Metrics {
            volume_ratio: f64::NAN,
            components: f64::NAN,
            slope_error: None,
            tracked_rmse: None,
            ..mean.floor.clone()
        };
        let compared = Compared {
            metrics: floor.clone(),
            aligned: floor,
        };
        Self {
            label: "floor".to_owned(),
            surface: Some(compared.clone()),
            carried: Some(compared),
            training_seconds: None,
        }
    }
}

/// Which value of a column is best.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Goal {
    /// The least.
    Least,
    /// The greatest.
    Most,
    /// The nearest to 1.
    One,
}

impl Goal {
    /// How far a value is from the best there can be, to compare values by.
    pub(super) fn shortfall(self, value: f64) -> f64 {
        match self {
            Self::Least => value,
            Self::Most => -value,
            Self::One => (value - 1.0).abs(),
        }
    }

    fn arrow(self) -> &'static str {
        match self {
            Self::Least => "↓",
            Self::Most => "↑",
            Self::One => "→ 1",
        }
    }
}

/// How a column writes its numbers.
#[derive(Clone, Copy, Debug)]
enum Style {
    /// Three significant digits.
    Significant,
    /// So many decimals.
    Decimals(usize),
}

/// A column of the table.
#[derive(Clone, Copy)]
pub(super) struct Column {
    head: &'static str,
    /// Which value is best.
    pub(super) goal: Goal,
    style: Style,
    factor: f64,
    read: fn(&Row) -> Option<f64>,
}

impl Column {
    /// What stands above it: quantity, factor and direction.
    pub(super) fn head(&self) -> String {
        format!("{} {}", self.head, self.goal.arrow())
    }

    /// The value of a row in the column's unit; `None` where there is none.
    pub(super) fn value(&self, row: &Row) -> Option<f64> {
        (self.read)(row)
            .map(|value| value * self.factor)
            .filter(|value| value.is_finite())
    }

    /// The value as text.
    pub(super) fn shown(&self, value: f64) -> String {
        match self.style {
            Style::Significant => significant(value, 3),
            Style::Decimals(decimals) => format!("{value:.decimals$}"),
        }
    }
}

/// The columns, from left to right.
pub(super) const COLUMNS: &[Column] = &[
    column("CD ×10³", Goal::Least, Style::Significant, 1e3, |row| {
        own(&row.surface, |m| m.chamfer_squared)
    }),
    column("HD", Goal::Least, Style::Significant, 1.0, |row| {
        own(&row.surface, |m| m.hausdorff)
    }),
    column("HD² ×10²", Goal::Least, Style::Significant, 1e2, |row| {
        own(&row.surface, |m| m.hausdorff_squared)
    }),
    column("normals", Goal::Most, Style::Decimals(3), 1.0, |row| {
        own(&row.surface, |m| m.normal_consistency)
    }),
    column("volume", Goal::One, Style::Decimals(3), 1.0, |row| {
        own(&row.surface, |m| m.volume_ratio)
    }),
    column("pieces", Goal::One, Style::Decimals(1), 1.0, |row| {
        own(&row.surface, |m| m.components)
    }),
    column("slope", Goal::Least, Style::Significant, 1.0, |row| {
        row.surface.as_ref()?.metrics.slope_error
    }),
    column(
        "CD ×10³ aligned",
        Goal::Least,
        Style::Significant,
        1e3,
        |row| aligned(&row.surface, |m| m.chamfer_squared),
    ),
    column("HD aligned", Goal::Least, Style::Significant, 1.0, |row| {
        aligned(&row.surface, |m| m.hausdorff)
    }),
    column(
        "carried CD ×10³",
        Goal::Least,
        Style::Significant,
        1e3,
        |row| own(&row.carried, |m| m.chamfer_squared),
    ),
    column(
        "tracked RMSE ×10²",
        Goal::Least,
        Style::Significant,
        1e2,
        |row| row.carried.as_ref()?.metrics.tracked_rmse,
    ),
    column(
        "tracked RMSE ×10² aligned",
        Goal::Least,
        Style::Significant,
        1e2,
        |row| row.carried.as_ref()?.aligned.tracked_rmse,
    ),
    column(
        "training (s)",
        Goal::Least,
        Style::Decimals(0),
        1.0,
        |row| row.training_seconds,
    ),
];

const fn column(
    head: &'static str,
    goal: Goal,
    style: Style,
    factor: f64,
    read: fn(&Row) -> Option<f64>,
) -> Column {
    Column {
        head,
        goal,
        style,
        factor,
        read,
    }
}

fn own(compared: &Option<Compared>, read: fn(&Metrics) -> f64) -> Option<f64> {
    compared.as_ref().map(|compared| read(&compared.metrics))
}

fn aligned(compared: &Option<Compared>, read: fn(&Metrics) -> f64) -> Option<f64> {
    compared.as_ref().map(|compared| read(&compared.aligned))
}

/// A number with so many significant digits, and no exponent.
pub(super) fn significant(value: f64, digits: usize) -> String {
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    // Taken from the rounded text: 9.996 becomes 10.0 and not 10.00.
    let exponent = scientific.split_once('e').map(|(_, exponent)| exponent);
    let exponent: i64 = exponent.and_then(|text| text.parse().ok()).unwrap_or(0);
    let decimals = (digits as i64 - 1 - exponent).clamp(0, 12) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_significant_digits_are_written_without_exponents() {
        let shown = [0.006_371, 0.099_96, 1.0, 9.996, 12.345, 1234.5].map(|v| significant(v, 3));
        assert_eq!(shown, ["0.00637", "0.100", "1.00", "10.0", "12.3", "1234"]);
        assert_eq!(significant(0.0, 3), "0.00");
    }

    #[test]
    fn a_ratio_below_1_is_as_good_as_one_as_far_above() {
        assert_eq!(Goal::One.shortfall(0.75), Goal::One.shortfall(1.25));
        assert!(Goal::Most.shortfall(0.9) < Goal::Most.shortfall(0.8));
        assert!(Goal::Least.shortfall(0.8) < Goal::Least.shortfall(0.9));
    }

    #[test]
    fn no_two_columns_read_the_same_number() {
        // Each metric gets a value of its own; factors are powers of ten and 7 is no factor of those.
        let metrics = |first: f64| Metrics {
            chamfer_squared: first,
            hausdorff: first * 7.0,
            hausdorff_squared: first * 49.0,
            normal_consistency: first * 343.0,
            volume_ratio: first * 2401.0,
            components: first * 16_807.0,
            slope_error: Some(first * 117_649.0),
            tracked_rmse: Some(first * 823_543.0),
            ..Metrics::default()
        };
        let compared = |own: f64, aligned: f64| {
            Some(Compared {
                metrics: metrics(own),
                aligned: metrics(aligned),
            })
        };
        let row = Row {
            label: String::new(),
            surface: compared(1.0, 3.0),
            carried: compared(11.0, 13.0),
            training_seconds: Some(17.0),
        };
        let mut read: Vec<f64> = COLUMNS
            .iter()
            .map(|column| (column.read)(&row).expect("every column has a value"))
            .collect();
        read.sort_by(f64::total_cmp);
        read.dedup();
        assert_eq!(read.len(), COLUMNS.len());
    }

    #[test]
    fn the_floor_says_nothing_of_volume_pieces_slope_and_tracking() {
        let row = Row::of_floor(&FrameResult::default());
        let empty = COLUMNS.iter().filter(|column| column.value(&row).is_none());
        let heads: Vec<&str> = empty.map(|column| column.head).collect();
        let expected = [
            "volume",
            "pieces",
            "slope",
            "tracked RMSE ×10²",
            "tracked RMSE ×10² aligned",
            "training (s)",
        ];
        assert_eq!(heads, expected);
    }
}
