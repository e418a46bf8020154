//! The normals of a point cloud as training would estimate them.

use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use crate::error::{Error, Result};
use crate::formats::{Shape, SurfaceFormat, write_surface};
use crate::geometry::Mesh;
use crate::shape::estimate_normals;

/// Certainties from this on, up or down, are called clear.
const CLEAR: f64 = 0.25;

/// Normals of a cloud with how far to trust them.
#[derive(Clone, Debug, Serialize)]
pub struct Estimate {
    /// The points, with unit normals that point out of the shape.
    #[serde(skip)]
    pub cloud: Mesh<f64>,
    /// How many there are.
    pub points: usize,
    /// Share of the points whose side the cloud as a whole shows clearly, and it is this one.
    pub clear: f64,
    /// Share of those at which it clearly shows the other side.
    pub contradicted: f64,
    /// The estimate beside the normals of the file, if it has any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own: Option<AgainstOwn>,
    /// Wall-clock seconds.
    pub seconds: f64,
}

/// The estimate beside the normals that the file has.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct AgainstOwn {
    /// Share of the points whose two normals lie less than 90 degrees apart.
    pub same_side: f64,
    /// Median angle between the two lines, degrees.
    pub median_angle: f64,
}

/// Estimates the normals of a cloud; of a mesh the vertices are taken as a cloud.
pub fn estimate(cloud: &Shape) -> Estimate {
    let began = Instant::now();
    let found = estimate_normals(&cloud.mesh.vertices);
    let seconds = began.elapsed().as_secs_f64();
    let share = |is: fn(f64) -> bool| {
        let count = found.certainty.iter().filter(|&&x| is(x)).count();
        count as f64 / found.certainty.len() as f64
    };
    Estimate {
        points: found.normals.len(),
        clear: share(|certainty| certainty >= CLEAR),
        contradicted: share(|certainty| certainty <= -CLEAR),
        own: against_own(cloud, &found.normals),
        cloud: Mesh {
            vertices: cloud.mesh.vertices.clone(),
            triangles: Vec::new(),
            normals: Some(found.normals),
        },
        seconds,
    }
}

impl Estimate {
    /// Writes the points with their normals, as PLY or OBJ by the ending of the name.
    ///
    /// # Errors
    /// Another ending; what the file system says.
    pub fn write(&self, path: &Path) -> Result<()> {
        let format = SurfaceFormat::of(path)
            .ok_or_else(|| Error::usage(format!("{}: must end in .ply or .obj", path.display())))?;
        Ok(write_surface(&self.cloud, path, format)?)
    }
}

/// Nothing if the file has no normals, or none with a direction.
fn against_own(cloud: &Shape, estimated: &[[f32; 3]]) -> Option<AgainstOwn> {
    let own = cloud.mesh.normals.as_ref()?.iter().zip(estimated);
    let directed = own.filter(|(own, _)| **own != [0.0; 3]);
    let cosine = |(a, b): (&[f32; 3], &[f32; 3])| -> f64 {
        a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum()
    };
    let mut cosines: Vec<f64> = directed.map(cosine).collect();
    if cosines.is_empty() {
        return None;
    }
    let same = cosines.iter().filter(|&&cosine| cosine > 0.0).count();
    cosines.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let median = cosines[cosines.len() / 2].abs().min(1.0);
    Some(AgainstOwn {
        same_side: same as f64 / cosines.len() as f64,
        median_angle: median.acos().to_degrees(),
    })
}
