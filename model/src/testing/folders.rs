//! The order of the folders of this crate, as `lib.rs` gives it: none uses one below it.

use std::fs;
use std::path::Path;

/// From the lowest to the highest; files of one row do not use each other.
const ORDER: [&[&str]; 6] = [
    &["autodiff", "linear"],
    &["nets"],
    &["operators"],
    &["loss", "objective"],
    &["flow"],
    &["baseline"],
];

fn row(name: &str) -> Option<usize> {
    ORDER.iter().position(|row| row.contains(&name))
}

/// What a file of row `own` uses that stands in no lower row, its tests left aside.
fn violations(text: &str, name: &str, own: usize) -> Vec<String> {
    let code = text.split("#[cfg(test)]").next().unwrap_or_default();
    let lines = code
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    let mut found = Vec::new();
    for line in lines {
        for used in line.split("crate::").skip(1) {
            let end = used.find(|c: char| !c.is_alphanumeric() && c != '_');
            let used = &used[..end.unwrap_or(used.len())];
            if used != name && row(used).is_none_or(|row| row >= own) {
                found.push(line.trim().to_owned());
            }
        }
    }
    found
}

fn check(path: &Path, name: &str, own: usize, found: &mut Vec<String>) {
    if path.file_stem().is_some_and(|stem| stem == "tests") {
        return;
    }
    if path.is_dir() {
        for entry in fs::read_dir(path).expect("a folder of the sources is readable") {
            let entry = entry.expect("its entries too").path();
            check(&entry, name, own, found);
        }
        return;
    }
    let text = fs::read_to_string(path).expect("a file of the sources is readable");
    let uses = violations(&text, name, own).into_iter();
    found.extend(uses.map(|line| format!("{}: {line}", path.display())));
}

#[test]
fn no_folder_uses_one_that_is_not_below_it() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    for (own, names) in ORDER.iter().enumerate() {
        for name in *names {
            let folder = source.join(name);
            let file = source.join(format!("{name}.rs"));
            let path = if folder.is_dir() { folder } else { file };
            check(&path, name, own, &mut found);
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn a_use_of_a_higher_folder_is_found() {
    let text =
        "use crate::nets::Mlp;\nuse crate::flow::Motion;\n#[cfg(test)]\nuse crate::baseline;";
    assert_eq!(
        violations(text, "operators", 2),
        ["use crate::flow::Motion;"]
    );
    assert!(violations(text, "baseline", 5).is_empty());
}
