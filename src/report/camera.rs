//! The camera of a strip: orthographic, and one for all its panels.
//!
//! A surface is turned into camera coordinates (right, up, towards the viewer) and scaled so that
//! all surfaces of the strip and their shadows just fit into panels of the given height.

use super::raster::{Panel, Projected, draw_panel};
use crate::geometry::vertex_normals;

/// Empty border round the surfaces, as a share of the panel height.
const MARGIN: f32 = 0.05;

/// A coordinate axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axis {
    /// The first coordinate.
    X,
    /// The second coordinate; up in most character animation files.
    #[default]
    Y,
    /// The third coordinate; up in most scans and CAD files.
    Z,
}

/// What lies behind the surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Background {
    /// Opaque white.
    #[default]
    White,
    /// Nothing: the surfaces, their shadows and grey labels on any page.
    Transparent,
}

/// From where and how large the surfaces are seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The axis that points up in the picture. Nothing in a mesh says which one it is: y is the
    /// default because most animated models use it.
    pub up: Axis,
    /// Turn of the camera about the up axis in degrees. At 0 it looks at the shape from the axis
    /// that follows `up` cyclically (z for y, x for z), at 90 from the one after that.
    pub azimuth: f32,
    /// Height of the camera over the horizon in degrees, -90 to 90.
    pub elevation: f32,
    /// Height of one panel in pixels without its label; the width follows from the surfaces.
    pub height: u32,
    /// What lies behind the surfaces.
    pub background: Background,
}

impl Default for View {
    /// From the front and a little from the side and above; y up; 320 pixels; white.
    fn default() -> Self {
        let (up, background) = (Axis::Y, Background::White);
        Self {
            up,
            azimuth: 35.0,
            elevation: 14.0,
            height: 320,
            background,
        }
    }
}

/// One surface of a strip.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// Vertex positions.
    pub vertices: &'a [[f32; 3]],
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
    /// Time in [0, 1]: the label and the colour.
    pub time: f32,
}

/// One orthographic camera for all panels.
pub(super) struct Camera {
    /// Directions in the surface's coordinates: to the right, up, and towards the viewer.
    axes: [[f32; 3]; 3],
    /// The surface's up axis in camera coordinates.
    up: [f32; 3],
    /// What is in the middle of each panel, in camera coordinates.
    centre: [f32; 3],
    /// Ground level along the up axis.
    ground: f32,
    up_axis: usize,
    /// Pixels per unit of length.
    scale: f32,
    pub(super) width: usize,
    pub(super) height: usize,
}

impl Camera {
    /// The camera that just shows all the surfaces and their shadows.
    pub(super) fn new(frames: &[Frame<'_>], view: &View) -> Self {
        let up_axis = view.up as usize;
        let axes = camera_axes(
            up_axis,
            view.azimuth.to_radians(),
            view.elevation.to_radians(),
        );
        let all = || frames.iter().flat_map(|frame| frame.vertices);
        let ground = all()
            .map(|vertex| vertex[up_axis])
            .fold(f32::INFINITY, f32::min);
        let mut low = [f32::INFINITY; 3];
        let mut high = [f32::NEG_INFINITY; 3];
        for &vertex in all() {
            let mut shadow = vertex;
            shadow[up_axis] = ground;
            for point in [vertex, shadow].map(|point| turned(&axes, point)) {
                low = std::array::from_fn(|axis| low[axis].min(point[axis]));
                high = std::array::from_fn(|axis| high[axis].max(point[axis]));
            }
        }
        let height = view.height as usize;
        let free = view.height as f32 * (1.0 - 2.0 * MARGIN);
        let sides: [f32; 3] = std::array::from_fn(|axis| high[axis] - low[axis]);
        // A flat or tiny shape must not make the panel wider than four times its height.
        let scale = free / sides[1].max(sides[0] / 4.0).max(f32::MIN_POSITIVE);
        let width = (sides[0] * scale + view.height as f32 * 2.0 * MARGIN).ceil() as usize;
        Self {
            axes,
            up: axes.map(|axis| axis[up_axis]),
            centre: std::array::from_fn(|axis| low[axis] + sides[axis] / 2.0),
            ground,
            up_axis,
            scale,
            width,
            height,
        }
    }

    /// Pixels to the right and down, and pixels towards the viewer.
    fn project(&self, vertex: [f32; 3]) -> [f32; 3] {
        let point = turned(&self.axes, vertex);
        let [x, y, z] = std::array::from_fn(|axis| (point[axis] - self.centre[axis]) * self.scale);
        [self.width as f32 / 2.0 + x, self.height as f32 / 2.0 - y, z]
    }

    pub(super) fn draw(&self, frame: &Frame<'_>) -> Panel {
        let normals = vertex_normals(frame.vertices, frame.triangles);
        let on_ground = |&vertex: &[f32; 3]| {
            let mut vertex = vertex;
            vertex[self.up_axis] = self.ground;
            self.project(vertex)
        };
        draw_panel(&Projected {
            points: frame
                .vertices
                .iter()
                .map(|&vertex| self.project(vertex))
                .collect(),
            normals: normals
                .into_iter()
                .map(|normal| turned(&self.axes, normal))
                .collect(),
            // From below, the ground would hide the surface instead of catching its shadow.
            shadow: (self.up[2] > 0.0).then(|| frame.vertices.iter().map(on_ground).collect()),
            triangles: frame.triangles,
            up: self.up,
            time: frame.time.clamp(0.0, 1.0),
            width: self.width,
            height: self.height,
        })
    }
}

fn camera_axes(up_axis: usize, azimuth: f32, elevation: f32) -> [[f32; 3]; 3] {
    let (front, side) = ((up_axis + 1) % 3, (up_axis + 2) % 3);
    let mut right = [0.0; 3];
    (right[front], right[side]) = (-azimuth.sin(), azimuth.cos());
    let mut level = [0.0; 3];
    (level[front], level[side]) = (azimuth.cos(), azimuth.sin());
    let (mut up, mut viewer) = (
        level.map(|part| -elevation.sin() * part),
        level.map(|part| elevation.cos() * part),
    );
    up[up_axis] = elevation.cos();
    viewer[up_axis] = elevation.sin();
    [right, up, viewer]
}

fn turned(axes: &[[f32; 3]; 3], x: [f32; 3]) -> [f32; 3] {
    axes.map(|axis| axis[0] * x[0] + axis[1] * x[1] + axis[2] * x[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn camera_directions_are_orthonormal_and_right_handed() {
        for up_axis in 0..3 {
            let [right, up, viewer] = camera_axes(up_axis, 0.7, 0.3);
            let dot = |a: [f32; 3], b: [f32; 3]| (0..3).map(|i| a[i] * b[i]).sum::<f32>();
            let next = |i: usize| (i + 1) % 3;
            let cross: [f32; 3] = std::array::from_fn(|i| {
                right[next(i)] * up[next(next(i))] - right[next(next(i))] * up[next(i)]
            });
            // f32 rounding of sines and cosines.
            assert!((dot(right, right) - 1.0).abs() < 1e-6 && dot(right, up).abs() < 1e-6);
            assert!(
                (dot(cross, viewer) - 1.0).abs() < 1e-6,
                "{cross:?} and {viewer:?}"
            );
        }
    }
}
