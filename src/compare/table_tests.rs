//! Tests of the table: which rows, which cell is bold, what is marked.

use super::super::entry::Entry;
use super::super::testing::{ODD_LABEL, entry, two_pairs_of_three_methods};
use super::*;

/// The rows of the first table of a text, as trimmed cells; the head is row 0, the rule is left out.
fn rows(markdown: &str) -> Vec<Vec<String>> {
    let lines = markdown.lines().skip_while(|line| !line.starts_with('|'));
    let rows = lines.take_while(|line| line.starts_with('|'));
    rows.filter(|line| !line.contains("--:"))
        .map(|line| {
            // An escaped bar is part of its cell.
            let line = line.replace("\\|", "\u{1}");
            let cells = line.trim_matches('|').split(" | ");
            cells
                .map(|cell| cell.trim().replace('\u{1}', "\\|"))
                .collect()
        })
        .collect()
}

fn comparison() -> Comparison {
    let (plan, entries) = two_pairs_of_three_methods();
    Comparison::new(&plan, &entries)
}

#[test]
fn there_is_a_row_for_each_method_then_linear_then_floor() {
    let text = table(&comparison());
    let rows = rows(&text);
    let labels: Vec<&str> = rows.iter().map(|row| row[0].as_str()).collect();
    let odd = r#"a\|b/c \<d\> & "e""#;
    assert_eq!(
        labels,
        ["method", "quick", odd, "eigenbasis", "linear", "floor"]
    );
    assert!(rows.iter().all(|row| row.len() == COLUMNS.len() + 1));
    for title in [
        "## Mean over 2 pairs: 0-18, 20-47",
        "## Frames 0-18",
        "## Frames 20-47",
    ] {
        assert!(text.contains(title), "{title}");
    }
}

#[test]
fn the_bold_cell_is_the_best_of_its_column() {
    let comparison = comparison();
    let rows = rows(&table(&comparison));
    let methods = 1..=comparison.mean.len();
    for (place, column) in COLUMNS.iter().enumerate() {
        let cells: Vec<&str> = methods
            .clone()
            .map(|row| rows[row][place + 1].as_str())
            .collect();
        let number = |cell: &str| cell.trim_matches('*').parse::<f64>().ok();
        let shortfalls = cells.iter().filter_map(|cell| number(cell));
        let best = shortfalls
            .map(|value| column.goal.shortfall(value))
            .min_by(f64::total_cmp);
        for cell in cells {
            let is_best = number(cell).map(|value| column.goal.shortfall(value)) == best;
            let is_bold = cell.starts_with("**");
            assert_eq!(
                is_bold,
                best.is_some() && is_best,
                "{}: {cell}",
                column.head()
            );
        }
    }
}

#[test]
fn the_mean_is_the_mean_of_the_pairs() {
    let (plan, mut entries) = two_pairs_of_three_methods();
    // Half of 0.004 and half of 0.012, in thousandths: 2 and 6.
    entries[3] = entry(plan.pairs[1], "quick", Some(0.012), None);
    let rows = rows(&table(&Comparison::new(&plan, &entries)));
    assert_eq!(rows[0][1], "CD ×10³ ↓");
    assert_eq!(rows[1][1], "4.00");
}

#[test]
fn straight_lines_are_marked_where_they_beat_every_method_and_never_bold() {
    let rows = rows(&table(&comparison()));
    let linear = rows.iter().find(|row| row[0] == "linear").expect("a row");
    let cell = |head: &str| {
        let place = rows[0].iter().position(|cell| cell.starts_with(head));
        linear[place.expect(head)].as_str()
    };
    assert_eq!(cell("CD ×10³ ↓"), "0.500 †");
    // Made worse than every method there.
    assert_eq!(cell("normals"), "0.500");
    // Nobody trains straight lines.
    assert_eq!(cell("training"), NOTHING);
    let floor = rows.iter().find(|row| row[0] == "floor").expect("a row");
    for cell in linear.iter().chain(floor) {
        assert!(!cell.contains('*'), "{cell}");
    }
    assert!(floor.iter().all(|cell| !cell.contains('†')));
}

#[test]
fn values_that_look_the_same_win_together() {
    let (mut plan, _) = two_pairs_of_three_methods();
    plan.pairs.truncate(1);
    let entries = [
        entry(plan.pairs[0], "quick", Some(0.004), None),
        entry(plan.pairs[0], ODD_LABEL, Some(0.004_000_1), None),
    ];
    let text = table(&Comparison::new(&plan, &entries));
    let rows = rows(&text);
    assert_eq!(
        (rows[1][1].as_str(), rows[2][1].as_str()),
        ("**2.00**", "**2.00**")
    );
    assert!(!text.contains("## Mean over"), "one pair is its own mean");
}

#[test]
fn the_source_is_aligned() {
    let text = table(&comparison());
    for block in text.split("\n\n").filter(|block| block.starts_with('|')) {
        let widths: Vec<usize> = block.lines().map(|line| line.chars().count()).collect();
        assert!(widths.iter().all(|width| *width == widths[0]), "{block}");
    }
}

#[test]
fn what_is_missing_is_said_and_the_mean_leaves_the_method_out() {
    let (plan, mut entries) = two_pairs_of_three_methods();
    entries.remove(0);
    let text = table(&Comparison::new(&plan, &entries));
    assert!(text.contains("Not done: quick on 0-18."), "{text}");
    assert!(rows(&text).iter().all(|row| row[0] != "quick"));
}

#[test]
fn a_surface_that_vanished_at_some_frames_is_said_and_one_that_never_was_is_not() {
    let (plan, mut entries) = two_pairs_of_three_methods();
    let said = |entries: &[Entry]| {
        let text = table(&Comparison::new(&plan, entries));
        text.lines()
            .find(|line| line.starts_with("The surface vanished"))
            .map(str::to_owned)
    };
    assert_eq!(said(&entries), None, "eigenbasis never has one");
    entries[0].evaluation.frames[3].surface = None;
    let line = said(&entries).expect("a line");
    assert!(line.ends_with("quick on 0-18 at 1 of 17 frames."), "{line}");
}

#[test]
fn steps_networks_machine_date_and_command_are_there() {
    let text = table(&comparison());
    for expected in [
        "velocity 28515",
        " 1000 |",
        " 2200 |",
        "2 cores of Some CPU",
        "2026-03-01",
        "isomorph compare --sequence fox_survey.anime",
    ] {
        assert!(text.contains(expected), "{expected}");
    }
}

#[test]
fn a_method_has_one_row_of_effort_for_all_pairs_unless_it_differed() {
    let (plan, mut entries) = two_pairs_of_three_methods();
    let effort_rows = |entries: &[Entry]| {
        let text = table(&Comparison::new(&plan, entries));
        let (_, how) = text.split_once("## How").expect("the section");
        rows(how)
    };
    let same = effort_rows(&entries);
    assert_eq!(same.len(), 1 + 3, "a head and three methods");
    assert_eq!(same[1][4], "0-18, 20-47");
    entries[0].run.steps = 999;
    assert_eq!(effort_rows(&entries).len(), 1 + 4);
}

#[test]
fn a_metric_that_is_not_finite_is_shown_as_nothing_and_wins_nothing() {
    let (mut plan, _) = two_pairs_of_three_methods();
    plan.pairs.truncate(1);
    let entries = [
        entry(plan.pairs[0], "quick", Some(f64::NAN), None),
        entry(plan.pairs[0], ODD_LABEL, Some(0.004), None),
    ];
    let rows = rows(&table(&Comparison::new(&plan, &entries)));
    assert_eq!(
        (rows[1][1].as_str(), rows[2][1].as_str()),
        (NOTHING, "**2.00**")
    );
}
