//! Points that are known in many key frames: a column for each key frame.

use super::{Array, Heading, Layout, lines, whole_number};

/// What a line must be.
pub(super) const ALLOWED: &str =
    "must be a vertex in each key frame, whole numbers from 0, or -1 where the point is not known";

/// Two neighbouring columns of so many.
#[derive(Clone, Copy)]
pub(super) struct Columns {
    first: usize,
    pub of: usize,
}

/// The columns that count if a file has one for each key frame; of the rows, `rows` gives how many columns they have,
/// and whether any has a third number that no confidence is.
pub(super) fn columns(layout: Layout, rows: impl FnOnce() -> (usize, bool)) -> Option<Columns> {
    let Layout::Tracks { k, key_frames } = layout else {
        return None;
    };
    if key_frames.iter().all(|count| *count < 3) {
        return None;
    }
    let (width, is_no_confidence) = rows();
    let is_one_for_each =
        key_frames.contains(&width) && (width > 3 || width == 3 && is_no_confidence);
    is_one_for_each.then_some(Columns {
        first: k,
        of: width,
    })
}

/// Of text: the columns of its first line of numbers, and whether any line has a third one that no confidence is.
pub(super) fn rows_of_text(bytes: &[u8]) -> (usize, bool) {
    let (mut width, mut found, mut heading) = (0, false, Heading::default());
    for (_, line) in lines(bytes).filter(|(_, line)| !line.starts_with('#')) {
        let Some(fields) = heading.fields_below(&line) else {
            continue;
        };
        if width == 0 {
            width = fields.len();
        }
        let third = fields.get(2).and_then(|third| third.parse::<f64>().ok());
        found |= third.is_some_and(|third| !(0.0..=1.0).contains(&third));
    }
    (width, found)
}

/// The same of an array.
pub(super) fn rows_of_array(array: &Array) -> (usize, bool) {
    match array.shape[..] {
        [_, width] if width > 0 => {
            let mut thirds = array
                .values
                .chunks_exact(width)
                .filter_map(|row| row.get(2));
            (width, thirds.any(|third| !(0.0..=1.0).contains(third)))
        }
        _ => (0, false),
    }
}

/// The two vertices of a line; nothing if a field is none.
pub(super) fn of_fields(fields: &[&str], columns: Columns) -> Option<[Option<u64>; 2]> {
    if fields.len() != columns.of {
        return None;
    }
    let vertex = |field: &str| {
        if field.is_empty() || field.eq_ignore_ascii_case("nan") {
            return Some(None);
        }
        index(whole_number(field)?)
    };
    // All of them, so that a mistake is not found for one key frame only.
    let all: Option<Vec<_>> = fields.iter().copied().map(vertex).collect();
    let all = all?;
    Some([all[columns.first], all[columns.first + 1]])
}

/// The two vertices of a row.
pub(super) fn of_numbers(row: &[f64], columns: Columns) -> Option<[Option<u64>; 2]> {
    let vertex = |number: f64| {
        if number.is_nan() {
            return Some(None);
        }
        // Beyond 2^53 numbers are not exact, and no shape has so many vertices.
        let whole = number.fract() == 0.0 && number.abs() < 9e15;
        index(whole.then_some(number as i64)?)
    };
    let all: Option<Vec<_>> = row.iter().copied().map(vertex).collect();
    let all = all?;
    Some([all[columns.first], all[columns.first + 1]])
}

/// A vertex, or none for -1; nothing for other negative numbers.
fn index(number: i64) -> Option<Option<u64>> {
    match number {
        -1 => Some(None),
        number => u64::try_from(number).ok().map(Some),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::formats::Shape;
    use crate::geometry::Mesh;
    use crate::shape::Correspondences;

    fn shapes(counts: &[usize]) -> Vec<Shape> {
        let cloud = |count: &usize| {
            let vertices = (0..*count).map(|i| [i as f64, 0.0, 0.0]).collect();
            Shape::at(Path::new("a.ply"), Mesh::new(vertices, Vec::new()))
        };
        counts.iter().map(cloud).collect()
    }

    /// The pairs of each interval, or the message.
    fn read(text: &str, counts: &[usize]) -> Vec<Result<Vec<[u32; 2]>, String>> {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("tracks.csv");
        std::fs::write(&path, text).expect("a file");
        let shapes = shapes(counts);
        let between = |k: usize| {
            let two = [&shapes[k], &shapes[k + 1]];
            let found = Correspondences::read_between(&path, k, [counts.len(); 2], two);
            found
                .map(|found| found.pairs)
                .map_err(|error| error.to_string())
        };
        (0..counts.len() - 1).map(between).collect()
    }

    #[test]
    fn each_line_is_a_point_and_each_column_a_key_frame() {
        let text = "a,b,c,d\n# a comment\n0,1,2,3\n4,-1,5,6\n7,8,,nan\n";
        let found = read(text, &[9, 9, 9, 9]);
        let wanted = [vec![[0, 1], [7, 8]], vec![[1, 2]], vec![[2, 3], [5, 6]]];
        assert_eq!(found, wanted.clone().map(Ok));
        // With an index, as pandas writes it.
        let text = ",a,b,c,d\n0,0,1,2,3\n1,4,-1,5,6\n2,7,8,,nan\n";
        assert_eq!(read(text, &[9, 9, 9, 9]), wanted.map(Ok));
    }

    #[test]
    fn a_table_is_of_all_key_frames_or_of_those_before_others_were_appended() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("tracks.csv");
        let shapes = shapes(&[9; 2]);
        let two = [&shapes[0], &shapes[1]];
        for text in ["a,b,c,d\n0,1,2,3\n", "a,b,c\n0,1,2\n"] {
            std::fs::write(&path, text).expect("a file");
            let found = Correspondences::read_between(&path, 0, [4, 3], two);
            assert_eq!(found.expect("a table").pairs, [[0, 1]], "{text}");
        }
    }

    #[test]
    fn three_columns_are_three_key_frames_unless_the_third_is_a_confidence() {
        let found = read("0,1,2\n3,4,0\n", &[5, 5, 5]);
        assert_eq!(found, [Ok(vec![[0, 1], [3, 4]]), Ok(vec![[1, 2], [4, 0]])]);
        // Pairs, the same between any two.
        let found = read("0,1,0.5\n3,4,1\n", &[5, 5, 5]);
        assert_eq!(found, [Ok(vec![[0, 1], [3, 4]]), Ok(vec![[0, 1], [3, 4]])]);
        let found = read("0 1\n3 4\n", &[5, 5, 5]);
        assert_eq!(found[1], Ok(vec![[0, 1], [3, 4]]));
    }

    #[test]
    fn a_line_that_is_none_is_named_and_so_is_a_vertex_that_does_not_exist() {
        for (text, said) in [
            ("0,1,2,3\n0,1,2\n", "tracks.csv:2"),
            ("0,1,2,3\n0,1,2,-2\n", "tracks.csv:2"),
            ("0,1,2,3\n0,1,2.5,3\n", "tracks.csv:2"),
            ("0,9,2,3\n", "vertex 9 of a.ply does not exist"),
        ] {
            let error = read(text, &[5, 5, 5, 5]).remove(0).expect_err(said);
            assert!(error.contains(said), "{error}");
        }
        // No point is known in both.
        let none = read("0,-1,2,3\n", &[5, 5, 5, 5]);
        assert!(none[0].is_err() && none[2].is_ok(), "{none:?}");
    }

    #[test]
    fn arrays_have_the_same_columns() {
        let array = Array {
            shape: vec![2, 4],
            values: vec![0.0, 1.0, f64::NAN, 3.0, 2.0, -1.0, 4.0, 5.0],
        };
        let layout = Layout::Tracks {
            k: 0,
            key_frames: [4; 2],
        };
        let columns = columns(layout, || rows_of_array(&array)).expect("one for each");
        let rows = array.values.chunks_exact(4);
        let found: Vec<_> = rows.map(|row| of_numbers(row, columns)).collect();
        assert_eq!(found, [Some([Some(0), Some(1)]), Some([Some(2), None])]);
        assert!(of_numbers(&[0.5, 1.0, 2.0, 3.0], columns).is_none());
    }
}
