//! Evaluations as tables for people.

use std::fmt::Write;

use super::{Compared, Evaluation, FrameResult, KeysEvaluation, Metrics};

/// The names of the columns.
fn header() -> String {
    format!(
        "{:18} {:>9} {:>9} {:>9} {:>9} {:>8} {:>8} {:>6} {:>9}\n",
        "", "CD x10^3", "CD", "HD", "HD95", "normals", "volume", "pieces", "tracked"
    )
}

/// One line of numbers.
fn line(name: &str, metrics: &Metrics) -> String {
    let tracked = metrics
        .tracked_rmse
        .map_or_else(|| "-".to_owned(), |rmse| format!("{rmse:.5}"));
    format!(
        "{name:18} {:9.4} {:9.5} {:9.4} {:9.5} {:8.4} {:8.4} {:6.2} {tracked:>9}\n",
        1e3 * metrics.chamfer_squared,
        metrics.chamfer,
        metrics.hausdorff,
        metrics.hausdorff95,
        metrics.normal_consistency,
        metrics.volume_ratio,
        metrics.components,
    )
}

/// The lines of what was compared with the truth, at the best times too where these were sought.
fn lines(mean: &FrameResult, aligned: bool) -> String {
    let kinds = [
        ("surface", mean.surface.as_ref()),
        ("carried", mean.carried.as_ref()),
        ("linear", Some(&mean.linear)),
        ("natural", mean.natural.as_ref()),
    ];
    let both = |(name, compared): (&str, Option<&Compared>)| {
        let compared = compared?;
        let best = aligned.then(|| line(&format!("{name}, aligned"), &compared.aligned));
        Some(line(name, &compared.metrics) + &best.unwrap_or_default())
    };
    kinds.into_iter().filter_map(both).collect::<String>() + &line("floor", &mean.floor)
}

const LEGEND: &str =
    "CD x10^3 is the squared Chamfer distance of the paper; CD and HD are not squared";

impl Evaluation {
    /// The means as a table for people, one line per thing measured. `from` and `to` are the frames of the ends.
    pub fn table(&self, [from, to]: [usize; 2]) -> String {
        let mut table = format!(
            "mean over {} frames between {from} and {to}; lengths in normalised units\n",
            self.frames.len(),
        );
        table += &header();
        table += &lines(&self.mean, true);
        for (end, result) in ["source", "target"].into_iter().zip(&self.ends) {
            if let Some(surface) = &result.surface {
                table += &line(&format!("surface, {end}"), &surface.metrics);
            }
        }
        // The source's vertices start where they are.
        if let Some(carried) = self.ends.last().and_then(|end| end.carried.as_ref()) {
            table += &line("carried to target", &carried.metrics);
        }
        table
            + LEGEND
            + "; aligned: at the best times; source, target: the ends that the run was trained on\n"
    }
}

impl KeysEvaluation {
    /// A table for people: the means over all frames between key frames, then those of each interval, then the drift.
    pub fn table(&self) -> String {
        let keys = &self.keys;
        let segments = || self.segments.iter();
        let count: usize = segments().map(|segment| segment.frames.len()).sum();
        let mut table = format!(
            "mean over {count} frames between the key frames {keys:?}; lengths in normalised units\n"
        );
        table += &header();
        table += &lines(&self.mean, false);
        for (segment, two) in segments().zip(keys.windows(2)) {
            let kinds = [
                ("surface", segment.mean.surface.as_ref()),
                ("carried", segment.mean.carried.as_ref()),
            ];
            for (name, compared) in kinds {
                if let Some(compared) = compared {
                    let name = format!("{name} {}-{}", two[0], two[1]);
                    table += &line(&name, &compared.metrics);
                }
            }
        }
        if let Some(drift) = &self.drift {
            // Writing to a string does not fail.
            let _ = writeln!(
                table,
                "drift of vertices carried from the first key frame: {:.5} in the mean, {:.5} at the last one, {:.5} there and back",
                drift.mean, drift.last, drift.there_and_back
            );
        }
        table + LEGEND + "; natural: cubic splines through all true vertices of the key frames\n"
    }
}
