//! Whole evaluations of methods whose errors are known.

use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::sync::OnceLock;

use serde_json::Value;

use super::testing::sphere;
use super::*;
use crate::geometry::Mesh;
use crate::shape::Normalisation;

/// Frames of the moving sphere; the ends are the first and the last.
const FRAMES: usize = 9;

const OPTIONS: Options = Options {
    samples: 5000,
    align: true,
    alignment_times: 33,
    every: 1,
    seed: 3,
};

/// The same, quicker.
const FEW: Options = Options {
    samples: 100,
    alignment_times: 9,
    ..OPTIONS
};

/// A sphere that moves by 3 radii along x at an even pace.
fn truth() -> GroundTruth {
    let ball = sphere(3);
    let frame = |k: usize| {
        let by = 3.0 * k as f64 / (FRAMES - 1) as f64;
        ball.moved(|[x, y, z]| [x + by, y, z]).vertices
    };
    let frames = (0..FRAMES).map(frame).collect();
    GroundTruth::new("ball.anime".into(), frames, ball.triangles).expect("nine frames")
}

fn normalisation(truth: &GroundTruth) -> Normalisation {
    let ends = [truth.shape(0), truth.shape(FRAMES - 1)];
    Normalisation::joint(&[&ends[0], &ends[1]]).expect("areas")
}

fn reference(options: Options) -> Result<Reference, TruthError> {
    let truth = truth();
    let span = truth.span(0, FRAMES - 1).expect("frames in between");
    Reference::new(&truth, span, &normalisation(&truth), options)
}

/// The same sphere, at `t^2` of its way; what it may lack is switched off.
struct Late {
    ball: Mesh<f64>,
    way: f64,
    radius: f64,
    surface: bool,
    carried: bool,
    fails_after: f64,
}

impl Late {
    fn new() -> Self {
        let truth = truth();
        let normalisation = normalisation(&truth);
        let start: Vec<[f32; 3]> = truth
            .vertices(0)
            .iter()
            .map(|&vertex| normalisation.apply(vertex))
            .collect();
        Self {
            ball: Mesh::of_points(&start, truth.triangles()),
            way: 3.0 * normalisation.scale,
            radius: normalisation.scale,
            surface: true,
            carried: true,
            fails_after: 1.0,
        }
    }

    fn by(&self, time: f64) -> f64 {
        self.way * time * time
    }
}

impl Candidate for Late {
    type Error = String;

    fn surface(&mut self, time: f64, _: Purpose) -> Result<Option<Mesh<f64>>, String> {
        if time > self.fails_after {
            return Err("the surface is empty".to_owned());
        }
        let by = self.by(time);
        Ok(self
            .surface
            .then(|| self.ball.moved(|[x, y, z]| [x + by, y, z])))
    }

    fn carried(&mut self, start: &[[f32; 3]], times: &[f64]) -> Result<Option<Carried>, String> {
        let at = |&time: &f64| {
            let by = self.by(time) as f32;
            start.iter().map(|&[x, y, z]| [x + by, y, z]).collect()
        };
        Ok(self.carried.then(|| times.iter().map(at).collect()))
    }

    /// Not a slope: the mean distance of the points from the sphere, to see that they are near it.
    fn slope_error(&mut self, points: &[[f32; 3]], time: f64) -> Result<Option<f64>, String> {
        // The sphere starts at the left of the joint box.
        let centre = -self.way / 2.0 + self.by(time);
        let off = points.iter().map(|&point| {
            let [x, y, z] = point.map(f64::from);
            ((x - centre).powi(2) + y * y + z * z).sqrt() - self.radius
        });
        Ok(Some(off.map(f64::abs).sum::<f64>() / points.len() as f64))
    }
}

fn go_on(_: usize, _: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// The evaluation of the whole method; taken once, as it takes a while.
fn evaluated() -> &'static Evaluation {
    static EVALUATION: OnceLock<Evaluation> = OnceLock::new();
    EVALUATION.get_or_init(|| {
        let reference = reference(OPTIONS).expect("a reference");
        reference
            .evaluate(&mut Late::new(), go_on)
            .expect("an evaluation")
    })
}

fn refused(candidate: &mut impl Candidate<Error = String>) -> String {
    let reference = reference(FEW).expect("a reference");
    reference
        .evaluate(candidate, go_on)
        .expect_err("refused")
        .to_string()
}

#[test]
fn an_exact_motion_at_another_pace_is_exact_once_aligned() {
    let (late, found) = (Late::new(), evaluated());
    assert_eq!(found.frames.len(), FRAMES - 2);
    let step = 1.0 / 32.0;
    for result in &found.frames {
        let time = result.time.expect("a frame has a time");
        let [surface, carried] =
            [&result.surface, &result.carried].map(|kind| kind.as_ref().expect("both"));
        for compared in [surface, carried] {
            assert_eq!(compared.metrics.time, time);
            // The pace is t^2: its inverse is the root. Costs grow by (way step)^2 / 3 a step, far
            // above the noise of sampling, so the nearest time of the grid, or its neighbour, is
            // chosen.
            assert!(
                (compared.aligned.time - time.sqrt()).abs() <= step,
                "{time}"
            );
        }
        let unaligned = late.way * (time - time * time);
        // Every vertex is off by the same, up to float32.
        let rmse = carried.metrics.tracked_rmse.expect("of carried vertices");
        assert!((rmse - unaligned).abs() < 1e-6, "{time}");
        // 0.02 either way, evenly: 0.01 on average, give or take 0.006 / sqrt(2000), and less by
        // the sag of the facets. Aligned, the sphere may still be off by a step.
        let near = surface.aligned.slope_error.expect("every surface has one");
        assert!(near < 0.012 + late.way * 2.0 * step, "{near}");
        assert_eq!(carried.metrics.slope_error, None);
        assert_eq!(surface.metrics.tracked_rmse, None);
    }
    let surface = found.mean.surface.as_ref().expect("in all frames");
    assert!(surface.aligned.chamfer_squared < surface.metrics.chamfer_squared / 20.0);
    assert!(surface.aligned.hausdorff < surface.metrics.hausdorff / 4.0);
}

#[test]
fn aligned_times_are_in_the_order_of_the_frames() {
    let found = evaluated();
    for kind in [
        |f: &FrameResult| f.surface.clone(),
        |f: &FrameResult| f.carried.clone(),
    ] {
        let times = found
            .frames
            .iter()
            .map(|frame| kind(frame).expect("both").aligned.time);
        assert!(Vec::from_iter(times).is_sorted());
    }
}

#[test]
fn straight_lines_are_exact_for_a_translation_and_nothing_is_below_the_floor() {
    let found = evaluated();
    for frame in &found.frames {
        let rmse = frame.linear.metrics.tracked_rmse.expect("vertices");
        // Float32 positions of size 1.
        assert!(rmse < 2e-7, "{rmse}");
        // The same surface sampled independently both times: equal within the noise of 5000 samples
        // (3 % and 5 % are five deviations).
        let ratio = frame.linear.metrics.chamfer / frame.floor.chamfer;
        assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
        let ratio = frame.linear.metrics.chamfer_squared / frame.floor.chamfer_squared;
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
        assert_ne!(frame.linear.metrics, frame.floor, "samples of their own");
    }
}

#[test]
fn the_ends_say_how_well_they_are_fitted_and_how_far_from_the_target_vertices_arrive() {
    let numbered =
        |ends: &[FrameResult]| -> Vec<_> { ends.iter().map(|end| (end.frame, end.time)).collect() };
    let found = evaluated();
    let both = [(Some(0), Some(0.0)), (Some(FRAMES - 1), Some(1.0))];
    assert_eq!(numbered(&found.ends), both);
    for end in &found.ends {
        let [surface, carried] =
            [&end.surface, &end.carried].map(|kind| kind.as_ref().expect("both"));
        // The noise of 5000 samples, as above.
        let ratio = surface.metrics.chamfer_squared / end.floor.chamfer_squared;
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
        assert_eq!(surface.aligned, surface.metrics);
        let rmse = carried.metrics.tracked_rmse.expect("vertices");
        assert!(rmse < 1e-6, "{rmse}");
    }
    let mut short = Late::new();
    short.way *= 0.9;
    let reference = reference(FEW).expect("a reference");
    let ends = reference
        .evaluate(&mut short, go_on)
        .expect("an evaluation")
        .ends;
    let carried = |end: &FrameResult| end.carried.clone().expect("carried").metrics.tracked_rmse;
    // It starts in its place and stops a tenth of the way short.
    assert!(carried(&ends[0]).expect("vertices") < 1e-6);
    let arrived = carried(&ends[1]).expect("vertices");
    assert!((arrived - short.way / 9.0).abs() < 1e-6, "{arrived}");
}

#[test]
fn what_a_method_does_not_have_is_absent() {
    let reference = reference(FEW).expect("a reference");
    let mut late = Late::new();
    late.surface = false;
    let found = reference.evaluate(&mut late, go_on).expect("an evaluation");
    assert_eq!(
        (&found.frames[0].surface, &found.mean.surface),
        (&None, &None)
    );
    assert!(found.mean.carried.is_some());
    late.carried = false;
    let found = reference.evaluate(&mut late, go_on).expect("an evaluation");
    let text = serde_json::to_string(&found).expect("numbers");
    assert!(!text.contains("surface") && !text.contains("carried") && text.contains("linear"));
}

#[test]
fn a_failing_method_is_named_by_frame_and_time_and_others_by_what_is_missing() {
    let mut late = Late::new();
    late.fails_after = 0.6;
    // The first time of the grid after 0.6 is 5/8, which is that of frame 5.
    assert_eq!(
        refused(&mut late),
        "frame 5, time 0.6250: the surface is empty"
    );
    let mut late = Late::new();
    late.ball.triangles.clear();
    let text = refused(&mut late);
    assert!(
        text.contains("frame 1, time 0.0000: the surface mesh") && text.contains("area 0"),
        "{text}"
    );
    let mut late = Late::new();
    late.way = f64::NAN;
    assert!(refused(&mut late).contains("area NaN"));
    let text = refused(&mut Forgetful);
    assert!(
        text.contains("frame 0: 257 vertices at 9 times, 258 at 9 needed"),
        "{text}"
    );
}

/// Carries one vertex less than it was given.
struct Forgetful;

impl Candidate for Forgetful {
    type Error = String;

    fn surface(&mut self, _: f64, _: Purpose) -> Result<Option<Mesh<f64>>, String> {
        Ok(None)
    }

    fn carried(&mut self, start: &[[f32; 3]], times: &[f64]) -> Result<Option<Carried>, String> {
        Ok(Some(vec![start[1..].to_vec(); times.len()]))
    }

    fn slope_error(&mut self, _: &[[f32; 3]], _: f64) -> Result<Option<f64>, String> {
        Ok(None)
    }
}

#[test]
fn a_break_ends_the_measuring_unless_all_is_done() {
    let reference = reference(FEW).expect("a reference");
    let mut late = Late::new();
    late.surface = false;
    let stop_at = |last: usize| {
        move |done: usize, _: usize| match done {
            done if done == last => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    };
    let stopped = reference
        .evaluate(&mut late, stop_at(2))
        .expect_err("stopped");
    assert_eq!(stopped.to_string(), "stopped after 2 of 7 frames");
    reference
        .evaluate(&mut late, stop_at(7))
        .expect("all frames are done");
}

#[test]
fn every_nth_frame_is_evaluated_and_options_out_of_range_are_refused() {
    let every = |every| reference(Options { every, ..FEW });
    let third = every(3).expect("two frames");
    assert_eq!(third.frames().collect::<Vec<_>>(), [3, 6]);
    let text = every(8).expect_err("too far apart").to_string();
    assert_eq!(
        text,
        "every = 8: must be 1 to 7, the number of frames between the ends"
    );
    let few = reference(Options {
        alignment_times: 4,
        ..FEW
    });
    let text = few.expect_err("too few").to_string();
    assert_eq!(text, "alignment_times = 4: must be 9 or more");
}

#[test]
fn the_same_seed_gives_the_same_numbers_and_another_one_others() {
    let mean = |seed| {
        let reference = reference(Options { seed, ..FEW }).expect("a reference");
        reference
            .evaluate(&mut Late::new(), go_on)
            .expect("an evaluation")
            .mean
    };
    assert_eq!(mean(1), mean(1));
    assert_ne!(mean(1).floor, mean(2).floor);
}

fn keys(value: &Value) -> BTreeSet<&str> {
    let object = value.as_object().expect("an object");
    object.keys().map(String::as_str).collect()
}

#[test]
fn the_json_has_the_keys_of_the_design() {
    let found = evaluated();
    let json = serde_json::to_value(found).expect("numbers");
    assert_eq!(keys(&json), BTreeSet::from(["frames", "mean", "ends"]));
    let kinds = BTreeSet::from(["surface", "carried", "linear", "floor"]);
    let mut of_frame = kinds.clone();
    of_frame.extend(["frame", "time"]);
    assert_eq!(keys(&json["frames"][0]), of_frame);
    assert_eq!(keys(&json["ends"][1]), of_frame);
    assert_eq!(keys(&json["mean"]), kinds);
    let floor = BTreeSet::from([
        "time",
        "chamfer",
        "chamfer_squared",
        "hausdorff",
        "hausdorff_squared",
        "hausdorff95",
        "normal_consistency",
        "volume_ratio",
        "area_ratio",
        "components",
        "outside_largest",
    ]);
    for result in [&json["frames"][0], &json["mean"]] {
        assert_eq!(keys(&result["floor"]), floor);
        for (kind, of_its_own) in [
            ("surface", "slope_error"),
            ("carried", "tracked_rmse"),
            ("linear", "tracked_rmse"),
        ] {
            let mut metrics = floor.clone();
            metrics.insert(of_its_own);
            assert_eq!(keys(&result[kind]["aligned"]), metrics);
            metrics.insert("aligned");
            assert_eq!(keys(&result[kind]), metrics);
        }
    }
}
