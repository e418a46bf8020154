//! The table of the recipe: every key, once, with what it means, its type, the value that each
//! preset gives it, and what it accepts. Whoever adds a key adds a row here and nothing elsewhere.
//!
//! A row reads `field: type = quick | default | quality | paper, rule;`. The columns are TOML; `_`
//! says that no preset can know the value. The key in the file is the field with `-` for `_`.
//!
//! `quick`, `default` and `quality` are one method with more and more samples; `paper` is what
//! the paper prints with the least corrections that keep f from collapsing to zero; each key whose
//! value is such a correction says so. "Normalised units" are those in which both shapes have a
//! mean surface area of 1.

use std::path::PathBuf;

use super::rule::{Rule, Value};
use super::schema::{Key, Section, Setting, sections};
use super::words::{
    Activation, Correspondences, Derivatives, GeometryKind, Integrator, LevelSetForm, MethodName,
    NormalSource, Preset, Schedule, TimeSampling,
};

/// The most steps, points or files of any kind that a recipe may ask for.
const MANY: u64 = 10_000_000;

/// The greatest seed: TOML promises integers of 64 bits with a sign, no more.
const GREATEST_SEED: u64 = i64::MAX as u64;

/// The key above all sections.
pub(super) static PRESET: Key = Key {
    section: "",
    field: "preset",
    doc: "The values that every key left out falls back to.",
    rule: Rule::word(Preset::WORDS),
    columns: ["\"quick\"", "\"default\"", "\"quality\"", "\"paper\""],
};

sections! {
    /// The two shapes and what is known of which points correspond.
    data: DataRecipe {
        /// The shape at time 0: PLY or OBJ, relative to this recipe; a mesh is sampled, a cloud
        /// is used as it is.
        source: PathBuf = _ | _ | _ | _, Rule::path();
        /// The shape at time 1.
        target: PathBuf = _ | _ | _ | _, Rule::path();
        /// Known pairs: none, every vertex with the one of the same number, pairs found by "match"
        /// before training, or those of a CSV file with source_index,target_index on each line.
        correspondences: Correspondences = "none" | "none" | "none" | "none",
            Rule::word_or_path(Correspondences::WORDS);
        /// Points sampled from each mesh; the paper takes 20000.
        points: usize = 20_000 | 20_000 | 20_000 | 20_000, Rule::whole(64, MANY);
        /// Correspondences used, as a share of the points, when more are known; the paper takes
        /// 0.05 to 0.2.
        correspondence_fraction: f64 = 0.05 | 0.05 | 0.05 | 0.05, Rule::above_zero(1.0);
        /// Normals of the shapes: "auto" takes given ones and estimates missing ones. The paper
        /// calls them optional, but f fits forty times worse without.
        normals: NormalSource = "auto" | "auto" | "auto" | "auto", Rule::word(NormalSource::WORDS);
    }

    /// What is trained: our method, or one that it is compared with (model/src/baseline).
    method: MethodRecipe {
        /// "velocity-field" is the paper's and ours, which differ in the values below.
        name: MethodName =
            "velocity-field" | "velocity-field" | "velocity-field" | "velocity-field",
            Rule::word(MethodName::WORDS);
        /// Until here only the two end fields train; "nise" and "nise-velocity".
        ends_until: f64 = 0.4 | 0.4 | 0.4 | 0.4, Rule::above_zero(0.9).unit("share of the steps");
        /// Frequency of the sine networks of "nise" and "nise-velocity", which print 20 to 30.
        omega: f64 = 20 | 20 | 20 | 20, Rule::above_zero(1000.0);
        /// Weight of the difference from the end fields at t = 0 and t = 1; "nise".
        ends: f64 = 10_000 | 10_000 | 10_000 | 10_000,
            Rule::positive_or_zero().zero("frees f from its ends");
        /// Weight of the residual of the equation between them; "nise".
        residual: f64 = 10 | 10 | 10 | 10, Rule::positive_or_zero().zero("turns it off");
        /// Weight of the bound on the Lipschitz constant; "lipmlp".
        lipschitz: f64 = 1e-6 | 1e-6 | 1e-6 | 1e-6, Rule::positive_or_zero().zero("turns it off");
        /// Factor on space before the network, so that the bound acts on time; "lipmlp".
        space_scale: f64 = 100 | 100 | 100 | 100, Rule::above_zero(1e6);
        /// Sine modes along each axis; "eigenbasis".
        modes: usize = 6 | 6 | 6 | 6, Rule::whole(1, 16);
        /// Weight of the prior that keeps the modes small, higher ones more; "eigenbasis".
        prior: f64 = 0.01 | 0.01 | 0.01 | 0.01, Rule::positive_or_zero().zero("turns it off");
        /// Times at which a deformation is fitted, each with its share of the steps; "nfgp".
        deformations: usize = 8 | 8 | 8 | 8, Rule::whole(1, 1000);
        /// Residual blocks of a deformation; "nfgp".
        blocks: usize = 6 | 6 | 6 | 6, Rule::whole(1, 32);
        /// Weight of the distance of the handles from their marks; "nfgp".
        handles: f64 = 100 | 100 | 100 | 100, Rule::positive_or_zero().zero("turns it off");
        /// Weight of the change of lengths on the surface; "nfgp".
        stretch: f64 = 0.1 | 0.1 | 0.1 | 0.1, Rule::positive_or_zero().zero("turns it off");
        /// Weight of the change of curvature; "nfgp".
        bend: f64 = 1e-3 | 1e-3 | 1e-3 | 1e-3, Rule::positive_or_zero().zero("turns it off");
    }

    /// The network f(x, t), whose zero set at time t is the surface.
    implicit: ImplicitRecipe {
        /// Where f(x, t) comes from: one "network", the paper's; or the "flow", which carries two
        /// end fields, each of the shape below, so that the level-set equation holds by itself.
        /// The terms level-set, transported-normals and their kind are of the network alone.
        geometry: GeometryKind = "flow" | "flow" | "flow" | "network",
            Rule::word(GeometryKind::WORDS);
        /// Hidden layers.
        depth: usize = 5 | 5 | 5 | 8, Rule::whole(1, 32);
        /// Units in each hidden layer.
        width: usize = 128 | 128 | 192 | 512, Rule::whole(4, 4096);
        /// Nonlinearity; the paper's is the softplus.
        activation: Activation = "sine" | "sine" | "sine" | "softplus",
            Rule::word(Activation::WORDS);
        /// With "sine" the frequency omega_0; with "softplus" its sharpness, which the paper leaves
        /// open and for which 100 is a good start.
        beta: f64 = 20 | 20 | 20 | 100, Rule::above_zero(1000.0);
        /// Frequencies of the positional encoding; the paper encodes, and leaves their number
        /// open.
        frequencies: usize = 0 | 0 | 0 | 6, Rule::whole(0, 16).zero("feeds x as it is");
        /// Radius of the sphere that f starts from; the paper's is 1, which is larger than the
        /// shapes.
        sphere_radius: f64 = 0.4 | 0.4 | 0.4 | 0.4, Rule::above_zero(10.0).unit("normalised units");
        /// Hidden layer that is given the input again; must be less than depth.
        skip: usize = 0 | 0 | 0 | 0, Rule::whole(0, 31).zero("gives it to none");
    }

    /// The network V, whose velocities carry the surface from the source to the target.
    velocity: VelocityRecipe {
        /// Hidden layers.
        depth: usize = 4 | 4 | 4 | 8, Rule::whole(1, 32);
        /// Units in each hidden layer.
        width: usize = 96 | 96 | 128 | 256, Rule::whole(4, 4096);
        /// Nonlinearity; the paper's is the softplus.
        activation: Activation = "softplus" | "softplus" | "softplus" | "softplus",
            Rule::word(Activation::WORDS);
        /// Sharpness of the softplus, which the paper leaves open; with "sine" the frequency
        /// omega_0, for which 4 to 8 is a good start.
        beta: f64 = 100 | 100 | 100 | 100, Rule::above_zero(1000.0);
        /// Frequencies of the positional encoding; the paper encodes, and leaves their number
        /// open.
        frequencies: usize = 0 | 0 | 0 | 6, Rule::whole(0, 16).zero("feeds x as it is");
        /// Hidden layer that is given the input again; must be less than depth.
        skip: usize = 0 | 0 | 0 | 0, Rule::whole(0, 31).zero("gives it to none");
        /// Whether V depends on the time as well; the paper writes V(x). With time, limbs may pass
        /// one place in different directions; it needs a price, such as loss.screw.
        time_dependent: bool = true | true | true | false, Rule::flag();
    }

    /// The weights of the objective's terms and what shapes them.
    loss: LossRecipe {
        /// Weight of the level-set equation, which ties f to V (the paper's lambda_f).
        level_set: f64 = 10 | 10 | 10 | 100,
            Rule::positive_or_zero().zero("trains f without the equation");
        /// Level-set equation: modified ("mlse", the paper's) or original ("olse", its ablation).
        level_set_form: LevelSetForm = "mlse" | "mlse" | "mlse" | "mlse",
            Rule::word(LevelSetForm::WORDS);
        /// Factor of the modification f R in "mlse"; the paper prints 10, but only 1 keeps
        /// |grad f| = 1 along the flow, and 10 destroys f.
        lambda_l: f64 = 1 | 1 | 1 | 1,
            Rule::positive_or_zero().zero("leaves the original equation");
        /// Weight of |(-alpha Laplacian + gamma) V| (the paper's lambda_v), the costliest term of V.
        smoothness: f64 = 0 | 0 | 0 | 20,
            Rule::positive_or_zero().zero("turns smoothness and its cost off");
        /// Factor alpha of the Laplacian in the smoothness term.
        smoothness_alpha: f64 = 0.01 | 0.01 | 0.01 | 0.01,
            Rule::positive_or_zero().zero("leaves the plain norm of V");
        /// Factor gamma of V itself in the smoothness term.
        smoothness_gamma: f64 = 1 | 1 | 1 | 1,
            Rule::positive_or_zero().zero("leaves the Laplacian alone");
        /// Weight of |div V|, which keeps the volume (the paper's lambda_v lambda_div, of which it
        /// leaves the second open).
        divergence: f64 = 2 | 2 | 2 | 20,
            Rule::positive_or_zero().zero("turns volume preservation off");
        /// Weight of the strain rate |(J + J^T)/2|^2 near the surface, which leaves rotations
        /// free; not in the paper; with a V of time it wants loss.screw beside it.
        strain: f64 = 3 | 3 | 3 | 0, Rule::positive_or_zero().zero("suits shapes that stretch");
        /// Strain rate beyond which the strain term grows linearly and not with the square, so that
        /// strain gathers in joints; 0.1 is a good start.
        strain_scale: f64 = 0 | 0 | 0 | 0,
            Rule::positive_or_zero().unit("per unit of time").zero("is the square everywhere");
        /// Weight of the strain rate without its change of size, near the surface; not in the
        /// paper; for shapes whose parts grow.
        deviatoric: f64 = 0 | 0 | 0 | 0, Rule::positive_or_zero().zero("turns it off");
        /// Weight of the strain rate within the surface, which needs normals; not in the paper;
        /// lets the space beside the surface shear.
        stretch: f64 = 0 | 0 | 0 | 0, Rule::positive_or_zero().zero("turns it off");
        /// Weight of the distance between carried points and their correspondences (the paper's
        /// lambda_m).
        matching: f64 = 200 | 200 | 200 | 200,
            Rule::positive_or_zero().zero("ignores the correspondences");
        /// The same weight while only V trains.
        matching_warm_up: f64 = 200 | 200 | 200 | 100,
            Rule::positive_or_zero().zero("ignores the correspondences then");
        /// Distance at which the Geman-McClure form lets go of a wrong pair, such as 0.05; it falls to
        /// that from ten times as much until ramp-until; the paper takes the plain distance.
        matching_scale: f64 = 0 | 0 | 0 | 0,
            Rule::positive_or_zero().unit("normalised units").zero("is the plain distance");
        /// Weight of |f| on the source at time 0 and the target at time 1 (the paper's lambda_m).
        data: f64 = 100 | 100 | 100 | 200, Rule::positive_or_zero().zero("frees f from the shapes");
        /// Weight of the angle between grad f and the normals at both ends; optional in the paper,
        /// which prints no weight.
        normals: f64 = 20 | 20 | 20 | 20, Rule::positive_or_zero().zero("ignores the normals");
        /// Weight of (|grad f| - 1)^2 at all times; not in the paper's total, but without it f
        /// collapses to zero.
        eikonal: f64 = 10 | 10 | 10 | 10, Rule::positive_or_zero().zero("lets f collapse");
        /// Weight of |f| at surface points carried to random times (of the flow: to the other shape);
        /// not in the paper; teaches V as well.
        on_surface: f64 = 100 | 100 | 100 | 0, Rule::positive_or_zero().zero("turns it off");
        /// Weight of the angle between grad f and the normals carried by V; not in the paper; the
        /// decisive term for the surfaces in between.
        transported_normals: f64 = 20 | 20 | 20 | 0, Rule::positive_or_zero().zero("turns it off");
        /// Weight of exp(-100 |f|) away from the surface; not in the paper; for shapes without
        /// normals, where 30 is a good start.
        off_surface: f64 = 0 | 0 | 0 | 0, Rule::positive_or_zero().zero("turns it off");
        /// Weight of |f - d| away from the surface at times 0 and 1, d the signed distance to the shape,
        /// which needs normals; not in the paper; of what is fitted at both ends, as the flow is: no
        /// surface is left where no point is.
        distance: f64 = 100 | 100 | 100 | 0, Rule::positive_or_zero().zero("turns it off");
        /// Weight of |dV/dt|^2, which steadies a time-dependent V; not in the paper; 1 to 10 is a
        /// good start.
        steadiness: f64 = 0 | 0 | 0 | 0, Rule::positive_or_zero().zero("turns it off");
        /// Weight of |dV/dt + D V|^2 near the surface, D the strain rate, which lets each part keep to
        /// a screw motion of its own; not in the paper; the fair price on a time-dependent V.
        screw: f64 = 30 | 30 | 30 | 0, Rule::positive_or_zero().zero("turns it off");
        /// Weight of |dV/dt + J V|^2 near the surface: straight paths at constant speed; not in the
        /// paper.
        acceleration: f64 = 0 | 0 | 0 | 0, Rule::positive_or_zero().zero("turns it off");
    }

    /// The steps of the optimiser and what each one samples.
    training: TrainingRecipe {
        /// Steps of the optimiser; the paper takes 10000.
        steps: usize = 1_000 | 6_000 | 10_000 | 10_000, Rule::whole(1, MANY);
        /// Points at which f is evaluated in each step; the paper takes 4000.
        batch: usize = 2_200 | 4_000 | 4_000 | 4_000, Rule::whole(64, 1_000_000);
        /// Correspondences carried in each step, all of them where fewer are known; the paper
        /// leaves it open.
        correspondence_batch: usize = 250 | 500 | 1_000 | 1_000, Rule::whole(1, 1_000_000);
        /// Learning rate of f; the paper's is 0.005. Softplus networks take 1e-3 to 2e-3.
        learning_rate: f64 = 5e-4 | 5e-4 | 3e-4 | 5e-3, Rule::above_zero(1.0);
        /// Learning rate of V; the paper has one for both.
        velocity_learning_rate: f64 = 2e-3 | 1e-3 | 1e-3 | 5e-3, Rule::above_zero(1.0);
        /// How the learning rates fall: "cosine" over the steps in which a network trains, or
        /// "step" (the paper's).
        schedule: Schedule = "cosine" | "cosine" | "cosine" | "step", Rule::word(Schedule::WORDS);
        /// Factor on the learning rates at each step of the "step" schedule.
        decay: f64 = 0.5 | 0.5 | 0.5 | 0.5, Rule::above_zero(1.0);
        /// Distance between those steps; the paper's is 2000 of 10000.
        decay_every: f64 = 0.2 | 0.2 | 0.2 | 0.2, Rule::above_zero(1.0).unit("share of the steps");
        /// Learning rate at the end of the "cosine" schedule.
        final_learning_rate: f64 = 0.02 | 0.02 | 0.02 | 0.02,
            Rule::number(0.0, 1.0).unit("share of the first one").zero("lets it fall to nothing");
        /// Until here only V trains; at most ramp-until and velocity-until.
        warm_up: f64 = 0.3 | 0.3 | 0.3 | 0.2,
            Rule::number(0.0, 1.0).unit("share of the steps").zero("trains f at once");
        /// Until here the weight of the level-set equation rises from 0.
        ramp_until: f64 = 0.4 | 0.4 | 0.4 | 0.5, Rule::number(0.0, 1.0).unit("share of the steps");
        /// From here only f trains.
        velocity_until: f64 = 1 | 1 | 1 | 0.8, Rule::number(0.0, 1.0).unit("share of the steps");
        /// Method that integrates trajectories; the paper's is Euler's. What it leaves out shows at
        /// the far end: over a turn of a radian, "midpoint" with 3 steps misses by 0.0185 of the
        /// distance from the axis, "rk4" with 2 by 0.0005.
        integrator: Integrator = "rk4" | "rk4" | "rk4" | "euler", Rule::word(Integrator::WORDS);
        /// Steps of the integrator from time 0 to 1, which the paper leaves open.
        time_steps: usize = 2 | 2 | 2 | 10, Rule::whole(1, 1000);
        /// Times at which the terms in between are sampled: "random", or the "grid" of the
        /// integrator's steps; the paper leaves it open.
        times: TimeSampling = "random" | "random" | "random" | "random",
            Rule::word(TimeSampling::WORDS);
        /// Derivatives by "nested" automatic differentiation or by one "forward" sweep: the same
        /// numbers; with the paper's Laplacian, nesting takes 1.9 times as long per step.
        derivatives: Derivatives = "nested" | "nested" | "nested" | "forward",
            Rule::word(Derivatives::WORDS);
        /// Share of the collocation points that lie near the surface; the others fill the box; the
        /// paper leaves it open.
        band_share: f64 = 0.75 | 0.75 | 0.75 | 0.75,
            Rule::number(0.0, 1.0).zero("puts all of them in the box");
        /// Standard deviations of the points near the surface about it, drawn in equal parts.
        band_widths: Vec<f64> = [0.01, 0.05] | [0.01, 0.05] | [0.01, 0.05] | [0.01, 0.05],
            Rule::list_above_zero(10.0).unit("normalised units");
        /// Margin of the box around both shapes.
        box_margin: f64 = 0.15 | 0.15 | 0.15 | 0.15, Rule::above_zero(1.0).unit("normalised units");
        /// Norm to which a longer gradient is cut; the paper cuts none.
        clip: f64 = 100 | 100 | 100 | 100, Rule::positive_or_zero().zero("cuts none");
        /// Seed of the initial weights and of every sample.
        seed: u64 = 0 | 0 | 0 | 0, Rule::whole(0, GREATEST_SEED);
        /// Steps between two lines of metrics.jsonl.
        log_every: usize = 10 | 10 | 10 | 10, Rule::whole(1, MANY).unit("steps");
    }

    /// What is kept so that a run can go on after an interruption.
    checkpoint: CheckpointRecipe {
        /// Steps between two checkpoints.
        every: usize = 200 | 1_000 | 1_000 | 1_000, Rule::whole(1, MANY).unit("steps");
        /// Newest checkpoints kept; older ones are deleted.
        keep: usize = 3 | 3 | 3 | 3, Rule::whole(1, MANY);
    }

    /// The surfaces that training leaves in the run when it ends.
    result: ResultRecipe {
        /// Surfaces, at even times from 0 to 1.
        frames: usize = 5 | 9 | 17 | 9, Rule::whole(0, 1000).zero("writes none");
        /// Cells of the extraction grid along the longest side of the box.
        resolution: usize = 192 | 256 | 384 | 192, Rule::whole(8, 1024);
        /// Pieces of a surface with less than this share of its area are left out: tips of fingers
        /// thinner than a cell, pockets where limbs press together.
        smallest_component: f64 = 1e-3 | 1e-3 | 1e-3 | 0,
            Rule::number(0.0, 1.0).zero("keeps every piece");
    }
}
