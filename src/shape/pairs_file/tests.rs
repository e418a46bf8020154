//! Tests of files of pairs.

use proptest::prelude::*;

use super::*;
use crate::formats::malformed::{damage, read_damaged, written};
use crate::formats::test_arrays::{npy, npz};
use crate::geometry::Mesh;

fn cloud(name: &str, count: usize) -> Shape {
    let vertices = (0..count).map(|i| [i as f64, 0.0, 0.0]).collect();
    Shape::at(Path::new(name), Mesh::new(vertices, Vec::new()))
}

fn read_as(name: &str, bytes: &[u8]) -> Result<Correspondences, ShapeError> {
    let read =
        |path: &Path| Correspondences::read(path, &cloud("a.ply", 100), &cloud("b.ply", 200));
    written(name, bytes, read)
}

fn read(text: &str) -> Result<Correspondences, ShapeError> {
    read_as("pairs.csv", text.as_bytes())
}

fn message(text: &str) -> String {
    read(text).expect_err("refused").to_string()
}

#[test]
fn names_comments_spaces_and_empty_lines_are_passed_over() {
    let text = "\u{feff}# made by hand\r\nsource, target\r\n 0 , 199 \r\n\r\n# more\r\n99,0\n0,199";
    assert_eq!(
        read(text).expect("read").pairs,
        [[0, 199], [99, 0], [0, 199]]
    );
}

#[test]
fn what_pandas_and_numpy_write_is_read() {
    let pairs = |text: &str| read(text).expect("read").pairs;
    assert_eq!(
        pairs(",source,target\n0,5,7\n1,0,199\n"),
        [[5, 7], [0, 199]]
    );
    assert_eq!(pairs("\"source\",\"target\"\n5,7\n"), [[5, 7]]);
    let of_numpy = "5.000000000000000000e+00 7.0\n0.0e+00 1.99e+02\n";
    assert_eq!(pairs(of_numpy), [[5, 7], [0, 199]]);
    assert!(message("5.5 7\n").contains(":1: \"5.5 7\": must be"));
    // Three names with one missing in the middle are no index.
    assert!(message("a,,b\n0,5,7\n").contains(":2: \"0,5,7\""));
}

#[test]
fn a_confidence_may_follow_and_is_checked() {
    let text = "source_index,target_index,confidence\n0,199,0.75\n1,2,1\n3,4\n5,6,0\n";
    let found = read(text).expect("read");
    assert_eq!(found.pairs, [[0, 199], [1, 2], [3, 4], [5, 6]]);
    assert_eq!(found.confidence, [0.75, 1.0, 1.0, 0.0]);
    assert!(read("0,199\n1,2\n").expect("read").confidence.is_empty());
}

#[test]
fn a_line_that_is_no_pair_is_named() {
    for bad in [
        "1",
        "1,2,-0.1",
        "1,2,nan",
        "1,2,0.5,0.5",
        "1,2,",
        "1 2 3 4",
        "1:2",
        "1,2,3",
        "1,-2",
        "1,2.5",
        "one,two",
        "99999999999999999999,1",
    ] {
        let text = message(&format!("0,0\n{bad}\n"));
        assert!(
            text.contains("pairs.csv:2: ") && text.contains(bad),
            "{text}"
        );
    }
    // Column names are allowed once.
    assert!(message("source,target\nsource,target\n").contains("pairs.csv:2: "));
}

#[test]
fn a_vertex_that_does_not_exist_is_named_with_its_shape_and_count() {
    let text = message("0,0\n\n100,5\n");
    assert!(text.contains("pairs.csv:3: vertex 100 of a.ply"), "{text}");
    assert!(text.contains("it has 100"), "{text}");
    assert!(message("5,201").contains("vertex 201 of b.ply"));
    assert!(message("0,0\n5,200").contains("vertex 200 of b.ply"));
}

#[test]
fn a_file_without_pairs_is_refused() {
    assert!(message("# none\nsource,target\n").contains("at least 1 needed"));
    assert!(message("").contains("empty"));
}

/// One line for each of 100 vertices, the target of each.
fn map(target: impl Fn(usize) -> i64) -> String {
    (0..100)
        .map(|source| format!("{}\n", target(source)))
        .collect()
}

#[test]
fn any_separator_serves() {
    let right = read("0,199\n99,0\n").expect("read");
    for text in [
        "0;199\n99;0\n",
        "0 199\n99\t0\n",
        "source target\n 0   199\r\n99 0",
    ] {
        assert_eq!(
            read_as("pairs.txt", text.as_bytes()).expect("read"),
            right,
            "{text}"
        );
    }
    let sure = read("0 199 0.5\n").expect("read");
    assert_eq!(sure.confidence, [0.5]);
}

#[test]
fn one_column_is_a_map_with_a_target_for_each_vertex_of_the_source() {
    let found = read_as("a.map", map(|source| 2 * source as i64).as_bytes()).expect("read");
    assert_eq!(
        (found.pairs.len(), found.pairs[99], found.notes.len()),
        (100, [99, 198], 0)
    );
    let some = read(&map(
        |source| if source < 40 { -1 } else { source as i64 - 40 },
    ))
    .expect("read");
    assert_eq!((some.pairs.len(), some.pairs[0]), (60, [40, 0]));
    assert!(
        some.notes[0].contains("40 of 100 vertices have no partner"),
        "{:?}",
        some.notes
    );
    assert!(
        message("1\n2\n")
            .contains("pairs.csv: a map of 2 vertices: must have one target for each of the 100")
    );
    assert!(message("1\n-2\n").contains("pairs.csv:2: \"-2\": must be the target's vertex"));
    assert!(message("1\n2,3\n").contains("pairs.csv:2: \"2,3\": must be the target's vertex"));
    assert!(message(&map(|_| -1)).contains("no correspondences"));
}

#[test]
fn vertices_counted_from_one_are_found_out_or_declared_and_said() {
    let found = read("100,1\n7,200\n").expect("read");
    assert_eq!(found.pairs, [[99, 0], [6, 199]]);
    assert!(
        found.notes[0].contains("taken as counted from 1"),
        "{:?}",
        found.notes
    );
    let found = read(&map(|source| source as i64 + 101)).expect("read");
    assert_eq!((found.pairs[0], found.pairs[99]), ([0, 100], [99, 199]));
    let declared = read("# counted from 1\n1,1\n").expect("read");
    assert_eq!(
        (&declared.pairs[..], declared.notes.len()),
        (&[[0, 0]][..], 0)
    );
    assert!(
        message("# counted from 1\n0,1\n")
            .contains("pairs.csv:2: vertex 0 of a.ply does not exist (it has 100: 1 to 100)")
    );
    assert!(
        message("# counted from 0\n1,200\n")
            .contains("vertex 200 of b.ply does not exist (it has 200: 0 to 199)")
    );
    let unsure = read(&map(|_| 5)).expect("read");
    assert_eq!(unsure.pairs[0], [0, 5]);
    assert!(
        unsure.notes[0].contains("# counted from 1"),
        "{:?}",
        unsure.notes
    );
    assert!(
        read("1,1\n").expect("read").notes.is_empty(),
        "a few pairs need not have a 0"
    );
}

#[test]
fn arrays_hold_pairs_or_a_map() {
    let whole = |all: &[i64]| {
        all.iter()
            .flat_map(|index| index.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let pairs = npy("<i8", false, "(2, 2)", &whole(&[0, 199, 99, 0]));
    let right = read("0,199\n99,0\n").expect("read");
    assert_eq!(read_as("pairs.npy", &pairs).expect("read"), right);
    let other = || npy("<f8", false, "(1,)", &[0; 8]);
    assert_eq!(
        read_as("a.npz", &npz(&[("x", other()), ("pairs", pairs)], true)).expect("read"),
        right
    );
    let targets: Vec<i64> = (0..100).collect();
    let map = read_as("map.npy", &npy("<i8", false, "(100,)", &whole(&targets))).expect("read");
    assert_eq!(map.pairs[42], [42, 42]);
    let floats = |all: &[f64]| {
        all.iter()
            .flat_map(|x| x.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let sure = read_as(
        "a.npy",
        &npy(
            "<f8",
            true,
            "(2, 3)",
            &floats(&[0.0, 99.0, 199.0, 0.0, 0.5, 1.0]),
        ),
    );
    let sure = sure.expect("read");
    assert_eq!((sure.pairs, sure.confidence), (right.pairs, vec![0.5, 1.0]));
    let refused = |shape: &str, all: &[f64]| {
        let file = npy("<f8", false, shape, &floats(all));
        read_as("a.npy", &file).expect_err("refused").to_string()
    };
    assert!(refused("(1, 2)", &[0.0, 0.5]).contains("a.npy: row 0 is [0.0, 0.5]: must be"));
    assert!(refused("(1, 2)", &[0.0, 200.0]).contains("a.npy: row 0: vertex 200 of b.ply"));
    assert!(refused("(1, 4)", &[0.0; 4]).contains("shape (1, 4): must be"));
    let unnamed = npz(&[("x", other()), ("y", other())], false);
    assert!(
        read_as("a.npz", &unnamed)
            .expect_err("refused")
            .to_string()
            .contains("(it has: x, y)")
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..Default::default() })]

    #[test]
    fn damaged_correspondences_are_read_or_refused(damage in damage()) {
        let vertices = (0..100).map(|i| [f64::from(i); 3]).collect();
        let shape = Shape::at(Path::new("shape.ply"), Mesh::new(vertices, Vec::new()));
        let bytes = b"# pairs\nsource,target\n0,1\n 2 , 3\n99,99\n".to_vec();
        let read = |path: &Path| Correspondences::read(path, &shape, &shape);
        let (result, _) = read_damaged("shape.csv", bytes, &damage, read);
        match result {
            Ok(found) => {
                prop_assert!(!found.pairs.is_empty());
                prop_assert!(found.pairs.iter().flatten().all(|&index| index < 100));
            }
            Err(error) => prop_assert!(!error.to_string().contains('\n'), "{}", error),
        }
    }

    #[test]
    fn a_damaged_map_is_read_or_refused(damage in damage()) {
        let vertices = (0..9).map(|i| [f64::from(i); 3]).collect();
        let shape = Shape::at(Path::new("shape.ply"), Mesh::new(vertices, Vec::new()));
        let read = |path: &Path| Correspondences::read(path, &shape, &shape);
        let bytes = b"# counted from 1\n1\n2\n3\n4\n5\n6\n7\n8\n9\n".to_vec();
        match read_damaged("shape.txt", bytes, &damage, read).0 {
            Ok(found) => prop_assert!(found.pairs.iter().flatten().all(|&index| index < 9)),
            Err(error) => prop_assert!(!error.to_string().contains('\n'), "{}", error),
        }
    }
}

/// Places of which none is near the next one in the order of the list.
fn scattered() -> Vec<[f64; 3]> {
    // Not a lattice, in which a step in the list is the same step in space everywhere.
    let part = |k: usize, by: f64| ((k as f64 * by).sin() * 43_758.5).fract().abs();
    (0..300)
        .map(|k| [part(k, 12.9898), part(k, 78.233), part(k, 37.719)])
        .collect()
}

#[test]
fn a_part_of_the_vertices_counted_from_one_is_found_out_by_what_is_near_what() {
    // The target lists the places backwards, moved and a little bent.
    let places = scattered();
    let bent = |[x, y, z]: &[f64; 3]| [x + 2.0, y + 0.1 * x * x, *z];
    let shape = |name: &str, places: Vec<[f64; 3]>| {
        Shape::at(Path::new(name), Mesh::new(places, Vec::new()))
    };
    let [a, b] = [
        shape("a.ply", places.clone()),
        shape("b.ply", places.iter().rev().map(bent).collect()),
    ];
    let read = |first: usize, more: &str| {
        let rows = (20..120).map(|k| format!("{},{}\n", k + first, 299 - k + first));
        let text = format!("{more}{}", rows.collect::<String>());
        let read = |path: &Path| Correspondences::read(path, &a, &b);
        written("pairs.csv", text.as_bytes(), read).expect("read")
    };
    let found = read(1, "");
    assert_eq!((found.pairs[0], found.pairs.len()), ([20, 279], 100));
    assert!(
        found.notes[0].contains("taken as counted from 1"),
        "{:?}",
        found.notes
    );
    for (first, more) in [
        (0, ""),
        (0, "# counted from 0\n"),
        (1, "# counted from 1\n"),
    ] {
        let found = read(first, more);
        assert_eq!(found.pairs[0], [20, 279]);
        assert!(found.notes.is_empty(), "{:?}", found.notes);
    }
    // Wrong either way: nothing is decided.
    assert_eq!(read(3, "").pairs[0], [23, 282]);
    // One vertex again and again: nothing to compare.
    let again = "5,6\n".repeat(200);
    let read = |path: &Path| Correspondences::read(path, &a, &b);
    let found = written("pairs.csv", again.as_bytes(), read).expect("read");
    assert_eq!(found.pairs[0], [5, 6]);
}
