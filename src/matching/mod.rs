//! Pairs of points of two shapes that belong together, found from the shapes alone.
//!
//! ```text
//! two shapes -> surfaces -> rigid motion -> registration there -> pairs, each with a confidence
//!                                        \> registration back /
//! ```
//!
//! | file | what it does |
//! |---|---|
//! | `surface.rs` | 20,000 points on a shape, how remote each of its nodes is |
//! | `level.rs` | 1,500 nodes among the points, which they carry, and a quarter of them, which carry the others |
//! | `graph.rs` | distances along a surface, which keep near sheets apart |
//! | `anchors.rs` | pairs that are given, which hold the registration |
//! | `rigid.rs` | the rigid motion to begin with, where the shapes are not in one frame |
//! | `assignment.rs` | which node belongs to which, softly and in both directions at once |
//! | `affinity.rs`, `sparse.rs` | how alike two points are, and matrices of such numbers without the zeros |
//! | `cells.rs` | points by the cell of a grid that they lie in, so that what is far apart is left out |
//! | `elastic.rs`, `system.rs` | nodes that move as rigidly as possible but for joints, and the system behind |
//! | `register.rs` | assignment and motion in turn, from far and stiff to near and yielding |
//! | `pairs.rs` | mutual nearest neighbours under both registrations, their confidence, coverage, the way there and back |
//! | `options.rs`, `outcome.rs`, `error.rs` | what goes in, what comes out, what is refused |
//! | `stage.rs` | what is reported on the way |
//! | `rotation.rs` | rotations nearest to a matrix |
//!
//! The registration is expectation maximisation in the manner of coherent point drift (Myronenko
//! and Song, "Point set registration: coherent point drift", TPAMI 32, 2010): soft assignments
//! under a falling standard deviation, and a motion that follows them as far as a prior lets it.
//!
//! # Differs from coherent point drift
//! The prior is as-rigid-as-possible motion of ties along the surface, with joints, instead of a
//! smooth displacement: limbs turn by large angles and keep their length, and legs that nearly
//! touch move apart. Assignments sum to at most 1 in both directions. Normals take part, and until
//! half-way how remote a point is from all others along the surface, which does not change with the
//! pose. In the end surfaces slide along each other freely, and both registrations are refined
//! together: points of the target count more that the way back takes to where a node comes from.
//!
//! # What keeps it short
//! Under a wide standard deviation a quarter of the nodes make the same sums. Affinities below
//! `exp(-12)` are left out. Of the registrations from two widths in each direction only the two that
//! agree best go on to the last steps. `scripts/matching.py` measures time and accuracy.
//!
//! What it cannot do: tell apart what is alike in form (a sphere turned about its centre, a limb
//! about its own axis); follow parts that touch in one shape and not in the other beyond what their
//! normals say; find what turns by more than about a right angle and has no limb to hold on to.

mod affinity;
mod anchors;
mod assignment;
mod cells;
mod elastic;
mod error;
mod graph;
mod level;
mod options;
mod outcome;
mod pairs;
mod register;
mod rigid;
mod rotation;
mod sparse;
mod stage;
mod surface;
mod system;

use std::time::Instant;

use rayon::prelude::*;
use rustc_hash::FxHashSet;

pub(crate) use error::MatchError;
pub use options::MatchOptions;
pub use outcome::{Coverage, Cycle, Matching, Quantiles, Rigid};
pub use pairs::MatchedPair;
pub(crate) use rotation::RigidMotion;
pub use stage::MatchStage;
pub(crate) use stage::Report;

use crate::shape::{Correspondences, Normalisation, Shape, ShapeError};
use anchors::{Anchors, Holds};
use level::NodeMotion;
use pairs::{Laid, Sites};
use register::{Registration, WIDTHS};
use surface::{Surface, farthest_points};

/// A surface counts as covered where a matched vertex is within this distance, in normalised units
/// (mean area 1).
pub(crate) const COVERAGE_RADIUS: f64 = 0.05;

/// Finds the vertices of two shapes that belong together.
///
/// `given` are pairs that are known: the search follows them, and the result holds them as they are.
///
/// The same shapes, given pairs and options give the same pairs, whatever the number of cores. `report` is called
/// as each stage begins, on its way and as it ends.
///
/// # Errors
/// [`MatchError::Option`] if an option is out of range, [`MatchError::Shape`] if a shape has no
/// area, [`MatchError::NoPairs`] if nothing is sure enough.
pub(crate) fn match_shapes(
    source: &Shape,
    target: &Shape,
    given: &Correspondences,
    options: &MatchOptions,
    report: &mut Report<'_>,
) -> Result<Matching, MatchError> {
    let clock = Instant::now();
    options.checked()?;
    let shapes = [source, target];
    report(MatchStage::Surfaces, 0, 1);
    let frame = Normalisation::joint(&shapes)?;
    let surface = |side: usize| {
        let seed = options.seed.wrapping_mul(2).wrapping_add(side as u64);
        Surface::new(shapes[side], &frame, [options.points, options.nodes], seed)
    };
    let (from, to) = rayon::join(|| surface(0), || surface(1));
    let (from, to) = (from?, to?);
    report(MatchStage::Surfaces, 1, 1);
    report(MatchStage::Alignment, 0, 1);
    let anchors = Anchors::new(shapes, &given.pairs, &frame);
    let alignment = match options.aligned {
        true => rigid::as_given(&from, &to),
        false => rigid::align(&from, &to, &anchors),
    };
    report(MatchStage::Alignment, 1, 1);
    let [there, back] = register_both([&from, &to], &anchors, &alignment.motion, report);
    report(MatchStage::Pairs, 0, 1);
    let laid = [(&from, &there), (&to, &back)].map(|(surface, motion)| Laid { surface, motion });
    let found = mutual_pairs(shapes, laid, &frame);
    let mutual = found.len();
    let pairs = kept(found, given, source, &frame, options);
    if pairs.is_empty() {
        return Err(MatchError::NoPairs {
            source_path: source.path.clone(),
            target_path: target.path.clone(),
            least: options.least_confidence,
        });
    }
    let sources = places(source, pairs.iter().map(|pair| pair.source), &frame);
    let targets = places(target, pairs.iter().map(|pair| pair.target), &frame);
    let matching = Matching {
        mutual,
        given: given.pairs.len(),
        coverage: Coverage {
            radius: COVERAGE_RADIUS,
            source: pairs::coverage(&from, &sources, COVERAGE_RADIUS),
            target: pairs::coverage(&to, &targets, COVERAGE_RADIUS),
        },
        cycle: Cycle {
            source: Quantiles::of(pairs::there_and_back(laid[0], laid[1])),
            target: Quantiles::of(pairs::there_and_back(laid[1], laid[0])),
        },
        rigid: Rigid::new(&alignment, &frame),
        scale: frame.scale,
        seconds: clock.elapsed().as_secs_f64(),
        kept: shapes.map(|shape| shape.kept.clone()),
        pairs,
    };
    report(MatchStage::Pairs, 1, 1);
    Ok(matching)
}

/// Points and nodes of each surface that decide a rigid motion.
const LAID: [usize; 2] = [4000, 500];

/// The rigid motion, in the shapes' coordinates, that lays the surface of one shape roughly onto that of another: none
/// unless it brings them clearly closer, or if `is_free` the closest in any case.
///
/// # Errors
/// [`ShapeError`] if a shape has no surface.
pub(crate) fn rigid_motion(
    source: &Shape,
    target: &Shape,
    is_free: bool,
    seed: u64,
) -> Result<RigidMotion, ShapeError> {
    let frame = Normalisation::joint(&[source, target])?;
    let surface = |shape: &Shape| Surface::new(shape, &frame, LAID, seed);
    let (from, to) = rayon::join(|| surface(source), || surface(target));
    let (from, to) = (from?, to?);
    let alignment = match is_free {
        true => rigid::lay(&from, &to),
        false => rigid::align(&from, &to, &Anchors::default()),
    };
    if alignment.motion == RigidMotion::IDENTITY {
        return Ok(RigidMotion::IDENTITY);
    }
    let Rigid {
        rotation,
        translation,
        ..
    } = Rigid::new(&alignment, &frame);
    Ok(RigidMotion {
        rotation,
        translation,
    })
}

/// The motions there and back: those from each width until all have come near, then the two that
/// agree best, in the end each with the other.
fn register_both(
    [source, target]: [&Surface; 2],
    anchors: &Anchors,
    start: &RigidMotion,
    report: &mut Report<'_>,
) -> [NodeMotion; 2] {
    let steps = Registration::STEPS + Registration::FINE_STEPS;
    let mut report = |done| report(MatchStage::Registration, done, steps);
    let held = [(anchors, source), (&anchors.reversed(), target)];
    let held = held.map(|(anchors, surface)| Holds::new(anchors, surface));
    let ways = [
        ([source, target], *start, &held[0]),
        ([target, source], start.inverse(), &held[1]),
    ];
    let [mut there, mut back] = ways.map(|(surfaces, start, held)| {
        WIDTHS.map(|width| Registration::new(surfaces, &start, width, held))
    });
    for step in 0..Registration::STEPS {
        report(step);
        let all = there.par_iter_mut().chain(&mut back);
        all.for_each(Registration::advance);
    }
    let [i, j] = most_agreeing([source, target], [&there, &back]);
    let (forth, counter) = (&mut there[i], &mut back[j]);
    for step in Registration::STEPS..steps {
        report(step);
        let (here, away) = (forth.motion(), counter.motion());
        rayon::join(|| forth.settle(&away), || counter.settle(&here));
    }
    report(steps);
    [forth.motion(), counter.motion()]
}

/// Which of the ways there and which of the ways back come nearest to undoing each other.
fn most_agreeing(surfaces: [&Surface; 2], ways: [&[Registration<'_>]; 2]) -> [usize; 2] {
    let motions = ways.map(|ways| Vec::from_iter(ways.iter().map(Registration::motion)));
    let laid = |side: usize, way: usize| Laid {
        surface: surfaces[side],
        motion: &motions[side][way],
    };
    let mut best = (f64::INFINITY, [0; 2]);
    for forth in 0..motions[0].len() {
        for counter in 0..motions[1].len() {
            let apart = pairs::disagreement(laid(0, forth), laid(1, counter));
            if apart < best.0 {
                best = (apart, [forth, counter]);
            }
        }
    }
    best.1
}

/// Vertices that are each other's nearest, sure or not.
fn mutual_pairs(
    shapes: [&Shape; 2],
    laid: [Laid<'_>; 2],
    frame: &Normalisation,
) -> Vec<MatchedPair> {
    let sites = [0, 1].map(|side| Sites::of(shapes[side], laid[side].surface, frame));
    pairs::mutual((laid[0], &sites[0]), (laid[1], &sites[1]))
}

/// The pairs that the options ask for: sure enough, and if that is too many, spread over the
/// source. Given ones take the place of those that share a vertex with them, and all are kept.
fn kept(
    mut pairs: Vec<MatchedPair>,
    given: &Correspondences,
    source: &Shape,
    frame: &Normalisation,
    options: &MatchOptions,
) -> Vec<MatchedPair> {
    let taken = [0, 1].map(|side| FxHashSet::from_iter(given.pairs.iter().map(|pair| pair[side])));
    pairs.retain(|pair| {
        let is_free = !taken[0].contains(&pair.source) && !taken[1].contains(&pair.target);
        is_free && pair.confidence >= options.least_confidence
    });
    let count = options
        .count
        .map(|count| count.saturating_sub(given.pairs.len()));
    if let Some(count) = count
        && count < pairs.len()
    {
        let places = places(source, pairs.iter().map(|pair| pair.source), frame);
        let mut spread = farthest_points(&places, count);
        spread.sort_unstable();
        pairs = spread
            .into_iter()
            .map(|kept| pairs[kept as usize])
            .collect();
    }
    let as_given = |(k, &[source, target]): (usize, &[u32; 2])| MatchedPair {
        source,
        target,
        confidence: given.confidence.get(k).map_or(1.0, |&sure| sure.into()),
    };
    pairs.extend(given.pairs.iter().enumerate().map(as_given));
    pairs.sort_by_key(|pair| pair.source);
    pairs
}

/// Vertices of a shape in normalised coordinates.
fn places(
    shape: &Shape,
    vertices: impl Iterator<Item = u32>,
    frame: &Normalisation,
) -> Vec<[f64; 3]> {
    vertices
        .map(|vertex| {
            frame
                .apply(shape.mesh.vertices[vertex as usize])
                .map(f64::from)
        })
        .collect()
}

#[cfg(test)]
mod tests;
