//! From where the surfaces of a strip are seen: one orthographic camera for all panels.
//!
//! A point `x` of a surface is turned into camera coordinates `R x` (right, up, towards the viewer)
//! and scaled so that the largest surface just fits into a panel.

use glam::{Mat3, Vec3};

/// Empty border round the surfaces, as a share of the panel's height.
const MARGIN: f32 = 0.06;

/// From where and how large the surfaces are seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct View {
    /// Turn of the camera about the y axis, which is up, in degrees. At 0 the camera stands on the z
    /// axis, at 90 on the x axis.
    pub azimuth: f32,
    /// Height of the camera over the horizon in degrees, -90 to 90.
    pub elevation: f32,
    /// Height of one panel in pixels without its label; the width follows from the surfaces.
    pub height: u32,
}

impl Default for View {
    /// From the front and a little from the side and above; y up; 320 pixels.
    fn default() -> Self {
        Self {
            azimuth: 35.0,
            elevation: 14.0,
            height: 320,
        }
    }
}

/// The camera that just shows all surfaces of a strip.
pub(super) struct Camera {
    /// Rows: the directions to the right, up, and towards the viewer.
    pub(super) turn: Mat3,
    /// What lies in the middle of a panel, in camera coordinates.
    centre: Vec3,
    /// Pixels per unit of length.
    scale: f32,
    /// Size of a panel in pixels.
    pub(super) width: usize,
    pub(super) height: usize,
}

impl Camera {
    /// A camera on these points, at least one, with panels of `least_width` or more.
    pub(super) fn new(points: impl Iterator<Item = Vec3>, view: &View, least_width: usize) -> Self {
        let turn = directions(view);
        let (low, high) = points.map(|point| turn * point).fold(
            (Vec3::INFINITY, Vec3::NEG_INFINITY),
            |(low, high), point| (low.min(point), high.max(point)),
        );
        let size = high - low;
        let height = view.height as f32;
        let border = 2.0 * MARGIN * height;
        // The panel of a flat or tiny shape is at most four times as wide as high.
        let scale = (height - border) / size.y.max(size.x / 4.0).max(f32::MIN_POSITIVE);
        let width = (size.x * scale + border).ceil() as usize;
        Self {
            turn,
            centre: low + size / 2.0,
            scale,
            width: width.max(least_width),
            height: view.height as usize,
        }
    }

    /// Pixels to the right, pixels down, and pixels towards the viewer.
    pub(super) fn project(&self, point: Vec3) -> Vec3 {
        let Vec3 { x, y, z } = (self.turn * point - self.centre) * self.scale;
        Vec3::new(self.width as f32 / 2.0 + x, self.height as f32 / 2.0 - y, z)
    }
}

/// The camera's directions as rows: a right-handed orthonormal basis.
fn directions(view: &View) -> Mat3 {
    let vector = |front: f32, side: f32, up: f32| Vec3::new(side, up, front);
    let (sin_a, cos_a) = view.azimuth.to_radians().sin_cos();
    let (sin_e, cos_e) = view.elevation.to_radians().sin_cos();
    let right = vector(-sin_a, cos_a, 0.0);
    let up = vector(-sin_e * cos_a, -sin_e * sin_a, cos_e);
    let viewer = vector(cos_e * cos_a, cos_e * sin_a, sin_e);
    Mat3::from_cols(right, up, viewer).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(azimuth: f32) -> View {
        View {
            azimuth,
            elevation: 0.0,
            height: 100,
        }
    }

    #[test]
    fn y_points_up_and_the_camera_turns_from_z_to_x() {
        for (azimuth, front) in [(0.0, Vec3::Z), (90.0, Vec3::X)] {
            let turn = directions(&view(azimuth));
            // f32 rounding of sines and cosines.
            assert!((turn * Vec3::Y).abs_diff_eq(Vec3::Y, 1e-6), "{azimuth}");
            assert!((turn * front).abs_diff_eq(Vec3::Z, 1e-6), "{azimuth}");
            assert!((turn.determinant() - 1.0).abs() < 1e-6, "{azimuth}");
        }
    }

    #[test]
    fn the_points_fill_the_panel_up_to_its_margin() {
        let corners = || {
            [[-1.0, -2.0, 5.0], [3.0, 4.0, 5.0]]
                .map(Vec3::from)
                .into_iter()
        };
        let view = view(0.0);
        let camera = Camera::new(corners(), &view, 10);
        // 6 units fill 88 of 100 rows, 4 units 58.67 columns; with the border, rounded up.
        assert_eq!((camera.width, camera.height), (71, 100));
        let seen: Vec<Vec3> = corners().map(|corner| camera.project(corner)).collect();
        // f32 rounding.
        assert!((seen[0].y - 94.0).abs() < 1e-3 && (seen[1].y - 6.0).abs() < 1e-3);
        assert!((seen[1].x - seen[0].x - 58.667).abs() < 1e-3, "{seen:?}");
        assert_eq!(Camera::new(corners(), &view, 90).width, 90);
    }
}
