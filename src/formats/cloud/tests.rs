//! Tests of the reader of clouds in text.

use super::*;
use crate::formats::malformed::written;

/// 64 points on a helix, each line made by `line` of its place and its direction.
pub(crate) fn helix(line: impl Fn([f64; 3], [f64; 3]) -> String) -> String {
    let point = |k: u32| {
        let (sine, cosine) = (f64::from(k) / 8.0).sin_cos();
        line([cosine, sine, f64::from(k)], [cosine, sine, 0.0]) + "\n"
    };
    (0..64).map(point).collect()
}

fn read(name: &str, text: &str) -> Result<Shape, ShapeError> {
    written(name, text.as_bytes(), crate::formats::read)
}

fn message(text: &str) -> String {
    read("a.xyz", text).expect_err("refused").to_string()
}

#[test]
fn points_come_through_any_separator_under_any_ending() {
    let right = read("a.xyz", &helix(|[x, y, z], _| format!("{x} {y} {z}")))
        .expect("read")
        .mesh;
    assert_eq!(
        (right.vertices.len(), right.vertices[8]),
        (64, [1f64.cos(), 1f64.sin(), 8.0])
    );
    let of = |name: &str, text: String| {
        assert_eq!(read(name, &text).expect("read").mesh, right, "{name}");
    };
    of("a.txt", helix(|[x, y, z], _| format!("\t{x}\t{y}  {z} ")));
    of("a.csv", helix(|[x, y, z], _| format!("{x}, {y},{z}")));
    of("a.CSV", helix(|[x, y, z], _| format!("{x};{y} ; {z};")));
    of(
        "a.csv",
        format!(
            "\u{feff}\"X\",\"Y\",\"Z\"\r\n{}",
            helix(|[x, y, z], _| format!("{x},{y},{z}"))
        ),
    );
    of(
        "a.csv",
        format!(
            "id,z,x,y\n{}",
            helix(|[x, y, z], _| format!("7,{z},{x},{y}"))
        ),
    );
    // ParaView names columns otherwise; the first three are the position.
    of(
        "a.csv",
        format!(
            "\"Points:0\",\"Points:1\",\"Points:2\"\n{}",
            helix(|[x, y, z], _| format!("{x},{y},{z}"))
        ),
    );
    of(
        "a.pts",
        format!("64\n{}", helix(|[x, y, z], _| format!("{x} {y} {z} -1203"))),
    );
    of(
        "a.asc",
        format!(
            "# a scan\n// more\n\n{}",
            helix(|[x, y, z], _| format!("{x} {y} {z}"))
        ),
    );
}

#[test]
fn six_columns_are_normals_if_negative_or_of_length_one_and_else_colours() {
    let shape = read(
        "a.xyzn",
        &helix(|[x, y, z], [a, b, c]| format!("{x} {y} {z} {a:.3} {b:.3} {c:.3}")),
    );
    let shape = shape.expect("read");
    assert!(shape.notes.is_empty());
    let normals = shape.mesh.normals.expect("normals");
    assert!(
        (f64::from(normals[8][0]) - 1f64.cos()).abs() < 1e-3,
        "{:?}",
        normals[8]
    );
    // MeshLab writes them so.
    let long = read(
        "a.xyz",
        &helix(|[x, y, z], [a, b, c]| format!("{x} {y} {z} {} {} {c}", 5.5 * a, 5.5 * b)),
    );
    let long = long.expect("read").mesh.normals.expect("normals");
    assert!((f64::from(long[8][0]) - 1f64.cos()).abs() < 1e-6);
    let coloured = read(
        "a.xyzrgb",
        &helix(|[x, y, z], _| format!("{x} {y} {z} 255 128 0")),
    )
    .expect("read");
    assert_eq!(coloured.mesh.normals, None);
    assert!(
        coloured.notes[0].contains("a.xyzrgb: columns 4 to 6 are never negative"),
        "{:?}",
        coloured.notes
    );
}

#[test]
fn nine_columns_have_both_in_either_order_and_names_decide() {
    // As CloudCompare writes them, as MeshLab does, and with an intensity between.
    for (header, line) in [
        ("//X Y Z R G B Nx Ny Nz\n", "P 0 51 255 N"),
        ("", "P 0 51 255 N"),
        ("", "P N 0 51 255"),
        ("64\n", "P -1203 0 51 255 N"),
        ("", "P N 0 0.2 1"),
    ] {
        let text = helix(|[x, y, z], [a, b, c]| {
            line.replace('P', &format!("{x} {y} {z}"))
                .replace('N', &format!("{a} {b} {c}"))
        });
        let cloud = written("a.txt", format!("{header}{text}").as_bytes(), |path| {
            Cloud::read(path)
        })
        .expect("read");
        let (normals, colours) = (
            cloud.normals.expect("normals"),
            cloud.colours.expect("colours"),
        );
        assert!(
            (f64::from(normals[8][1]) - 1f64.sin()).abs() < 1e-6,
            "{line}"
        );
        assert_eq!((colours[8], cloud.notes.len()), ([0.0, 0.2, 1.0, 1.0], 0));
    }
}

#[test]
fn malformed_lines_are_named() {
    let good = helix(|[x, y, z], _| format!("{x} {y} {z}"));
    assert!(
        message(&format!("{good}1 2\n"))
            .contains("a.xyz:65: \"1 2\": 2 columns, 3 in the lines before")
    );
    assert!(message(&format!("{good}1 2 x\n")).contains("a.xyz:65: \"x\" is not a number"));
    assert!(
        message("1,5;2,5;3,5\n")
            .contains("a.xyz:1: \"1,5\" is not a number; write decimals with a point")
    );
    assert!(message("1,,2\n").contains("a.xyz:1: \"\" is not a number"));
    assert!(message("1 2 3 4 5\n").contains("a.xyz:1: 5 columns: must be 3"));
    assert!(
        message(&format!("65\n{good}")).contains("a.xyz:1: 65 points are announced, but 64 follow")
    );
    assert!(message("18446744073709551615\n1 2 3\n").contains("but 1 follow"));
    assert!(message("# nothing\nx y z\n").contains("no points"));
    assert!(message("1 2 3\n4 5 6\n").contains("2 points, at least 64 needed"));
    assert!(message(&good.replace("1 0 0", "nan 0 0")).contains("63 points, at least 64 needed"));
}
