//! What the page of a run shows, and the page itself.

use std::collections::BTreeMap;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::block::Block;
use crate::geometry::{Bounds, Mesh};

/// All that a page shows. Positions are normalised.
pub(crate) struct Page {
    /// The name of the run.
    pub title: String,
    /// A line under it.
    pub subtitle: String,
    /// When it was made.
    pub date: String,
    /// How long one unit of normalised length is in the unit of the shapes.
    pub unit: f64,
    /// The times of the first and the last shape, in the run's own unit; all others here are from 0 to 1.
    pub clock: [f64; 2],
    /// The times of the key frames, where there are more than two.
    pub keys: Vec<f64>,
    /// A box around everything.
    pub bounds: Bounds,
    /// The shape at time 0.
    pub source: End,
    /// The shape at time 1.
    pub target: End,
    /// The source as the motion carries it, if something moves points.
    pub carried: Option<Track>,
    /// The surfaces that were found, in the order of their times.
    pub surfaces: Vec<Track>,
    /// Points of the source and of the target that are known to correspond.
    pub pairs: Vec<[[f32; 3]; 2]>,
    /// Measures of the surfaces, in the same order.
    pub quality: Vec<Quality>,
    /// Logged steps.
    pub steps: Vec<usize>,
    /// The terms of the objective at these steps, by name, as they add up; `null` where one took no part.
    pub series: BTreeMap<String, Vec<Option<f64>>>,
    /// The recipe.
    pub recipe: String,
    /// Notes and warnings.
    pub notes: Vec<String>,
    /// What is shown with fewer points than it has, in words.
    pub thinned: Vec<String>,
    /// Seconds until it loads itself again, of a run in training.
    pub reloaded: Option<u32>,
}

/// One of the two shapes.
pub(crate) struct End {
    /// The name of its file.
    pub name: String,
    /// Its mesh, or its points.
    pub mesh: Mesh<f32>,
}

/// A mesh, or points, at several times.
pub(crate) struct Track {
    /// The time that it was found at; of the carried source 0.
    pub time: f64,
    /// The times, ascending.
    pub times: Vec<f64>,
    /// Positions at each of the times.
    pub frames: Vec<Vec<[f32; 3]>>,
    /// Triangles; none for points.
    pub triangles: Vec<[u32; 3]>,
    /// Values of the vertices that do not change with the times.
    pub values: Values,
}

/// Values of vertices by the name that the page's program has for them: `truth`, `consistency` and `round_trip`,
/// each a normalised length.
pub(crate) type Values = Vec<(&'static str, Vec<f32>)>;

/// The measures of a surface, as `frames.json` has them.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Quality {
    /// Its time, in the run's own unit.
    pub time: f64,
    /// Its triangles, all of them.
    pub triangles: usize,
    /// Its connected pieces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub components: Option<usize>,
    /// How far it is from the surfaces of the ends carried to its time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub consistency: Option<f64>,
    /// How far its points miss themselves that are carried to an end and back.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub round_trip: Option<f64>,
    /// How far its field is from a distance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slope_error: Option<f64>,
    /// The mean distance to the true shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<f64>,
}

const TEMPLATE: &str = include_str!("web/page.html");
pub(super) const STYLE: &str = include_str!("web/style.css");
pub(super) const PROGRAM: &str = include_str!("assets/viewer.js");

impl Page {
    /// The page, one file that loads nothing.
    pub(crate) fn html(&self) -> String {
        let mut block = Block::new(&self.bounds);
        // A tag in a name or a note must not end the script that holds the data.
        let run = self
            .described(&mut block)
            .to_string()
            .replace('<', "\\u003c");
        let bytes = STANDARD.encode(block.bytes());
        let title = escaped(&self.title);
        let html = filled(
            TEMPLATE,
            &[
                ("TITLE", &title),
                ("STYLE", STYLE),
                ("RUN", &run),
                ("BYTES", &bytes),
                ("PROGRAM", PROGRAM),
            ],
        );
        match self.reloaded {
            None => html,
            Some(seconds) => {
                let tag = format!("<meta http-equiv=\"refresh\" content=\"{seconds}\">\n<title>");
                html.replacen("<title>", &tag, 1)
            }
        }
    }

    /// All but the arrays, and where these lie.
    fn described(&self, block: &mut Block) -> Value {
        let sides = [0, 1, 2].map(|k| self.bounds.max[k] - self.bounds.min[k]);
        // Lengths in the unit of the shapes: the page shows no others.
        let own = |length: f32| f64::from(length) * self.unit;
        let surfaces: Vec<Value> = (self.surfaces.iter())
            .map(|track| self.track(track, block))
            .collect();
        json!({
            "title": self.title,
            "subtitle": self.subtitle,
            "date": self.date,
            "version": env!("CARGO_PKG_VERSION"),
            "box": {"sides": sides.map(own), "span": own(block.span())},
            "clock": self.clock,
            "keys": self.keys,
            "source": end(&self.source, block),
            "target": end(&self.target, block),
            "carried": self.carried.as_ref().map(|track| self.track(track, block)),
            "moves": self.carried.is_some(),
            "surfaces": surfaces,
            "pairs": match self.pairs.is_empty() {
                true => Value::Null,
                false => block.positions(self.pairs.iter().flatten()),
            },
            "quality": self.quality,
            "training": {"steps": self.steps, "series": self.series},
            "recipe": self.recipe,
            "notes": self.notes,
            "thinned": self.thinned,
        })
    }

    fn track(&self, track: &Track, block: &mut Block) -> Value {
        let mut values = Map::new();
        for (name, of) in &track.values {
            let own: Vec<f32> = of
                .iter()
                .map(|x| (f64::from(*x) * self.unit) as f32)
                .collect();
            values.insert((*name).to_owned(), block.values(&own));
        }
        let vertices = track.frames.first().map_or(0, Vec::len);
        json!({
            "time": track.time,
            "times": track.times,
            "positions": block.positions(track.frames.iter().flatten()),
            "triangles": block.triangles(&track.triangles, vertices),
            "values": values,
        })
    }
}

fn end(end: &End, block: &mut Block) -> Value {
    let mesh = &end.mesh;
    json!({
        "name": end.name,
        "positions": block.positions(&mesh.vertices),
        "triangles": block.triangles(&mesh.triangles, mesh.vertices.len()),
    })
}

/// Text that HTML shows as it is.
pub(super) fn escaped(text: &str) -> String {
    let escapes = [
        ("&", "&amp;"),
        ("<", "&lt;"),
        (">", "&gt;"),
        ("\"", "&quot;"),
    ];
    escapes
        .iter()
        .fold(text.to_owned(), |text, (from, to)| text.replace(from, to))
}

/// A template with `{{NAME}}` replaced; what comes in is not looked at again.
pub(super) fn filled(template: &str, values: &[(&str, &str)]) -> String {
    let length: usize = values.iter().map(|(_, value)| value.len()).sum();
    let mut out = String::with_capacity(template.len() + length);
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        out.push_str(before);
        let value = values.iter().find(|(known, _)| *known == name);
        out.push_str(value.map_or("", |(_, value)| value));
        rest = after;
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(z: f32) -> Vec<[f32; 3]> {
        vec![[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]]
    }

    fn page() -> Page {
        let end = |z| End {
            name: "a</script>.ply".to_owned(),
            mesh: Mesh::new(triangle(z), vec![[0, 1, 2]]),
        };
        let track = |values| Track {
            time: 0.0,
            times: vec![0.0, 1.0],
            frames: vec![triangle(0.0), triangle(0.5)],
            triangles: vec![[0, 1, 2]],
            values,
        };
        Page {
            title: "fox <quick> & {{RUN}}".to_owned(),
            subtitle: String::new(),
            date: "2026-11-27".to_owned(),
            unit: 2.0,
            clock: [0.0, 1.0],
            keys: Vec::new(),
            bounds: Bounds {
                min: [0.0; 3],
                max: [1.0, 1.0, 0.5],
            },
            source: end(0.0),
            target: end(0.5),
            carried: Some(track(Vec::new())),
            surfaces: vec![track(vec![("consistency", vec![0.0, 0.125, 0.25])])],
            pairs: vec![[[0.0; 3], [0.0, 0.0, 0.5]]],
            quality: vec![Quality::default()],
            steps: vec![1, 2],
            series: BTreeMap::from([("total".to_owned(), vec![Some(1.0), None])]),
            recipe: "preset = \"instant\"".to_owned(),
            notes: vec!["no <normals>".to_owned()],
            thinned: Vec::new(),
            reloaded: None,
        }
    }

    fn between<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
        let (_, rest) = text.split_once(from).expect(from);
        rest.split_once(to).expect(to).0
    }

    #[test]
    fn a_page_holds_its_data_and_loads_nothing() {
        let html = page().html();
        assert!(html.contains("<title>fox &lt;quick&gt; &amp; {{RUN}}</title>"));
        assert!(!html.contains("http-equiv=\"refresh\""));
        let reloaded = Some(10);
        let html = Page { reloaded, ..page() }.html();
        assert!(html.contains("<meta http-equiv=\"refresh\" content=\"10\">"));
        for loaded in ["src=\"", "href=\"", "@import", "url("] {
            let own = html.replace(PROGRAM, "");
            assert!(!own.contains(loaded), "{loaded}");
        }
        let text = between(&html, "id=\"run\">", "</script>");
        let run: Value = serde_json::from_str(text).expect("JSON");
        assert_eq!(run["source"]["name"], json!("a</script>.ply"));
        assert_eq!(run["box"]["span"], json!(2.0), "in the unit of the shapes");
        let values = &run["surfaces"][0]["values"]["consistency"];
        assert_eq!(values["most"], json!(0.5));
        let bytes = between(&html, "id=\"bytes\">", "</script>");
        let bytes = STANDARD.decode(bytes).expect("base64");
        let place = &run["carried"]["positions"];
        assert_eq!(place["count"], json!(18), "two times three vertices");
        let at = place["at"].as_u64().expect("a place") as usize;
        // The third coordinate of the fourth vertex: half of the box's longest side.
        let last = &bytes[at + 2 * 11..at + 2 * 12];
        assert_eq!(u16::from_le_bytes([last[0], last[1]]), 32768);
        assert!(bytes.len() >= at + 36);
    }

    #[test]
    fn what_is_filled_in_is_not_filled_again() {
        let values = [("A", "{{B}}"), ("B", "two")];
        assert_eq!(filled("1 {{A}} {{B}} {{C}} 3", &values), "1 {{B}} two  3");
    }
}
