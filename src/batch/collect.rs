//! The figures of all runs of a batch: as CSV, JSON and Parquet for programs, as a page for people.

use std::io::{self, Write};
use std::path::PathBuf;

use serde_json::Value;

use super::figures::{Cell, write_parquet};
use super::jobs::Batch;
use super::table::{JobStatus, statuses};
use crate::atomic::write_atomically;
use crate::error::Result;
use crate::session::state::RunState;

/// What was collected, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Collected {
    /// All jobs.
    pub jobs: usize,
    /// Those that are done.
    pub done: usize,
    /// Those that failed.
    pub failed: usize,
    /// `results.csv`, `results.json`, `results.parquet` and `index.html`.
    pub files: [PathBuf; 4],
}

/// The columns of the CSV.
const COLUMNS: [&str; 16] = [
    "name",
    "source",
    "target",
    "state",
    "step",
    "steps",
    "seconds",
    "wall_seconds",
    "peak_memory_bytes",
    "total",
    "surfaces",
    "consistency",
    "chamfer",
    "tracked_rmse",
    "doubts",
    "reason",
];

/// Writes the figures of all jobs into the folder of the batch. Each run is read once, and of each no more than its rows are held.
///
/// # Errors
/// The folder cannot be written.
pub fn collect(batch: &Batch) -> Result<Collected> {
    std::fs::create_dir_all(&batch.folder)?;
    let files = [
        "results.csv",
        "results.json",
        "results.parquet",
        "index.html",
    ];
    let files = files.map(|name| batch.folder.join(name));
    let (mut done, mut failed) = (0, 0);
    let mut rows = Vec::with_capacity(batch.jobs.len());
    let (mut objects, mut shown) = (Vec::new(), Vec::new());
    for job in statuses(batch) {
        done += usize::from(job.run.state == RunState::Done);
        failed += usize::from(matches!(job.run.state, RunState::Failed { .. }));
        let mean = evaluation(batch, &job).unwrap_or(Value::Null);
        rows.push(row(&job, &mean));
        shown.push(shown_row(batch, &job));
        let mut object = serde_json::to_value(&job)?;
        object["evaluation"] = mean;
        objects.push(object.to_string());
    }
    write_atomically(&files[0], |csv| {
        writeln!(csv, "{}", COLUMNS.join(","))?;
        for row in &rows {
            writeln!(csv, "{}", row.each_ref().map(Cell::field).join(","))?;
        }
        Ok(())
    })?;
    write_atomically(&files[2], |out| write_parquet(&COLUMNS, &rows, out))?;
    write_atomically(&files[1], |out| {
        writeln!(out, "[\n{}\n]", objects.join(",\n"))
    })?;
    write_atomically(&files[3], |out| page(batch, &shown, out))?;
    Ok(Collected {
        jobs: batch.jobs.len(),
        done,
        failed,
        files,
    })
}

/// The means of an evaluation, if there was one.
fn evaluation(batch: &Batch, job: &JobStatus) -> Option<Value> {
    let path = batch.folder.join(&job.name).join("evaluation.json");
    let text = std::fs::read_to_string(path).ok()?;
    let mut value: Value = serde_json::from_str(&text).ok()?;
    Some(value["mean"].take())
}

fn row(job: &JobStatus, mean: &Value) -> [Cell; 16] {
    let run = &job.run;
    let text = |text: &str| Cell::Text(text.to_owned());
    let count = |count: usize| Cell::Count(Some(count as u64));
    let measured = |of: &str, key: &str| Cell::Number(mean[of][key].as_f64());
    [
        text(&job.name),
        text(&job.files[0]),
        text(&job.files[1]),
        text(word(&run.state)),
        count(run.step),
        Cell::Count(run.steps.map(|steps| steps as u64)),
        Cell::Number(run.seconds),
        Cell::Number(run.wall_seconds),
        Cell::Count(run.peak_memory_bytes),
        Cell::Number(run.total),
        count(run.surfaces),
        Cell::Number(run.consistency),
        measured("surface", "chamfer"),
        measured("carried", "tracked_rmse"),
        count(run.doubts.len()),
        text(reason(&run.state)),
    ]
}

/// A state in one word.
pub(super) fn word(state: &RunState) -> &'static str {
    match state {
        RunState::Waiting => "waiting",
        RunState::Running { .. } => "running",
        RunState::Interrupted => "interrupted",
        RunState::Failed { .. } => "failed",
        RunState::Done => "done",
    }
}

fn reason(state: &RunState) -> &str {
    match state {
        RunState::Failed { reason } => reason,
        RunState::Running { by } => by,
        _ => "",
    }
}

/// Text as it stands in HTML.
fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;").replace('"', "&quot;")
}

const STYLE: &str = "
:root { color-scheme: light dark; font: 15px system-ui, sans-serif; }
body { margin: 2rem auto; max-width: 75rem; padding: 0 1rem; }
table { border-collapse: collapse; width: 100%; }
td:first-child { white-space: nowrap; }
th, td { text-align: left; padding: .3rem .6rem; border-bottom: 1px solid #8884; vertical-align: middle; }
img { width: 18rem; height: 4.5rem; object-fit: contain; }
.failed { color: #c0392b; } .doubt { color: #b9770e; } .number { text-align: right; }
";

/// A table with a picture of each run, which leads to its page.
fn page(batch: &Batch, rows: &[String], out: &mut dyn Write) -> io::Result<()> {
    let title = batch.path.file_stem().unwrap_or_default().to_string_lossy();
    let title = escaped(&title);
    writeln!(
        out,
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title><style>{STYLE}</style>\
         </head><body><h1>{title}</h1><p>{} jobs of {}</p><table><thead><tr><th>run</th><th>surfaces</th><th>state</th>\
         <th class=\"number\">seconds</th><th class=\"number\">consistency</th><th>said</th></tr></thead><tbody>",
        batch.jobs.len(),
        escaped(&batch.path.display().to_string())
    )?;
    for row in rows {
        writeln!(out, "{row}")?;
    }
    writeln!(out, "</tbody></table></body></html>")
}

/// The row of a run on the page.
fn shown_row(batch: &Batch, job: &JobStatus) -> String {
    let name = escaped(&job.name);
    let run = batch.folder.join(&job.name);
    let there = |file: &str| run.join(file).is_file();
    let linked = match there("report.html") {
        true => format!("<a href=\"{name}/report.html\">{name}</a>"),
        false => name.clone(),
    };
    let picture = match there("meshes/preview.png") {
        true => format!(
            "<img loading=\"lazy\" alt=\"surfaces of {name}\" src=\"{name}/meshes/preview.png\">"
        ),
        false => String::new(),
    };
    let number = |value: Option<f64>| value.map_or_else(String::new, crate::event::significant);
    let mut said = String::new();
    if let RunState::Failed { reason } = &job.run.state {
        said += &format!("<span class=\"failed\">{}</span>", escaped(reason));
    }
    for doubt in &job.run.doubts {
        said += &format!("<div class=\"doubt\">{}</div>", escaped(doubt));
    }
    format!(
        "<tr><td>{linked}</td><td>{picture}</td><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td>\
         <td>{said}</td></tr>",
        word(&job.run.state),
        number(job.run.wall_seconds),
        number(job.run.consistency)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_stays_text() {
        assert_eq!(escaped("<a & \"b\">"), "&lt;a &amp; &quot;b&quot;&gt;");
    }
}
