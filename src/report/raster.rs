//! A small software rasteriser: one lit, smooth, antialiased surface with a shadow on the ground.
//!
//! Triangles are drawn into a depth buffer with three samples per pixel along each axis; each
//! sample is lit by a key light from the upper left of the camera, a weaker one from the right, and
//! the sky, in linear light; samples are averaged to pixels and encoded as sRGB. The shadow is the
//! surface laid flat on the ground, blurred.

/// Samples per pixel along each axis.
const SAMPLES: usize = 3;
/// Directions from the surface to the lights in camera coordinates (right, up, to the viewer; unit
/// length), and their strengths.
const KEY: ([f32; 3], f32) = ([-0.45, 0.66, 0.60], 0.80);
const FILL: ([f32; 3], f32) = ([0.84, 0.10, 0.53], 0.22);
/// Light from everywhere; it comes in full from above and a third of it from below.
const SKY: f32 = 0.28;
/// A soft highlight: its strength and sharpness.
const SHINE: (f32, f32) = (0.07, 24.0);
/// Surface colours at times 0, 1/2 and 1 in linear light; blue straight to orange would pass grey.
const COLOURS: [[f32; 3]; 3] = [[0.13, 0.36, 0.70], [0.50, 0.28, 0.56], [0.90, 0.40, 0.11]];
/// How dark the shadow is at most, and its blur as a share of the panel height.
const SHADOW: f32 = 0.30;
const SHADOW_BLUR: f32 = 0.02;

/// A surface in the coordinates of its panel.
pub(super) struct Projected<'a> {
    /// Pixels to the right, pixels down, and pixels towards the viewer.
    pub(super) points: Vec<[f32; 3]>,
    /// Unit normals in camera coordinates: right, up, to the viewer.
    pub(super) normals: Vec<[f32; 3]>,
    /// The points laid on the ground, if that is seen from above.
    pub(super) shadow: Option<Vec<[f32; 3]>>,
    pub(super) triangles: &'a [[u32; 3]],
    /// The direction away from the ground in camera coordinates.
    pub(super) up: [f32; 3],
    /// Time in [0, 1], for the colour.
    pub(super) time: f32,
    pub(super) width: usize,
    pub(super) height: usize,
}

/// A drawn surface: rows of sRGB pixels with straight alpha.
pub(super) struct Panel {
    pub(super) pixels: Vec<[u8; 4]>,
}

/// Draws one surface and its shadow.
pub(super) fn draw_panel(surface: &Projected<'_>) -> Panel {
    let (width, height) = (surface.width * SAMPLES, surface.height * SAMPLES);
    let mut depth = vec![f32::NEG_INFINITY; width * height];
    let mut light = vec![[0.0_f32; 3]; width * height];
    let colour = colour_at(surface.time);
    for triangle in surface.triangles {
        let corner = triangle.map(|vertex| vertex as usize);
        let points = corner.map(|vertex| scaled(surface.points[vertex], SAMPLES as f32));
        let normals = corner.map(|vertex| surface.normals[vertex]);
        // y points down here: triangles that face the viewer wind with negative area.
        let side = if twice_area(&points) < 0.0 { 1.0 } else { -1.0 };
        for_each_sample(&points, width, height, |place, share| {
            let z = mix(share, points.map(|point| point[2]));
            if z > depth[place] {
                depth[place] = z;
                let normal = std::array::from_fn(|i| side * mix(share, normals.map(|n| n[i])));
                light[place] = lit(normal, surface.up, colour);
            }
        });
    }
    let shadow = shadow(surface);
    let pixel = |place: usize| {
        let (x, y) = (place % surface.width, place / surface.width);
        let mut sum = [0.0; 3];
        let mut covered = 0.0;
        for sample in (0..SAMPLES * SAMPLES)
            .map(|k| (y * SAMPLES + k / SAMPLES) * width + x * SAMPLES + k % SAMPLES)
        {
            if depth[sample] > f32::NEG_INFINITY {
                sum = std::array::from_fn(|i| sum[i] + light[sample][i]);
                covered += 1.0;
            }
        }
        let all = (SAMPLES * SAMPLES) as f32;
        let alpha = covered / all + (1.0 - covered / all) * SHADOW * shadow[place];
        let [r, g, b] = sum.map(|part| srgb(part / all / alpha.max(f32::MIN_POSITIVE)));
        [r, g, b, (alpha * 255.0).round() as u8]
    };
    Panel {
        pixels: (0..surface.width * surface.height).map(pixel).collect(),
    }
}

/// The surface's colour at a time in [0, 1].
fn colour_at(time: f32) -> [f32; 3] {
    let half = usize::from(time > 0.5);
    let (from, to, share) = (COLOURS[half], COLOURS[half + 1], 2.0 * time - half as f32);
    std::array::from_fn(|i| from[i] + (to[i] - from[i]) * share)
}

/// How much of the shadow falls on each pixel, 0 to 1.
fn shadow(surface: &Projected<'_>) -> Vec<f32> {
    let (width, height) = (surface.width, surface.height);
    let mut cover = vec![0.0; width * height];
    if let Some(laid) = &surface.shadow {
        for triangle in surface.triangles {
            let points = triangle.map(|vertex| laid[vertex as usize]);
            for_each_sample(&points, width, height, |place, _| cover[place] = 1.0);
        }
        let radius = (SHADOW_BLUR * height as f32).round() as usize;
        // Three box blurs are nearly a Gaussian one. Seen at a slant, circles on the ground are
        // flat, so the blur is too.
        let flat = (radius as f32 * surface.up[2]).ceil() as usize;
        for _ in 0..3 {
            cover = blurred(&cover, width, 1, radius);
            cover = blurred(&cover, width, width, flat);
        }
    }
    cover
}

/// The mean over `2 radius + 1` pixels along rows (`step` 1) or columns (`step` the width); 0
/// beyond the edges.
fn blurred(cover: &[f32], width: usize, step: usize, radius: usize) -> Vec<f32> {
    let length = if step == 1 {
        width
    } else {
        cover.len() / width
    };
    let mut out = vec![0.0; cover.len()];
    for line in 0..cover.len() / length {
        let start = if step == 1 { line * width } else { line };
        let at = |i: usize| cover[start + i * step];
        let mut sum: f32 = (0..radius.min(length)).map(at).sum();
        for i in 0..length {
            if i + radius < length {
                sum += at(i + radius);
            }
            out[start + i * step] = sum / (2 * radius + 1) as f32;
            if i >= radius {
                sum -= at(i - radius);
            }
        }
    }
    out
}

/// Calls `visit` with the index of every sample whose centre the triangle covers, and with the
/// shares of the three corners there.
fn for_each_sample(
    points: &[[f32; 3]; 3],
    width: usize,
    height: usize,
    mut visit: impl FnMut(usize, [f32; 3]),
) {
    let area = twice_area(points);
    if area == 0.0 {
        return;
    }
    let range = |axis: usize, end: usize| {
        let along = points.map(|point| point[axis]);
        let low = along.into_iter().fold(f32::INFINITY, f32::min) - 0.5;
        let high = along.into_iter().fold(f32::NEG_INFINITY, f32::max) - 0.5;
        // Casts from negative numbers to `usize` give 0.
        low.ceil() as usize..((high.floor() + 1.0) as usize).min(end)
    };
    let [a, b, c] = *points;
    for y in range(1, height) {
        for x in range(0, width) {
            let p = [x as f32 + 0.5, y as f32 + 0.5, 0.0];
            let share_a = twice_area(&[p, b, c]) / area;
            let share_b = twice_area(&[a, p, c]) / area;
            let share = [share_a, share_b, 1.0 - share_a - share_b];
            if share.iter().all(|&part| part >= 0.0) {
                visit(y * width + x, share);
            }
        }
    }
}

/// Twice the signed area on the screen.
fn twice_area([a, b, c]: &[[f32; 3]; 3]) -> f32 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The light that a point of the surface sends to the viewer.
fn lit(normal: [f32; 3], up: [f32; 3], colour: [f32; 3]) -> [f32; 3] {
    let n = unit(normal);
    let lamp = |(direction, strength): ([f32; 3], f32)| strength * dot(n, direction).max(0.0);
    let sky = SKY * (2.0 + dot(n, up)) / 3.0;
    let diffuse = lamp(KEY) + lamp(FILL) + sky;
    // The viewer is at (0, 0, 1), infinitely far away.
    let half_way = unit([KEY.0[0], KEY.0[1], KEY.0[2] + 1.0]);
    let shine = SHINE.0 * dot(n, half_way).max(0.0).powf(SHINE.1);
    colour.map(|part| part * diffuse + shine)
}

fn unit(x: [f32; 3]) -> [f32; 3] {
    scaled(x, 1.0 / dot(x, x).sqrt().max(f32::MIN_POSITIVE))
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn scaled(x: [f32; 3], factor: f32) -> [f32; 3] {
    x.map(|part| part * factor)
}

fn mix(share: [f32; 3], values: [f32; 3]) -> f32 {
    dot(share, values)
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
    fn a_blur_keeps_the_sum_and_is_symmetric() {
        let mut cover = vec![0.0; 9 * 7];
        cover[3 * 9 + 4] = 1.0;
        let wide = blurred(&cover, 9, 1, 2);
        assert_eq!(
            wide[3 * 9..4 * 9],
            [0.0, 0.0, 0.2, 0.2, 0.2, 0.2, 0.2, 0.0, 0.0]
        );
        let both = blurred(&wide, 9, 9, 1);
        // A running sum of thirds of fifths: f32 rounding.
        assert!((both.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        assert!((both[2 * 9 + 2] - both[4 * 9 + 6]).abs() < 1e-6);
        assert_eq!(blurred(&cover, 9, 1, 0), cover);
    }

    #[test]
    fn a_triangle_covers_the_samples_whose_centres_it_holds_however_it_winds() {
        let mut points = [[0.0, 0.0, 1.0], [4.0, 0.0, 2.0], [0.0, 4.0, 3.0]];
        for _ in 0..2 {
            let mut found = Vec::new();
            for_each_sample(&points, 8, 8, |place, share| {
                let [x, y] = [place % 8, place / 8].map(|index| index as f32 + 0.5);
                let z = mix(share, points.map(|point| point[2]));
                // The plane through the corners; f32 rounding.
                assert!(
                    (z - (1.0 + x / 4.0 + y / 2.0)).abs() < 1e-5,
                    "{z} at {x}, {y}"
                );
                found.push(place);
            });
            // Centres on the long side, x + y = 4, count.
            assert_eq!(found, [0, 1, 2, 3, 8, 9, 10, 16, 17, 24]);
            points.swap(1, 2);
        }
        for_each_sample(
            &[[0.0; 3], [4.0, 4.0, 0.0], [8.0, 8.0, 0.0]],
            8,
            8,
            |_, _| panic!("a triangle without area covers nothing"),
        );
    }

    #[test]
    fn the_nearer_of_two_triangles_is_seen_whichever_is_drawn_first() {
        // The far one faces the viewer, the near one is edged towards the right-hand light.
        let square = [[0.0, 0.0], [0.0, 20.0], [20.0, 0.0]];
        let at = |z: f32| square.map(|[x, y]| [x, y, z]);
        let seen = |triangles: &[[u32; 3]]| {
            let panel = draw_panel(&Projected {
                points: [at(0.0), at(5.0)].concat(),
                normals: [[[0.0, 0.0, 1.0]; 3], [[0.8, 0.0, 0.6]; 3]].concat(),
                shadow: None,
                triangles,
                up: [0.0, 1.0, 0.0],
                time: 0.0,
                width: 10,
                height: 10,
            });
            panel.pixels[2 * 10 + 2]
        };
        let (far, near) = ([0, 1, 2], [3, 4, 5]);
        assert_ne!(seen(&[far]), seen(&[near]));
        assert_eq!(seen(&[far, near]), seen(&[near]));
        assert_eq!(seen(&[near, far]), seen(&[near]));
    }

    #[test]
    fn grey_light_is_encoded_as_the_standard_says() {
        // 0.2140 is the linear value of sRGB 127.5 (IEC 61966-2-1): the middle of the byte range.
        assert_eq!(
            [srgb(-1.0), srgb(0.0), srgb(0.2158), srgb(1.0), srgb(7.0)],
            [0, 0, 128, 255, 255]
        );
    }
}
