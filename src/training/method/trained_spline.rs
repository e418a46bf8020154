//! Splines beside end fields that are networks (`velocity.kind = "trained-spline"`): `V` begins as the field that
//! Gauss-Newton finds, and stays so until `training.guided-until`. From there on it is trained like a network, with
//! every term of the motion.

use burn::module::ParamId;
use isomorph_model::{SplineGrid, SplineVelocity, TrainBackend};
use isomorph_spline::TimeBasis;

use super::FIXED_OPTIMISER;
use super::flow::{EndsAndFlow, FLOW, FlowVelocity};
use super::spec::{Acts, Keys, MethodSpec, Needs};
use super::spline::SplineKeys;
use crate::data::{Bounds, Guide};
use crate::recipe::VelocityKind;
use crate::recipe::schema::Keyed;
use crate::records::{RecordError, Records};
use crate::settings::Settings;

/// Splines as `V`, and networks as `f`.
pub(super) static TRAINED_SPLINE: MethodSpec = MethodSpec {
    name: FLOW.name,
    geometry: None,
    velocity: Some(VelocityKind::TrainedSpline),
    about: "two end fields that are networks, carried by splines that are solved for and then trained",
    citation: FLOW.citation,
    needs: Needs::NOTHING,
    is_baseline: false,
    acts: Acts {
        implicit: Keys::All,
        velocity: Keys::Only(&["kind", "time-dependent"]),
        loss: Keys::AllBut(&[
            "level-set",
            "level-set-form",
            "lambda-l",
            "transported-normals",
        ]),
        // Splines have no hidden layers.
        training: Keys::AllBut(&["velocity-muon-rate"]),
    },
    own: Some(SplineKeys::SECTION),
    fixed: &[
        FIXED_OPTIMISER[0],
        ("spline", "V is solved for before the first step"),
    ],
    changes: &[],
    takes_many: false,
    many: &[],
    steps_of_interval: None,
};

/// End fields and splines.
pub(super) type EndsAndSpline<B> = EndsAndFlow<B, SplineVelocity<B>>;

impl<B: TrainBackend> FlowVelocity<B> for SplineVelocity<B> {
    const IS_GUIDE: bool = true;

    /// One cell at rest: the guide or a checkpoint brings the grid.
    fn new(settings: &Settings, bounds: &Bounds, device: &B::Device) -> Self {
        let grid = SplineGrid {
            lower: bounds.min,
            spacing: bounds.extent().into_iter().fold(1e-3, f32::max),
            cells: [1; 3],
        };
        let basis = match settings.velocity.time_dependent {
            true => TimeBasis::Linear,
            false => TimeBasis::Constant,
        };
        Self::at_rest(grid, basis, device).expect("one cell of some size")
    }

    fn hidden_weights(&self) -> Vec<ParamId> {
        Vec::new()
    }

    fn of_guide(guide: &dyn Guide, device: &B::Device) -> Option<Self> {
        let field = guide.splines()?;
        Some(Self::from_field(field, device))
    }

    fn like_record(
        &self,
        records: &Records,
        name: &str,
        device: &B::Device,
    ) -> Result<Self, RecordError> {
        let grid: SplineGrid = records.constant(name, "grid")?;
        let (basis, bytes) = (
            self.time_basis(),
            records.bytes(name).map_or(0, <[u8]>::len),
        );
        // Before there is memory for them.
        let nodes: f64 = grid
            .cells
            .iter()
            .map(|&cells| f64::from(cells) + 2.0)
            .product();
        let least = nodes * (3 * basis.functions() * size_of::<f32>()) as f64;
        if least > bytes as f64 {
            let problem = format!("grid has {nodes} nodes, more than there are coefficients");
            return Err(RecordError::new(name, problem));
        }
        Self::at_rest(grid, basis, device)
            .map_err(|error| RecordError::new(name, format!("grid: {error}")))
    }

    fn grid(&self) -> Option<SplineGrid> {
        Some(*self.grid())
    }
}
