//! The comparison as Markdown: one table for the mean over the pairs, one for each pair, and how the
//! numbers came about.
//!
//! The best value of a column is bold. Straight lines and the floor stand outside that contest; a
//! straight-line value that beats every method is marked with † instead.

use std::collections::BTreeSet;

use super::columns::{COLUMNS, Column, Row};
use super::comparison::{Comparison, MethodResult, PairComparison};
use super::entry::Network;
use crate::evaluate::FrameResult;

/// Marks straight lines that beat every method.
const MARK: &str = " †";
/// What stands where there is nothing to measure.
const NOTHING: &str = "–";

const LEGEND: &str = "\
Lengths are in normalised units: both end shapes together have their bounding box centred on the origin and \
a mean surface area of 1. Every number is the mean over the frames strictly between the two that the method \
saw. **CD**: sum over both directions of the mean squared distance; **HD**: largest distance in either \
direction; **HD²**: its square; **normals**: mean of |⟨n, n′⟩| between nearest samples; **volume**: enclosed \
volume over the true one; **pieces**: connected components; **slope**: mean of ||∇f| − 1| near the true \
surface; **carried**: the source's own mesh, moved along; **tracked RMSE**: root mean square distance of its \
vertices from the true ones; **aligned**: at the best of 129 times, in order, instead of the frame's own. \
*linear*: straight lines between all true corresponding vertices, which no method gets to see. *floor*: two \
independent samplings of the true surface; no method can be below it. ↓ less is better, ↑ more, → 1 nearer to 1.\n\n\
**Bold**: the best method; *linear* and *floor* are not in that contest. †: straight lines beat every method. \
–: nothing to measure.";

/// The comparison as a Markdown document.
#[must_use]
pub fn table(comparison: &Comparison) -> String {
    let mut blocks = vec![format!("# {}", escaped(&comparison.sequence))];
    if comparison.pairs.len() > 1 && !comparison.mean.is_empty() {
        blocks.push(format!("## Mean over {}", pairs_in_words(comparison)));
        let rows = comparison
            .mean
            .iter()
            .map(|method| Row::of_method(&method.method, &method.mean, method.training_seconds));
        blocks.push(block(rows.collect(), &comparison.mean[0].mean));
    }
    for pair in &comparison.pairs {
        blocks.push(format!("## Frames {}", pair.pair));
        blocks.push(pair_block(pair));
    }
    if !comparison.missing.is_empty() {
        blocks.push(missing(comparison));
    }
    blocks.extend(vanished(comparison));
    blocks.push(LEGEND.to_owned());
    blocks.push("## How".to_owned());
    blocks.push(effort(comparison));
    blocks.push(origin(comparison));
    blocks.join("\n\n") + "\n"
}

fn pairs_in_words(comparison: &Comparison) -> String {
    let pairs = comparison.pairs.iter().map(|pair| pair.pair.to_string());
    let pairs: Vec<String> = pairs.collect();
    format!("{} pairs: {}", pairs.len(), pairs.join(", "))
}

fn pair_block(pair: &PairComparison) -> String {
    let rows = pair.methods.iter().map(|result| {
        Row::of_method(
            &result.run.method,
            &result.mean,
            result.run.training_seconds,
        )
    });
    // A pair is in the comparison only if a method is done on it.
    let reference = pair.methods.first().map(|result| result.mean.clone());
    block(rows.collect(), &reference.unwrap_or_default())
}

/// A table of methods, with straight lines and the floor, which any method's evaluation holds alike.
fn block(methods: Vec<Row>, reference: &FrameResult) -> String {
    let (linear, floor) = (Row::of_linear(reference), Row::of_floor(reference));
    let labels = methods.iter().chain([&linear, &floor]);
    let labels = labels.map(|row| escaped(&row.label));
    let mut columns = vec![headed("method", labels.collect())];
    columns.extend(
        COLUMNS
            .iter()
            .map(|column| headed(&column.head(), cells(column, &methods, &linear, &floor))),
    );
    grid(&columns)
}

fn headed(head: &str, cells: Vec<String>) -> Vec<String> {
    std::iter::once(head.to_owned()).chain(cells).collect()
}

/// The cells of a column: the methods', then those of straight lines and of the floor.
fn cells(column: &Column, methods: &[Row], linear: &Row, floor: &Row) -> Vec<String> {
    let best = methods
        .iter()
        .filter_map(|row| column.value(row))
        .min_by(|one, other| {
            let shortfall = |value: f64| column.goal.shortfall(value);
            shortfall(*one).total_cmp(&shortfall(*other))
        });
    let plain = |row: &Row| {
        let value = column.value(row);
        value.map_or_else(|| NOTHING.to_owned(), |value| column.shown(value))
    };
    let contested = methods.iter().map(|row| {
        let shown = plain(row);
        // What looks the same is the same: no winner by digits that are not shown.
        if best.is_some_and(|best| column.shown(best) == shown) {
            format!("**{shown}**")
        } else {
            shown
        }
    });
    let mut cells: Vec<String> = contested.collect();
    let mark = match (column.value(linear), best) {
        (Some(value), Some(best))
            if column.goal.shortfall(value) < column.goal.shortfall(best)
                && column.shown(value) != column.shown(best) =>
        {
            MARK
        }
        _ => "",
    };
    cells.push(plain(linear) + mark);
    cells.push(plain(floor));
    cells
}

/// Columns of text, each with its head first, as a Markdown table whose source is aligned too; the
/// first column to the left, the others to the right.
fn grid(columns: &[Vec<String>]) -> String {
    let width = |column: &Vec<String>| {
        let widths = column.iter().map(|cell| cell.chars().count());
        widths.max().unwrap_or(0).max(3)
    };
    let widths: Vec<usize> = columns.iter().map(width).collect();
    let rule = widths.iter().enumerate().map(|(place, width)| match place {
        0 => "-".repeat(*width),
        _ => format!("{}:", "-".repeat(width - 1)),
    });
    let rule: Vec<String> = rule.collect();
    let line = |row: usize| {
        let cells = columns.iter().zip(&widths).enumerate();
        let cells = cells.map(|(place, (column, width))| match place {
            0 => format!("{:<width$}", column[row]),
            _ => format!("{:>width$}", column[row]),
        });
        format!("| {} |", cells.collect::<Vec<_>>().join(" | "))
    };
    let mut lines = vec![line(0), format!("| {} |", rule.join(" | "))];
    lines.extend((1..columns[0].len()).map(line));
    lines.join("\n")
}

fn missing(comparison: &Comparison) -> String {
    let absent = comparison.missing.iter();
    let absent = absent.map(|absent| format!("{} on {}", escaped(&absent.method), absent.pair));
    let list: Vec<String> = absent.collect();
    format!(
        "Not done: {}. The mean holds the methods that are done on every pair shown here.",
        list.join(", ")
    )
}

/// The methods that have a surface at some frames and none at others, if there are any.
fn vanished(comparison: &Comparison) -> Option<String> {
    let mut found = Vec::new();
    for pair in &comparison.pairs {
        for result in &pair.methods {
            if (1..result.frames).contains(&result.without_surface) {
                found.push(format!(
                    "{} on {} at {} of {} frames",
                    escaped(&result.run.method),
                    pair.pair,
                    result.without_surface,
                    result.frames
                ));
            }
        }
    }
    (!found.is_empty()).then(|| {
        format!(
            "The surface vanished, so that it has no mean: {}.",
            found.join(", ")
        )
    })
}

/// What each method was given: steps, points and networks, in one row for all pairs where it was the
/// same.
fn effort(comparison: &Comparison) -> String {
    let heads = [
        "method",
        "steps",
        "batch (points)",
        "networks (weights)",
        "pairs",
        "dates",
    ];
    let mut rows: Vec<Effort> = Vec::new();
    for pair in &comparison.pairs {
        for result in &pair.methods {
            let given = [
                escaped(&result.run.method),
                result.run.steps.to_string(),
                result.run.batch.to_string(),
                networks(&result.run.networks),
            ];
            // A day is enough here; the second is in the JSON.
            let day = result
                .run
                .date
                .split('T')
                .next()
                .unwrap_or_default()
                .to_owned();
            match rows.iter_mut().find(|row| row.given == given) {
                Some(row) => {
                    row.pairs.push(pair.pair.to_string());
                    row.days.insert(day);
                }
                None => rows.push(Effort {
                    given,
                    pairs: vec![pair.pair.to_string()],
                    days: BTreeSet::from([day]),
                }),
            }
        }
    }
    let mut columns: Vec<Vec<String>> = heads.iter().map(|head| vec![(*head).to_owned()]).collect();
    for row in rows {
        let days: Vec<String> = row.days.into_iter().collect();
        let when = [row.pairs.join(", "), days.join(", ")];
        for (column, cell) in columns.iter_mut().zip(row.given.into_iter().chain(when)) {
            column.push(cell);
        }
    }
    grid(&columns)
}

/// A row of what a method was given, and on which pairs and days.
struct Effort {
    given: [String; 4],
    pairs: Vec<String>,
    days: BTreeSet<String>,
}

fn networks(networks: &[Network]) -> String {
    if networks.is_empty() {
        return NOTHING.to_owned();
    }
    let named = networks
        .iter()
        .map(|network| format!("{} {}", escaped(&network.name), network.parameters));
    named.collect::<Vec<_>>().join(" + ")
}

/// Program, machines and commands, each once.
fn origin(comparison: &Comparison) -> String {
    let results = || comparison.pairs.iter().flat_map(|pair| &pair.methods);
    let distinct = |read: &dyn Fn(&MethodResult) -> String| -> Vec<String> {
        let all: BTreeSet<String> = results().map(read).collect();
        all.into_iter().collect()
    };
    let machines = distinct(&|result| escaped(&result.run.machine.to_string()));
    let commands = distinct(&|result| result.run.command.clone());
    format!(
        "isomorph {} on {}. Made by\n\n```text\n{}\n```",
        comparison.isomorph,
        machines.join("; on "),
        commands.join("\n").replace("```", "` ` `")
    )
}

/// Text that Markdown shows as it is, in one cell.
fn escaped(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for letter in text.chars() {
        // An underscore within a word is plain text in the Markdown of every common reader.
        if r"\|*`<>[]~".contains(letter) {
            shown.push('\\');
        }
        shown.push(if letter.is_control() { ' ' } else { letter });
    }
    shown
}

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
