//! The table of the keys that more than one method has: each once, with what it means, its type, the
//! value that each preset gives it, and what it accepts. Keys that one method alone has stand in the same
//! form in its own file (`method/`), and there it also says on which of these keys it acts.
//!
//! A row reads `field: type = instant | quick | default | quality | paper, rule;`. The columns are TOML;
//! `_` says that no preset can know the value. The key in the file is the field with `-` for `_`.
//!
//! `instant` solves for a field of splines instead of training networks. `quick`, `default` and
//! `quality` are one method with more and more samples; `paper` is what
//! the paper prints with the least corrections that keep f from collapsing to zero; each key whose
//! value is such a correction says so. "Normalised units" are those in which both shapes have a
//! mean surface area of 1.

use std::path::PathBuf;

use isomorph_model::operators::Derivatives;
use isomorph_model::trajectory::Integrator;

use super::rule::Rule;
use super::schema::{Key, Keyed, Section, section};
use super::words::{
    Activation, Align, Cleaning, Correspondences, DERIVATIVES, GeometryKind, INTEGRATORS,
    LevelSetForm, NormalSource, Optimiser, Preset, Schedule, TimeSampling, VelocityKind,
};

/// The most steps, points or files of any kind that a recipe may have.
const MANY: u64 = 10_000_000;

/// The greatest seed: TOML promises integers of 64 bits with a sign, no more.
const GREATEST_SEED: u64 = i64::MAX as u64;

/// The key above all sections.
pub(crate) static PRESET: Key = Key {
    section: "",
    field: "preset",
    doc: "Values of all keys that are not given.",
    rule: Rule::word(Preset::WORDS),
    columns: [
        "\"instant\"",
        "\"quick\"",
        "\"default\"",
        "\"quality\"",
        "\"paper\"",
    ],
};

/// The sections that every recipe may have, in the order in which they are printed.
pub(crate) static SECTIONS: [&Section; 7] = [
    DataKeys::SECTION,
    ImplicitRecipe::SECTION,
    VelocityRecipe::SECTION,
    LossRecipe::SECTION,
    TrainingRecipe::SECTION,
    CheckpointRecipe::SECTION,
    ResultRecipe::SECTION,
];

section! {
    /// The shapes, and which of their points correspond.
    data: DataKeys {
        /// Shape at time 0: PLY, OBJ, STL, OFF, glTF, NPY, or points in text. The path is relative to this
        /// recipe. A mesh is sampled, a point cloud is used as it is.
        source: Option<PathBuf> = _ | _ | _ | _ | _, Rule::path();
        /// Shape at time 1.
        target: Option<PathBuf> = _ | _ | _ | _ | _, Rule::path();
        /// A sequence of shapes, of which some frames are the key frames: a .anime file, a folder, or a
        /// pattern of files such as "scans/*.ply", in the order of the numbers in their names. It replaces source
        /// and target.
        sequence: Option<PathBuf> = _ | _ | _ | _ | _, Rule::path();
        /// The frames of the sequence that are key frames, counted from 0, in ascending order. Their numbers are
        /// their times. All files of a folder or a pattern without it.
        keys: Option<Vec<f64>> = _ | _ | _ | _ | _, Rule::list(0.0, MANY as f64);
        /// Known correspondences. "none": no pairs. "same-vertices": vertices of equal number are
        /// pairs. "match": isomorph finds pairs before training. A path: a file with
        /// source_index,target_index on each line, or an array of numpy; one column is a map.
        correspondences: Correspondences = "none" | "none" | "none" | "none" | "none",
            Rule::word_or_path(Correspondences::WORDS);
        /// Points sampled on each mesh. The paper uses 20000.
        points: usize = 20_000 | 20_000 | 20_000 | 20_000 | 20_000, Rule::whole(64, MANY);
        /// Largest number of correspondences that is used, as a share of the points. The paper uses
        /// 0.05 to 0.2.
        correspondence_fraction: f64 = 0.05 | 0.05 | 0.05 | 0.05 | 0.05, Rule::above_zero(1.0);
        /// Normals of the shapes: "auto" (those of the file, or estimated), "given", "estimate" or
        /// "none". Without normals the distance field fits forty times worse.
        normals: NormalSource = "auto" | "auto" | "auto" | "auto" | "auto", Rule::word(NormalSource::WORDS);
        /// Whether raw scans are cleaned. "auto": points in one place, repeated points, stray points and small
        /// parts far from the rest are left out, and a note says how many. "none": all are used.
        clean: Cleaning = "auto" | "auto" | "auto" | "auto" | "auto", Rule::word(Cleaning::WORDS);
        /// A point is astray if its neighbours are so many times as far as theirs are.
        clean_strays: f64 = 5 | 5 | 5 | 5 | 5, Rule::number(1.5, 1e6);
        /// A part of a cloud far from the rest is left out if it has less than this share of the points.
        clean_part: f64 = 5e-3 | 5e-3 | 5e-3 | 5e-3 | 5e-3, Rule::number(0.0, 1.0).zero("keeps all parts");
        /// Whether shapes are laid onto each other first, so that only the rest of the motion is learned; results lie
        /// where the files do. "none": no. "rigid": turned and shifted. "similarity": brought to one size as well.
        /// "auto": only what is clearly needed, as with other units, far-apart shapes and large turns.
        align: Align = "none" | "none" | "none" | "none" | "none", Rule::word(Align::WORDS);
        /// Whether pairs may mirror the shape, as left and right hands do. No continuous motion does that.
        mirrored: bool = false | false | false | false | false, Rule::flag();
    }
}

section! {
    /// The distance field f(x, t). The surface at time t is where it is 0.
    implicit: ImplicitRecipe {
        /// How f is made. "flow": two end fields, one for each shape, carried by V. "network": one
        /// network of position and time, as in the paper.
        geometry: GeometryKind = "flow" | "flow" | "flow" | "flow" | "network",
            Rule::word(GeometryKind::WORDS);
        /// Hidden layers.
        depth: usize = 5 | 5 | 5 | 5 | 8, Rule::whole(1, 32);
        /// Units in each hidden layer.
        width: usize = 128 | 128 | 128 | 192 | 512, Rule::whole(4, 4096);
        /// Activation: "sine" or "softplus". The paper uses the softplus.
        activation: Activation = "sine" | "sine" | "sine" | "sine" | "softplus",
            Rule::word(Activation::WORDS);
        /// Frequency of the sine, or sharpness of the softplus. The paper leaves the sharpness
        /// open; 100 is a good start.
        beta: f64 = 20 | 20 | 20 | 20 | 100, Rule::above_zero(1000.0);
        /// Frequencies of the positional encoding. The paper leaves their number open.
        frequencies: usize = 0 | 0 | 0 | 0 | 6, Rule::whole(0, 16).zero("uses the position as it is");
        /// Radius of the sphere from which f starts. The paper uses 1, which is larger than the
        /// shapes.
        sphere_radius: f64 = 0.4 | 0.4 | 0.4 | 0.4 | 0.4, Rule::above_zero(10.0).unit("normalised units");
        /// Hidden layer that receives the input a second time (skip connection). It must be less
        /// than depth.
        skip: usize = 0 | 0 | 0 | 0 | 0, Rule::whole(0, 31).zero("means no skip connection");
    }
}

section! {
    /// The velocity field V, which carries the surface from the source to the target.
    velocity: VelocityRecipe {
        /// What V is made of. "network": a network, which is trained. "spline": quadratic B-splines on
        /// a grid, found by Gauss-Newton in seconds; the end fields are then the shapes themselves.
        /// "trained-spline": the same splines beside end fields that are networks; after
        /// training.guided-until V is trained with them.
        kind: VelocityKind = "spline" | "network" | "network" | "network" | "network",
            Rule::word(VelocityKind::WORDS);
        /// Hidden layers.
        depth: usize = 4 | 4 | 4 | 4 | 8, Rule::whole(1, 32);
        /// Units in each hidden layer.
        width: usize = 96 | 96 | 96 | 128 | 256, Rule::whole(4, 4096);
        /// Activation: "softplus" or "sine". The paper uses the softplus.
        activation: Activation = "softplus" | "softplus" | "softplus" | "softplus" | "softplus",
            Rule::word(Activation::WORDS);
        /// Sharpness of the softplus, or frequency of the sine, for which 4 to 8 is a good start.
        /// The paper leaves the sharpness open.
        beta: f64 = 100 | 100 | 100 | 100 | 100, Rule::above_zero(1000.0);
        /// Frequencies of the positional encoding. The paper leaves their number open.
        frequencies: usize = 0 | 0 | 0 | 0 | 6, Rule::whole(0, 16).zero("uses the position as it is");
        /// Hidden layer that receives the input a second time (skip connection). It must be less
        /// than depth.
        skip: usize = 0 | 0 | 0 | 0 | 0, Rule::whole(0, 31).zero("means no skip connection");
        /// Whether V depends on time. If so, limbs may pass one place in different directions; set
        /// loss.screw as well. The paper uses V(x).
        time_dependent: bool = true | true | true | true | false, Rule::flag();
    }
}

section! {
    /// The objective: the weights of its terms, and their parameters.
    loss: LossRecipe {
        /// Weight of the level-set equation, which couples f to V (lambda_f of the paper).
        level_set: f64 = 10 | 10 | 10 | 10 | 100,
            Rule::positive_or_zero().zero("trains f without the equation");
        /// Level-set equation: "mlse" is the modified one of the paper, "olse" the original one.
        level_set_form: LevelSetForm = "mlse" | "mlse" | "mlse" | "mlse" | "mlse",
            Rule::word(LevelSetForm::WORDS);
        /// Factor of the modification in "mlse". 1 keeps the length of grad f along the flow. The
        /// paper prints 10, which destroys f.
        lambda_l: f64 = 1 | 1 | 1 | 1 | 1,
            Rule::positive_or_zero().zero("leaves the original equation");
        /// Weight of |(-alpha Laplacian + gamma) V|, the regulariser of the paper (lambda_v). It
        /// costs the most time.
        smoothness: f64 = 0 | 0 | 0 | 0 | 20,
            Rule::positive_or_zero().zero("turns smoothness and its cost off");
        /// Factor alpha of the Laplacian in smoothness.
        smoothness_alpha: f64 = 0.01 | 0.01 | 0.01 | 0.01 | 0.01,
            Rule::positive_or_zero().zero("leaves the norm of V");
        /// Factor gamma of V in smoothness.
        smoothness_gamma: f64 = 1 | 1 | 1 | 1 | 1,
            Rule::positive_or_zero().zero("leaves the Laplacian");
        /// Weight of |div V|, which keeps the volume. Set 0 if the volume changes. It is lambda_v
        /// lambda_div of the paper, which leaves the second open.
        divergence: f64 = 2 | 2 | 2 | 2 | 20,
            Rule::positive_or_zero().zero("turns volume preservation off");
        /// Weight of the strain rate near the surface. Rotations are free, stretching is not. Set 0
        /// for shapes that stretch. With a time-dependent V also set loss.screw. Not in the paper.
        strain: f64 = 3 | 3 | 3 | 3 | 0, Rule::positive_or_zero().zero("turns it off");
        /// Strain rate beyond which the strain term grows linearly, so that strain gathers in
        /// joints. 0.1 is a good start.
        strain_scale: f64 = 0 | 0 | 0 | 0 | 0,
            Rule::positive_or_zero().unit("per unit of time").zero("is the square everywhere");
        /// Weight of the distance between carried points and their correspondences (lambda_m of the
        /// paper).
        matching: f64 = 200 | 200 | 200 | 200 | 200,
            Rule::positive_or_zero().zero("ignores the correspondences");
        /// The same weight until training.warm-up.
        matching_warm_up: f64 = 200 | 200 | 200 | 200 | 100,
            Rule::positive_or_zero().zero("ignores the correspondences then");
        /// Distance beyond which a pair is taken as wrong and ignored (Geman-McClure). Set 0.03 if
        /// some pairs are wrong. It starts ten times as large and falls until training.ramp-until.
        /// The paper takes the plain distance.
        matching_scale: f64 = 0 | 0 | 0 | 0 | 0,
            Rule::positive_or_zero().unit("normalised units").zero("is the plain distance");
        /// Weight of |f| on the given points at both ends (lambda_m of the paper).
        data: f64 = 100 | 100 | 100 | 100 | 200, Rule::positive_or_zero().zero("frees f from the shapes");
        /// Weight of the angle between grad f and the normals at both ends. Optional in the paper,
        /// which gives no weight.
        normals: f64 = 20 | 20 | 20 | 20 | 20, Rule::positive_or_zero().zero("ignores the normals");
        /// Weight of (|grad f| - 1)^2, which makes f a distance. In "flow" it acts at the two ends,
        /// in "network" at all times. Not printed in the paper, but without it f collapses to zero.
        eikonal: f64 = 10 | 10 | 10 | 10 | 10, Rule::positive_or_zero().zero("lets f collapse");
        /// Weight of |f| at carried surface points. In "flow" it acts on arrival at the other
        /// shape, in "network" at random times. It also trains V. Not in the paper.
        on_surface: f64 = 100 | 100 | 100 | 100 | 0, Rule::positive_or_zero().zero("turns it off");
        /// Weight of the angle between grad f and the normals carried by V. It decides the surfaces
        /// in between. Not in the paper.
        transported_normals: f64 = 20 | 20 | 20 | 20 | 0, Rule::positive_or_zero().zero("turns it off");
        /// Weight of exp(-100 |f|) away from the surface, which removes false surfaces. For shapes
        /// without normals; 30 is a good start. Not in the paper.
        off_surface: f64 = 0 | 0 | 0 | 0 | 0, Rule::positive_or_zero().zero("turns it off");
        /// Weight of |f - d| away from the surface at both ends, where d is the signed distance to
        /// the shape. It needs normals, and prevents false surfaces. Not in the paper.
        distance: f64 = 100 | 100 | 100 | 100 | 0, Rule::positive_or_zero().zero("turns it off");
        /// Weight of |dV/dt + D V|^2 near the surface, D the strain rate. Each part may keep a
        /// constant screw motion at no cost. The recommended regulariser for a time-dependent V.
        /// Not in the paper.
        screw: f64 = 15 | 30 | 30 | 30 | 0, Rule::positive_or_zero().zero("turns it off");
    }
}

section! {
    /// The steps of training, and the samples of each.
    training: TrainingRecipe {
        /// Training steps. More give finer details; time grows in proportion. The paper uses 10000. A
        /// spline takes at most 500.
        steps: usize = 18 | 550 | 1_000 | 3_000 | 10_000, Rule::whole(1, MANY);
        /// Sample points in each step. The paper uses 4000.
        batch: usize = 2_200 | 2_200 | 4_000 | 4_000 | 4_000, Rule::whole(64, 1_000_000);
        /// Correspondences in each step, or all if fewer are known. The paper leaves it open.
        correspondence_batch: usize = 1_000 | 250 | 500 | 1_000 | 1_000, Rule::whole(1, 1_000_000);
        /// What moves the weights. "muon": Muon moves the matrices between hidden layers, Adam all
        /// other weights. "adam": Adam moves all weights. A run keeps its optimiser. The paper does not
        /// name one.
        optimiser: Optimiser = "adam" | "muon" | "muon" | "muon" | "adam", Rule::word(Optimiser::WORDS);
        /// Learning rate of f. Sine networks take 3e-4 to 5e-4, softplus networks 1e-3 to 2e-3. The
        /// paper uses 0.005.
        learning_rate: f64 = 5e-4 | 5e-4 | 5e-4 | 3e-4 | 5e-3, Rule::above_zero(1.0);
        /// Learning rate of what moves points. The paper has one for both.
        velocity_learning_rate: f64 = 2e-3 | 2e-3 | 1e-3 | 1e-3 | 5e-3, Rule::above_zero(1.0);
        /// Learning rate of Muon in f. 1e-3 fits sine networks of the presets' size; 5e-3 destroys f.
        muon_rate: f64 = 1e-3 | 1e-3 | 1e-3 | 1e-3 | 1e-3, Rule::above_zero(1.0);
        /// Learning rate of Muon in what moves points.
        velocity_muon_rate: f64 = 2e-2 | 2e-2 | 2e-2 | 2e-2 | 2e-2, Rule::above_zero(1.0);
        /// How learning rates fall: "cosine" over the steps in which a network trains, or "step" as
        /// in the paper.
        schedule: Schedule = "cosine" | "cosine" | "cosine" | "cosine" | "step", Rule::word(Schedule::WORDS);
        /// Factor on the learning rates at each step of the schedule "step".
        decay: f64 = 0.5 | 0.5 | 0.5 | 0.5 | 0.5, Rule::above_zero(1.0);
        /// Distance between those steps. The paper uses 2000 of 10000 steps.
        decay_every: f64 = 0.2 | 0.2 | 0.2 | 0.2 | 0.2, Rule::above_zero(1.0).unit("share of the steps");
        /// Learning rate at the end of the schedule "cosine".
        final_learning_rate: f64 = 0.02 | 0.02 | 0.02 | 0.02 | 0.02,
            Rule::number(0.0, 1.0).unit("share of the first one").zero("lets it fall to nothing");
        /// Until then V learns the field of splines that the preset "instant" finds, instead of the terms
        /// of the motion, and the end fields train beside it. Fewer steps are needed then. Where no splines are
        /// found, V learns from its own terms throughout. A V of splines is that field itself until then. Not in the
        /// paper.
        guided_until: f64 = 0 | 1 | 0.6 | 0.6 | 0,
            Rule::number(0.0, 1.0).unit("share of the steps").zero("starts without splines");
        /// End of the warm-up. Until then the weight of on-surface is 0 and matching-warm-up
        /// replaces matching. In "network" only V trains until then; in "flow" the end fields train
        /// throughout. At most ramp-until and velocity-until.
        warm_up: f64 = 0.3 | 0.3 | 0.3 | 0.3 | 0.2,
            Rule::number(0.0, 1.0).unit("share of the steps").zero("starts with all terms");
        /// End of the ramp. Until then matching-scale falls. From the end of the warm-up the weight
        /// of on-surface rises from 0, in "network" also that of level-set.
        ramp_until: f64 = 0.4 | 0.4 | 0.4 | 0.4 | 0.5, Rule::number(0.0, 1.0).unit("share of the steps");
        /// From then on V is kept and only f trains.
        velocity_until: f64 = 1 | 1 | 1 | 1 | 0.8, Rule::number(0.0, 1.0).unit("share of the steps");
        /// Method that follows points along V: "euler" (the paper's), "midpoint" or "rk4". Over a
        /// turn of one radian, "midpoint" with 3 steps is off by 0.0185 of the distance from the
        /// axis, "rk4" with 2 by 0.0005.
        integrator: Integrator = "rk4" | "rk4" | "rk4" | "rk4" | "euler", Rule::word(INTEGRATORS);
        /// Steps of the integrator from time 0 to 1; splines take twice as many, or more, where paths bend
        /// sharply. The paper leaves them open.
        time_steps: usize = 3 | 2 | 2 | 2 | 10, Rule::whole(1, 1000);
        /// Times of the samples in between: "random", or the "grid" of the integrator's steps. The
        /// paper leaves it open.
        times: TimeSampling = "random" | "random" | "random" | "random" | "random",
            Rule::word(TimeSampling::WORDS);
        /// How derivatives are computed. "nested": repeated automatic differentiation. "forward":
        /// one sweep through the network. The numbers are the same. Nesting takes longer, most of
        /// all with loss.smoothness; see the guide, chapter performance.
        derivatives: Derivatives = "nested" | "nested" | "nested" | "nested" | "forward",
            Rule::word(DERIVATIVES);
        /// Share of the samples in space that lie near the surface. The others fill the box. The
        /// paper leaves it open.
        band_share: f64 = 0.75 | 0.75 | 0.75 | 0.75 | 0.75,
            Rule::number(0.0, 1.0).zero("puts all of them in the box");
        /// Standard deviations of the distance of these samples from the surface, used in equal
        /// parts.
        band_widths: Vec<f64> = [0.01, 0.05] | [0.01, 0.05] | [0.01, 0.05] | [0.01, 0.05] | [0.01, 0.05],
            Rule::list_above_zero(10.0).unit("normalised units");
        /// Margin of the box around the shapes.
        box_margin: f64 = 0.15 | 0.15 | 0.15 | 0.15 | 0.15, Rule::above_zero(1.0).unit("normalised units");
        /// Largest norm of a gradient; longer ones are shortened to it. The paper has none.
        clip: f64 = 100 | 100 | 100 | 100 | 100, Rule::positive_or_zero().zero("turns it off");
        /// Random seed of initial weights and samples.
        seed: u64 = 0 | 0 | 0 | 0 | 0, Rule::whole(0, GREATEST_SEED);
        /// Steps between two lines of metrics.jsonl.
        log_every: usize = 1 | 10 | 10 | 10 | 10, Rule::whole(1, MANY).unit("steps");
    }
}

section! {
    /// Checkpoints, from which an interrupted run goes on.
    checkpoint: CheckpointRecipe {
        /// Steps between two checkpoints.
        every: usize = 9 | 100 | 100 | 1_000 | 1_000, Rule::whole(1, MANY).unit("steps");
        /// Number of newest checkpoints that are kept.
        keep: usize = 3 | 3 | 3 | 3 | 3, Rule::whole(1, MANY);
        /// How often training may go back to the newest checkpoint, with half of all learning rates, where a
        /// term or a weight is no number any more. Splines have no learning rates, and end.
        step_backs: usize = 0 | 0 | 0 | 0 | 0, Rule::whole(0, 100).zero("ends with an error");
    }
}

section! {
    /// The surfaces that training writes at its end.
    result: ResultRecipe {
        /// Number of surfaces, at even times from 0 to 1.
        frames: usize = 5 | 5 | 9 | 17 | 9, Rule::whole(0, 1000).zero("writes none");
        /// Grid cells along the longest side of the box. More cells keep thinner parts and take
        /// longer.
        resolution: usize = 192 | 192 | 256 | 384 | 192, Rule::whole(8, 2048);
        /// Steps between two previews: page and picture of the run as it stands, on a coarse grid. A page
        /// that is open in a browser loads itself again.
        preview_every: usize = 0 | 0 | 0 | 0 | 0, Rule::whole(0, MANY).unit("steps").zero("writes none");
        /// Pieces of a surface smaller than this share of its area are dropped, such as fingertips
        /// thinner than a cell.
        smallest_component: f64 = 1e-3 | 1e-3 | 1e-3 | 1e-3 | 0,
            Rule::number(0.0, 1.0).zero("keeps every piece");
    }
}
