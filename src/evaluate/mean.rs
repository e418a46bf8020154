//! Means over frames, entry by entry.

use super::{Compared, Evaluation, FrameResult, Metrics};

impl Evaluation {
    /// The frames with their means, without ends.
    ///
    /// An entry that some frames lack is absent from the mean: a mean over fewer frames would be
    /// compared with means over all.
    pub fn of(frames: Vec<FrameResult>) -> Self {
        let mean = match frames.as_slice() {
            [] => FrameResult::default(),
            frames => mean_frame(frames),
        };
        let ends = Vec::new();
        Self { frames, mean, ends }
    }
}

fn mean_frame(frames: &[FrameResult]) -> FrameResult {
    let optional = |entry: fn(&FrameResult) -> Option<&Compared>| {
        let all: Option<Vec<_>> = frames.iter().map(entry).collect();
        all.map(|all| mean_compared(&all))
    };
    let linear: Vec<_> = frames.iter().map(|frame| &frame.linear).collect();
    let floor: Vec<_> = frames.iter().map(|frame| &frame.floor).collect();
    FrameResult {
        frame: None,
        time: None,
        surface: optional(|frame| frame.surface.as_ref()),
        carried: optional(|frame| frame.carried.as_ref()),
        linear: mean_compared(&linear),
        natural: optional(|frame| frame.natural.as_ref()),
        floor: mean_metrics(&floor),
    }
}

fn mean_compared(all: &[&Compared]) -> Compared {
    let own: Vec<_> = all.iter().map(|compared| &compared.metrics).collect();
    let aligned: Vec<_> = all.iter().map(|compared| &compared.aligned).collect();
    Compared {
        metrics: mean_metrics(&own),
        aligned: mean_metrics(&aligned),
    }
}

fn mean_metrics(all: &[&Metrics]) -> Metrics {
    let count = all.len() as f64;
    let mean =
        |entry: fn(&Metrics) -> f64| all.iter().map(|metrics| entry(metrics)).sum::<f64>() / count;
    let optional = |entry: fn(&Metrics) -> Option<f64>| {
        // The sum of options is none as soon as one of them is.
        let sum: Option<f64> = all.iter().map(|metrics| entry(metrics)).sum();
        sum.map(|sum| sum / count)
    };
    Metrics {
        time: mean(|metrics| metrics.time),
        chamfer: mean(|metrics| metrics.chamfer),
        chamfer_squared: mean(|metrics| metrics.chamfer_squared),
        hausdorff: mean(|metrics| metrics.hausdorff),
        hausdorff_squared: mean(|metrics| metrics.hausdorff_squared),
        hausdorff95: mean(|metrics| metrics.hausdorff95),
        normal_consistency: mean(|metrics| metrics.normal_consistency),
        volume_ratio: mean(|metrics| metrics.volume_ratio),
        area_ratio: mean(|metrics| metrics.area_ratio),
        components: mean(|metrics| metrics.components),
        outside_largest: mean(|metrics| metrics.outside_largest),
        slope_error: optional(|metrics| metrics.slope_error),
        tracked_rmse: optional(|metrics| metrics.tracked_rmse),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(chamfer: f64, slope_error: Option<f64>) -> FrameResult {
        let metrics = Metrics {
            chamfer,
            slope_error,
            ..Metrics::default()
        };
        let aligned = Metrics {
            chamfer: chamfer / 2.0,
            ..metrics.clone()
        };
        let surface = Compared { metrics, aligned };
        FrameResult {
            frame: Some(1),
            time: Some(0.5),
            surface: Some(surface),
            ..FrameResult::default()
        }
    }

    #[test]
    fn each_entry_is_averaged_and_the_frame_number_is_not() {
        let all = Evaluation::of(vec![frame(1.0, Some(0.5)), frame(4.0, Some(1.0))]);
        let surface = all.mean.surface.expect("both have one");
        assert_eq!(surface.metrics.chamfer, 2.5);
        assert_eq!(surface.aligned.chamfer, 1.25);
        assert_eq!(surface.metrics.slope_error, Some(0.75));
        assert_eq!(
            (all.mean.frame, all.mean.time, all.mean.carried),
            (None, None, None)
        );
    }

    #[test]
    fn what_one_frame_lacks_the_mean_lacks() {
        let mut without = frame(1.0, None);
        let mean = Evaluation::of(vec![frame(4.0, Some(1.0)), without.clone()]).mean;
        assert_eq!(
            mean.surface.expect("both have one").metrics.slope_error,
            None
        );
        without.surface = None;
        assert_eq!(
            Evaluation::of(vec![frame(4.0, None), without]).mean.surface,
            None
        );
    }

    #[test]
    fn results_come_back_from_json_as_they_were_and_so_does_the_mean_of_nothing() {
        // Halves and quarters are exact in any number of digits.
        for frames in [vec![frame(1.0, Some(0.5)), frame(4.0, None)], Vec::new()] {
            let written = Evaluation::of(frames);
            let text = serde_json::to_string(&written).expect("numbers");
            let read: Evaluation = serde_json::from_str(&text).expect("what was written");
            assert_eq!(read, written);
        }
    }
}
