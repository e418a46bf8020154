//! Draws one surface: triangles into a depth buffer, smoothly shaded, nine samples to a pixel.
//!
//! Light of a lamp to the upper left of the camera and ambient light fall on a point
//! with the interpolated normal `n = (x, y, z)` (right, up, to the viewer):
//!
//! `light = colour (LAMP ((1 + n . l) / 2)² + SKY (2 + y + z) / 4)`
//!
//! The square ("half Lambert") fades out behind the surface's edge, so that the far side keeps its form.
//!
//! Light is added up linearly; pixels are encoded as sRGB.

use glam::{Vec3, Vec3Swizzles};

/// Samples per pixel along each axis.
const SAMPLES: usize = 3;
/// The direction to the lamp in camera coordinates (right, up, to the viewer), not normalised.
const LAMP_AT: Vec3 = Vec3::new(-0.45, 0.66, 0.60);
const LAMP: f32 = 0.85;
/// Ambient light: more of it from above and from the viewer.
const SKY: f32 = 0.30;
/// Colours at times 0, 1/2 and 1 in linear light; a mixture of blue and orange alone would be grey.
const COLOURS: [Vec3; 3] = [
    Vec3::new(0.13, 0.36, 0.70),
    Vec3::new(0.50, 0.28, 0.56),
    Vec3::new(0.90, 0.40, 0.11),
];

/// A surface in the coordinates of its panel.
pub(super) struct Projected<'a> {
    /// Pixels to the right, pixels down, and pixels towards the viewer.
    pub(super) points: Vec<Vec3>,
    /// Unit normals in camera coordinates: right, up, to the viewer.
    pub(super) normals: Vec<Vec3>,
    /// Corners of the triangles.
    pub(super) triangles: &'a [[u32; 3]],
    /// Time in [0, 1], for the colour.
    pub(super) time: f32,
}

/// Rows of sRGB pixels: the surface on white.
pub(super) fn draw(surface: &Projected<'_>, width: usize, height: usize) -> Vec<[u8; 3]> {
    let (columns, rows) = (width * SAMPLES, height * SAMPLES);
    let mut depth = vec![f32::NEG_INFINITY; columns * rows];
    let mut light = vec![Vec3::ONE; columns * rows];
    let colour = colour_at(surface.time);
    for triangle in surface.triangles {
        let corner = triangle.map(|vertex| vertex as usize);
        let points = corner.map(|vertex| surface.points[vertex] * SAMPLES as f32);
        let normals = corner.map(|vertex| surface.normals[vertex]);
        // y points down here: triangles that face the viewer wind with negative area. Of the others
        // the inside is seen.
        let side = if twice_area(points) < 0.0 { 1.0 } else { -1.0 };
        for_each_sample(points, columns, rows, |place, share| {
            let mixed =
                |values: [Vec3; 3]| values[0] * share.x + values[1] * share.y + values[2] * share.z;
            let z = mixed(points).z;
            if z > depth[place] {
                depth[place] = z;
                light[place] = colour * brightness(side * mixed(normals));
            }
        });
    }
    let pixel = |place: usize| {
        let (left, top) = (place % width * SAMPLES, place / width * SAMPLES);
        let rows = (top..top + SAMPLES).map(|row| &light[row * columns + left..][..SAMPLES]);
        let sum: Vec3 = rows.flatten().sum();
        (sum / (SAMPLES * SAMPLES) as f32).to_array().map(srgb)
    };
    (0..width * height).map(pixel).collect()
}

/// The surface's colour at a time in [0, 1].
fn colour_at(time: f32) -> Vec3 {
    let half = usize::from(time > 0.5);
    COLOURS[half].lerp(COLOURS[half + 1], 2.0 * time - half as f32)
}

/// The share of its colour that a point with this normal sends to the viewer.
fn brightness(normal: Vec3) -> f32 {
    let normal = normal.normalize_or_zero();
    let lamp = (1.0 + normal.dot(LAMP_AT.normalize())) / 2.0;
    LAMP * lamp * lamp + SKY * (2.0 + normal.y + normal.z) / 4.0
}

/// Calls `visit` with the index of every sample whose centre the triangle covers, and with the
/// shares of the three corners there (barycentric coordinates).
fn for_each_sample(
    points: [Vec3; 3],
    columns: usize,
    rows: usize,
    mut visit: impl FnMut(usize, Vec3),
) {
    let [a, b, c] = points;
    let area = twice_area(points);
    if area == 0.0 {
        return;
    }
    // Centres lie half a sample beside the index. Casts from negative numbers to `usize` give 0.
    let low = (a.min(b).min(c) - 0.5).ceil();
    let high = (a.max(b).max(c) + 0.5).floor();
    for y in low.y as usize..rows.min(high.y as usize) {
        for x in low.x as usize..columns.min(high.x as usize) {
            let p = Vec3::new(x as f32 + 0.5, y as f32 + 0.5, 0.0);
            let share_a = twice_area([p, b, c]) / area;
            let share_b = twice_area([a, p, c]) / area;
            let share = Vec3::new(share_a, share_b, 1.0 - share_a - share_b);
            if share.min_element() >= 0.0 {
                visit(y * columns + x, share);
            }
        }
    }
}

/// Twice the signed area on the screen.
fn twice_area([a, b, c]: [Vec3; 3]) -> f32 {
    (b - a).xy().perp_dot((c - a).xy())
}

/// Linear light in [0, 1] as an sRGB byte (IEC 61966-2-1).
fn srgb(linear: f32) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    };
    (encoded * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_covers_the_samples_whose_centres_it_holds_however_it_winds() {
        let corners = [[0.0, 0.0, 1.0], [4.0, 0.0, 2.0], [0.0, 4.0, 3.0]].map(Vec3::from);
        for points in [corners, [corners[0], corners[2], corners[1]]] {
            let mut found = Vec::new();
            for_each_sample(points, 8, 8, |place, share| {
                let z = share.dot(Vec3::from(points.map(|point| point.z)));
                let [x, y] = [place % 8, place / 8].map(|index| index as f32 + 0.5);
                // The plane through the corners; f32 rounding.
                assert!(
                    (z - (1.0 + x / 4.0 + y / 2.0)).abs() < 1e-5,
                    "{z} at {x}, {y}"
                );
                found.push(place);
            });
            // Centres on the long side, x + y = 4, count.
            assert_eq!(found, [0, 1, 2, 3, 8, 9, 10, 16, 17, 24]);
        }
        let line = [0.0, 4.0, 8.0].map(Vec3::splat);
        for_each_sample(line, 8, 8, |_, _| {
            panic!("a triangle without area covers nothing")
        });
    }

    #[test]
    fn the_nearer_of_two_triangles_is_drawn_whatever_their_order() {
        let at = |z: f32| [[0.0, 0.0, z], [0.0, 20.0, z], [20.0, 0.0, z]].map(Vec3::from);
        let seen = |triangles: &[[u32; 3]]| {
            let surface = Projected {
                points: [at(0.0), at(5.0)].concat(),
                // The far one faces the viewer, the near one the lamp's other side.
                normals: [[Vec3::Z; 3], [Vec3::X; 3]].concat(),
                triangles,
                time: 0.0,
            };
            draw(&surface, 10, 10)[2 * 10 + 2]
        };
        let (far, near) = ([0, 1, 2], [3, 4, 5]);
        assert_ne!(seen(&[far]), seen(&[near]));
        assert_eq!(seen(&[far, near]), seen(&[near]));
        assert_eq!(seen(&[near, far]), seen(&[near]));
        assert_eq!(seen(&[]), [255; 3]);
    }

    #[test]
    fn grey_light_is_encoded_as_the_standard_says() {
        // 0.2159 is the linear light of the byte 128 (IEC 61966-2-1).
        let bytes = [-1.0, 0.0, 0.2159, 1.0, 7.0].map(srgb);
        assert_eq!(bytes, [0, 0, 128, 255, 255]);
    }
}
