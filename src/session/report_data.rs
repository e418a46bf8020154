//! What the page of a run shows, gathered: surfaces over time, the source that the motion carries, pairs, measures.

use isomorph_training::method::spec_of;

use super::extract::even_times;
use super::prepare;
use super::report_log::{notes_of, series};
use super::report_truth::TrueShapes;
use super::trained::Trained;
use crate::error::Result;
use crate::formats::Shape;
use crate::geometry::{Bounds, Mesh, NeighbourSearch};
use crate::recipe;
use crate::shape::Correspondences;
use crate::surface::frames::Frame;
use crate::surface::learned::Learned;
use crate::viewer::{End, Page, Quality, Thinned, Track, Values, thinned, thinned_cloud};

/// Vertices of the carried source, and of each of the two shapes.
const VERTICES: usize = 10_000;

/// Times at which the carried source is shown.
const TIMES: usize = 25;

/// The same for each interval of many key frames, and at most in all.
const TIMES_OF_INTERVAL: usize = 6;
const MOST_TIMES: usize = 73;

/// Bytes of all surfaces over time, before base64.
const SURFACE_BYTES: usize = 1_800_000;

/// Vertices of one surface at most, and at least.
const SURFACE_VERTICES: [usize; 2] = [1000, 8000];

/// Points of a surface whose trust is computed, and which stand for their neighbours.
const TRUSTED: usize = 1500;

/// Pairs that are shown.
const PAIRS: usize = 800;

/// What a page shows of a run.
pub(super) struct ReportData<'a> {
    trained: &'a Trained,
    shapes: Vec<Shape>,
    ends: [End; 2],
    carried: Option<Track>,
    surfaces: Vec<Track>,
    quality: Vec<Quality>,
    pairs: Vec<[[f32; 3]; 2]>,
    notes: Vec<String>,
    thinned: Vec<String>,
}

impl<'a> ReportData<'a> {
    /// Gathers everything; the surfaces are `frames`.
    ///
    /// # Errors
    /// Shapes that cannot be read.
    pub(super) fn gather(
        trained: &'a Trained,
        mut frames: Vec<Frame>,
        truth: Option<&TrueShapes>,
    ) -> Result<Self> {
        let shapes = prepare::read(trained.recipe())?;
        let mut data = Self {
            trained,
            ends: [0, shapes.len() - 1].map(|k| End {
                name: name_of(&shapes[k]),
                mesh: Mesh::default(),
            }),
            shapes,
            carried: None,
            surfaces: Vec::new(),
            quality: Vec::new(),
            pairs: Vec::new(),
            notes: notes_of(trained),
            thinned: Vec::new(),
        };
        if !trained.learned().coordinates.placements.is_empty() {
            let text = "this page shows the shapes as they lie on each other, in the coordinates of the first file";
            data.notes.push(text.to_owned());
        }
        data.add_ends()?;
        frames.sort_by(|a, b| a.time.total_cmp(&b.time));
        data.add_surfaces(&frames, truth)?;
        data.add_pairs();
        Ok(data)
    }

    fn learned(&self) -> &'a Learned {
        self.trained.learned()
    }

    fn moves(&self) -> bool {
        self.learned().deformation.motion().is_some()
    }

    /// The two shapes, and the source as the motion carries it.
    fn add_ends(&mut self) -> Result<()> {
        let last = self.shapes.len() - 1;
        for (end, (k, word)) in [(0, "source"), (last, "target")].into_iter().enumerate() {
            let time = if k == 0 { 0.0 } else { 1.0 };
            let place = self.learned().coordinates.at(time);
            let mesh = self.shapes[k].mesh.moved(|x| place.apply(x));
            let count = mesh.vertices.len();
            let Thinned { mesh, chosen } = shown(&mesh);
            if chosen.len() < count {
                let text = format!("{word}, {} of {count} points", chosen.len());
                self.thinned.push(text);
            }
            if end == 0 && self.moves() {
                let start: Vec<[f32; 3]> = (chosen.iter())
                    .map(|k| place.apply(self.shapes[0].mesh.vertices[*k as usize]))
                    .collect();
                let intervals = self.shapes.len() - 1;
                let times =
                    even_times((TIMES_OF_INTERVAL * intervals + 1).clamp(TIMES, MOST_TIMES));
                self.carried = Some(Track {
                    time: 0.0,
                    frames: self.learned().path(&start, &times)?,
                    times,
                    triangles: mesh.triangles.clone(),
                    values: Vec::new(),
                });
            }
            self.ends[end].mesh = mesh;
        }
        Ok(())
    }

    /// The surfaces, each moved by the motion to half-way to the next.
    fn add_surfaces(&mut self, frames: &[Frame], truth: Option<&TrueShapes>) -> Result<()> {
        for frame in frames {
            self.quality.push(Quality {
                time: frame.entry.time,
                triangles: frame.mesh.triangles.len(),
                components: Some(frame.components),
                consistency: frame.entry.consistency,
                round_trip: frame.entry.round_trip,
                slope_error: frame.entry.slope_error,
                truth: None,
            });
        }
        let filled: Vec<usize> = (0..frames.len())
            .filter(|k| !frames[*k].mesh.triangles.is_empty())
            .collect();
        let times: Vec<f64> = filled.iter().map(|k| frames[*k].time).collect();
        let spans: Vec<Vec<f64>> = (0..times.len())
            .map(|k| times_around(&times, k, self.moves()))
            .collect();
        // 6 bytes for a position, 12 for the two triangles of a vertex, 4 for its values.
        let for_a_vertex: usize = spans.iter().map(|times| 6 * times.len() + 16).sum();
        let [fewest, most] = SURFACE_VERTICES;
        let most = (SURFACE_BYTES / for_a_vertex.max(1)).clamp(fewest, most);
        let mut largest = 0;
        for (k, times) in filled.into_iter().zip(spans) {
            let (mesh, time) = (&frames[k].mesh, frames[k].time);
            largest = largest.max(mesh.vertices.len());
            let thin = thinned(mesh, most);
            let points: Vec<[f32; 3]> = (thin.chosen.iter())
                .map(|vertex| mesh.vertices[*vertex as usize])
                .collect();
            let mut values = self.trust(&points, time)?;
            if let Some(distances) =
                truth.and_then(|truth| truth.distances(self.learned(), &points, time))
            {
                let sum: f64 = distances.iter().map(|x| f64::from(*x)).sum();
                self.quality[k].truth = Some(sum / distances.len() as f64);
                values.push(("truth", distances));
            }
            self.surfaces.push(Track {
                time,
                frames: self.around(&thin.mesh.vertices, time, &times)?,
                times,
                triangles: thin.mesh.triangles,
                values,
            });
        }
        if largest > most {
            let text = format!("surfaces, at most {most} of {largest} vertices");
            self.thinned.push(text);
        }
        Ok(())
    }

    /// Points of the surface at `time` at the times around it.
    fn around(&self, points: &[[f32; 3]], time: f64, times: &[f64]) -> Result<Vec<Vec<[f32; 3]>>> {
        let own = times.partition_point(|other| *other < time);
        let mut frames = vec![points.to_vec(); times.len()];
        for k in (0..own).rev() {
            frames[k] = self
                .learned()
                .carry(&frames[k + 1], times[k + 1], times[k])?;
        }
        for k in own + 1..times.len() {
            frames[k] = self
                .learned()
                .carry(&frames[k - 1], times[k - 1], times[k])?;
        }
        Ok(frames)
    }

    /// How far to trust each point of a surface: computed at some, and taken from the nearest of them elsewhere.
    fn trust(&self, points: &[[f32; 3]], time: f64) -> Result<Values> {
        let apart = points.len().div_ceil(TRUSTED).max(1);
        let some: Vec<[f32; 3]> = points.iter().step_by(apart).copied().collect();
        let Some(found) = self.learned().agreement_of_each(&some, time)? else {
            return Ok(Vec::new());
        };
        let wide = |points: &[[f32; 3]]| -> Vec<[f64; 3]> {
            points.iter().map(|x| x.map(f64::from)).collect()
        };
        let nearest = match apart {
            1 => (0..points.len()).collect(),
            _ => {
                let search = NeighbourSearch::new(&wide(&some));
                let near = search.nearest_one_of_each(&wide(points)).into_iter();
                near.map(|found| found.index as usize).collect::<Vec<_>>()
            }
        };
        let spread = |values: &[f32]| nearest.iter().map(|k| values[*k]).collect();
        Ok(vec![
            ("consistency", spread(&found.consistency)),
            ("round_trip", spread(&found.round_trip)),
        ])
    }

    /// Pairs of the source and the target; a file that cannot be read is noted.
    fn add_pairs(&mut self) {
        // Between the first and the last of many shapes none are given.
        let [source, target] = &self.shapes[..] else {
            return;
        };
        let found = match &self.trained.recipe().data.between[0] {
            recipe::Correspondences::File(path) => {
                Some(Correspondences::read(path, source, target))
            }
            recipe::Correspondences::Match => {
                let path = self.trained.folder().pairs(0, 1);
                Some(Correspondences::read(&path, source, target))
            }
            recipe::Correspondences::SameVertices => {
                Some(Correspondences::same_vertices(source, target))
            }
            recipe::Correspondences::None => None,
        };
        match found {
            Some(Ok(known)) => {
                let places = [0.0, 1.0].map(|time| self.learned().coordinates.at(time));
                let some = thinned_cloud(known.pairs.len(), PAIRS);
                if some.len() < known.pairs.len() {
                    let text = format!("{} of {} pairs", some.len(), known.pairs.len());
                    self.thinned.push(text);
                }
                let both = |k: u32| {
                    let [a, b] = known.pairs[k as usize].map(|vertex| vertex as usize);
                    [
                        places[0].apply(source.mesh.vertices[a]),
                        places[1].apply(target.mesh.vertices[b]),
                    ]
                };
                self.pairs = some.into_iter().map(both).collect();
            }
            Some(Err(reason)) => self.notes.push(format!("pairs are not shown: {reason}")),
            None => {}
        }
    }

    /// The page.
    pub(super) fn page(self, date: &str) -> Page {
        let trained = self.trained;
        let recipe = trained.recipe();
        let (steps, series) = series(&trained.metrics().unwrap_or_default());
        let title = trained.path().file_name().map_or_else(
            || "run".to_owned(),
            |name| name.to_string_lossy().into_owned(),
        );
        let [source, target] = self.ends;
        let subtitle = format!(
            "{} to {}{}, {}, preset {}, {} steps",
            source.name,
            target.name,
            match self.shapes.len() {
                2 => String::new(),
                count => format!(" through {count} key frames"),
            },
            spec_of(recipe).described(),
            recipe.preset,
            recipe.training.steps
        );
        let mut bounds = BoundsOf::default();
        bounds.add([&source.mesh.vertices, &target.mesh.vertices]);
        for track in self.surfaces.iter().chain(&self.carried) {
            bounds.add(&track.frames);
        }
        Page {
            title,
            subtitle,
            date: date.replace('T', " ").replace('Z', " UTC"),
            unit: 1.0 / trained.learned().coordinates.normalisation.scale,
            clock: trained.span(),
            keys: trained.key_units(),
            bounds: bounds.found(),
            source,
            target,
            carried: self.carried,
            surfaces: self.surfaces,
            pairs: self.pairs,
            quality: self.quality,
            steps,
            series,
            recipe: recipe.to_toml(),
            notes: self.notes,
            thinned: self.thinned,
            reloaded: None,
        }
    }
}

fn name_of(shape: &Shape) -> String {
    let name = shape.path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// A shape with as many points as the page takes.
fn shown(mesh: &Mesh<f32>) -> Thinned {
    if !mesh.triangles.is_empty() {
        return thinned(mesh, VERTICES);
    }
    let chosen = thinned_cloud(mesh.vertices.len(), VERTICES);
    let points = chosen.iter().map(|k| mesh.vertices[*k as usize]);
    Thinned {
        mesh: Mesh::new(points.collect(), Vec::new()),
        chosen,
    }
}

/// The times at which surface `k` is shown: as many steps to half-way to its neighbours as give about [`TIMES`] in
/// all, none where nothing moves.
fn times_around(times: &[f64], k: usize, moves: bool) -> Vec<f64> {
    let steps = match times.len() {
        0 | 1 => 0,
        // One at least, so that no surface jumps.
        count if moves => ((TIMES / 2) / (count - 1)).max(1),
        _ => 0,
    };
    let towards = |other: f64| {
        let half = (other - times[k]) / 2.0;
        (1..=steps).map(move |step| times[k] + half * step as f64 / steps as f64)
    };
    let before = (k > 0).then(|| towards(times[k - 1]).collect::<Vec<_>>());
    let after = times
        .get(k + 1)
        .map(|next| towards(*next).collect::<Vec<_>>());
    let before = before.into_iter().flatten().rev();
    let mut all: Vec<f64> = (before.chain([times[k]]))
        .chain(after.into_iter().flatten())
        .collect();
    all.dedup();
    all
}

/// The box around points.
struct BoundsOf([[f32; 3]; 2]);

impl Default for BoundsOf {
    fn default() -> Self {
        Self([[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]])
    }
}

impl BoundsOf {
    fn add<'a>(&mut self, lists: impl IntoIterator<Item = &'a Vec<[f32; 3]>>) {
        let [low, high] = &mut self.0;
        for x in lists.into_iter().flatten() {
            for k in 0..3 {
                low[k] = low[k].min(x[k]);
                high[k] = high[k].max(x[k]);
            }
        }
    }

    fn found(&self) -> Bounds {
        let [min, max] = self.0;
        Bounds { min, max }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_are_shown_until_half_way_to_the_next() {
        let times = [0.0, 0.5, 1.0];
        assert_eq!(
            times_around(&times, 0, true),
            [
                0.0,
                0.25 / 6.0,
                0.5 / 6.0,
                0.125,
                1.0 / 6.0,
                1.25 / 6.0,
                0.25
            ]
        );
        let middle = times_around(&times, 1, true);
        assert_eq!(
            (middle.len(), middle[0], middle[6], middle[12]),
            (13, 0.25, 0.5, 0.75)
        );
        assert_eq!(times_around(&times, 1, false), [0.5]);
        assert_eq!(times_around(&[0.5], 0, true), [0.5]);
    }
}
