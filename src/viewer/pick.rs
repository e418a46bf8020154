//! The page on which pairs of vertices are picked: two shapes side by side, every vertex of both.
//!
//! Each shape is drawn in a box of its own, whose longest side is 1. Nothing is thinned: a click names a vertex of the
//! file by its number. Positions are rounded to 1/65535 of the box, which moves no vertex by as much as a pixel.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use super::block::Block;
use super::page::{PROGRAM, STYLE, escaped, filled};
use crate::geometry::{Bounds, Mesh};

/// What the page shows.
pub(crate) struct PickPage<'a> {
    /// The names of both files, source first.
    pub names: [String; 2],
    /// Both shapes in the coordinates of their files.
    pub meshes: [&'a Mesh<f64>; 2],
    /// The name of the file that pairs are saved as.
    pub output: String,
    /// The text of a pairs file to begin with.
    pub given: Option<String>,
    /// Whether the page can save through the address that it comes from; a file offers a download instead.
    pub served: bool,
}

const TEMPLATE: &str = include_str!("web/pick.html");
const OWN_STYLE: &str = include_str!("web/pick.css");

impl PickPage<'_> {
    /// The page, one file that loads nothing.
    pub(crate) fn html(&self) -> String {
        let mut block = Block::new(&Bounds {
            min: [0.0; 3],
            max: [1.0; 3],
        });
        let [source, target] = [0, 1].map(|side| self.shape(side, &mut block));
        let described = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "source": source,
            "target": target,
            "output": self.output,
            "given": self.given,
            "served": self.served,
        });
        // A tag in a name or a file must not end the script that holds the data.
        let described = described.to_string().replace('<', "\\u003c");
        let title = escaped(&format!("Pairs: {} and {}", self.names[0], self.names[1]));
        // What the page may send goes to where it comes from, and a file sends nothing.
        let connect = if self.served { "'self'" } else { "'none'" };
        filled(
            TEMPLATE,
            &[
                ("TITLE", &title),
                ("CONNECT", connect),
                ("STYLE", STYLE),
                ("OWN_STYLE", OWN_STYLE),
                ("SHAPES", &described),
                ("BYTES", &STANDARD.encode(block.bytes())),
                ("PROGRAM", PROGRAM),
            ],
        )
    }

    fn shape(&self, side: usize, block: &mut Block) -> Value {
        let mesh = self.meshes[side];
        let (places, sides) = boxed(&mesh.vertices);
        json!({
            "name": self.names[side],
            "sides": sides,
            "positions": block.positions(&places),
            "triangles": block.triangles(&mesh.triangles, mesh.vertices.len()),
        })
    }
}

/// Places as shares of the longest side of the box around them, from its lower end, and the sides of the box alike.
/// Float64 until then, so that coordinates far from the origin keep their differences.
fn boxed(vertices: &[[f64; 3]]) -> (Vec<[f32; 3]>, [f64; 3]) {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for x in vertices {
        for k in 0..3 {
            low[k] = low[k].min(x[k]);
            high[k] = high[k].max(x[k]);
        }
    }
    let sides = [0, 1, 2].map(|k| high[k] - low[k]);
    let longest = sides.into_iter().fold(0.0, f64::max);
    let span = if longest > 0.0 { longest } else { 1.0 };
    let place = |x: &[f64; 3]| [0, 1, 2].map(|k| ((x[k] - low[k]) / span) as f32);
    (
        vertices.iter().map(place).collect(),
        sides.map(|side| side / span),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(mesh: &Mesh<f64>, served: bool) -> String {
        PickPage {
            names: ["a</script>.ply", "b.ply"].map(str::to_owned),
            meshes: [mesh, mesh],
            output: "pairs.csv".to_owned(),
            given: Some("# <b>\n0,1\n".to_owned()),
            served,
        }
        .html()
    }

    #[test]
    fn a_page_holds_every_vertex_loads_nothing_and_sends_only_where_it_comes_from() {
        // Far from the origin, where float32 has steps of 1/16.
        let at = |x: f64, y: f64| [1e6 + x, -1e6 + y, 5e5];
        let mesh = Mesh::new(
            vec![at(0.0, 0.0), at(0.02, 0.0), at(0.0, 0.01)],
            vec![[0, 1, 2]],
        );
        let html = page(&mesh, true);
        for loaded in ["src=\"", "href=\"", "@import", "url("] {
            assert!(!html.contains(loaded), "{loaded}");
        }
        assert!(html.contains("connect-src 'self'"));
        assert!(page(&mesh, false).contains("connect-src 'none'"));
        let (_, rest) = html.split_once("id=\"shapes\">").expect("data");
        let (text, rest) = rest.split_once("</script>").expect("its end");
        let found: Value = serde_json::from_str(text).expect("JSON");
        assert_eq!(found["source"]["name"], "a</script>.ply");
        assert_eq!(found["given"], "# <b>\n0,1\n");
        assert_eq!(found["target"]["positions"]["count"], 9);
        let (_, rest) = rest.split_once("id=\"bytes\">").expect("bytes");
        let (bytes, _) = rest.split_once("</script>").expect("their end");
        let bytes = STANDARD.decode(bytes).expect("base64");
        let whole: Vec<u16> = (bytes[..18].as_chunks::<2>().0.iter())
            .map(|pair| u16::from_le_bytes(*pair))
            .collect();
        // Differences of .01 at a million are exact to 1e-10, here 1e-8 of the box.
        assert_eq!(whole, [0, 0, 0, 65535, 0, 0, 0, 32768, 0]);
    }

    #[test]
    fn what_has_no_extent_lies_at_the_lower_end() {
        let (places, sides) = boxed(&[[3.0, 4.0, 5.0]; 2]);
        assert_eq!(places, [[0.0; 3]; 2]);
        assert_eq!(sides, [0.0; 3]);
    }
}
