//! One PNG with the surfaces of a run side by side, so that people can look instead of read.
//!
//! All surfaces share one camera and one scale, so sizes and places compare. The projection is
//! orthographic. The colour runs from blue at time 0 over purple to orange at time 1. `camera.rs`
//! says what is seen, `raster.rs` draws it.

use std::io::Cursor;
use std::path::Path;

use image::{ImageFormat, Rgba, RgbaImage};
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use rayon::prelude::*;

use super::camera::Camera;
pub use super::camera::{Axis, Background, Frame, View};
use super::raster::Panel;
use crate::atomic::write_atomically;

/// Widest strip in pixels.
const WIDEST: usize = 16_384;
const LABEL_GREY: u8 = 105;

/// A strip that cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// Nothing to draw, or nowhere to draw it.
    #[error("{path}: {frames} surfaces, {height} pixels high: at least 1 of each is needed")]
    Empty {
        /// The file that was to be written.
        path: String,
        /// How many surfaces were given.
        frames: usize,
        /// Height of a panel as given.
        height: u32,
    },
    /// A surface with no vertices, a coordinate that is not finite, or an index out of range.
    #[error(
        "{path}: the surface at time {time} cannot be drawn: it needs vertices, all finite, and \
         triangles that name them; extract it again"
    )]
    Surface {
        /// The file that was to be written.
        path: String,
        /// Time of the surface.
        time: f32,
    },
    /// More pixels than a picture should have.
    #[error(
        "{path}: the strip would be {width} pixels wide: at most 16384; draw fewer surfaces or \
         lower the height"
    )]
    TooWide {
        /// The file that was to be written.
        path: String,
        /// The width that the strip would have.
        width: usize,
    },
    /// What the file system says; names the file.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

/// Draws surfaces side by side into one PNG, in the order given, each with its time below.
///
/// # Errors
/// No surface; a surface without vertices, with coordinates that are not finite or with wrong
/// indices; a height of 0; a strip more than 16,384 pixels wide; the file system's errors.
pub fn strip(frames: &[Frame<'_>], view: &View, path: &Path) -> Result<(), PictureError> {
    check(frames, view, path)?;
    let camera = Camera::new(frames, view);
    let width = camera.width * frames.len();
    if width > WIDEST {
        return Err(PictureError::TooWide {
            path: path.display().to_string(),
            width,
        });
    }
    let panels: Vec<Panel> = frames.par_iter().map(|frame| camera.draw(frame)).collect();
    let label_height = letter_height(view.height).val() as u32 * 5 / 4;
    let mut picture = RgbaImage::new(width as u32, view.height + label_height);
    for (i, (panel, frame)) in panels.iter().zip(frames).enumerate() {
        let left = (i * camera.width) as u32;
        for (place, &pixel) in panel.pixels.iter().enumerate() {
            let (x, y) = (place % camera.width, place / camera.width);
            picture.put_pixel(left + x as u32, y as u32, Rgba(pixel));
        }
        let middle = left + camera.width as u32 / 2;
        write_label(
            &mut picture,
            &format!("t = {:.2}", frame.time),
            middle,
            view.height,
        );
    }
    if view.background == Background::White {
        picture.pixels_mut().for_each(lay_on_white);
    }
    let mut png = Cursor::new(Vec::new());
    picture
        .write_to(&mut png, ImageFormat::Png)
        .map_err(std::io::Error::other)?;
    Ok(write_atomically(path, |out| out.write_all(png.get_ref()))?)
}

fn check(frames: &[Frame<'_>], view: &View, path: &Path) -> Result<(), PictureError> {
    let path = || path.display().to_string();
    if frames.is_empty() || view.height == 0 {
        let (frames, height) = (frames.len(), view.height);
        return Err(PictureError::Empty {
            path: path(),
            frames,
            height,
        });
    }
    for &Frame {
        vertices,
        triangles,
        time,
    } in frames
    {
        let finite = vertices.iter().flatten().all(|part| part.is_finite());
        let known = triangles
            .iter()
            .flatten()
            .all(|&vertex| (vertex as usize) < vertices.len());
        if vertices.is_empty() || !finite || !known {
            return Err(PictureError::Surface { path: path(), time });
        }
    }
    Ok(())
}

/// The font size that suits panels of this height.
fn letter_height(height: u32) -> RasterHeight {
    match height {
        0..240 => RasterHeight::Size16,
        240..320 => RasterHeight::Size20,
        320..480 => RasterHeight::Size24,
        480.. => RasterHeight::Size32,
    }
}

/// Writes centred text below `top`.
fn write_label(picture: &mut RgbaImage, text: &str, middle: u32, top: u32) {
    let size = letter_height(top);
    let letter_width = get_raster_width(FontWeight::Regular, size) as u32;
    let mut left = middle.saturating_sub(text.len() as u32 * letter_width / 2);
    for letter in text
        .chars()
        .filter_map(|c| get_raster(c, FontWeight::Regular, size))
    {
        for (y, row) in (top..).zip(letter.rows()) {
            for (x, &alpha) in (left..).zip(row) {
                if let Some(pixel) = picture.get_pixel_mut_checked(x, y) {
                    *pixel = Rgba([LABEL_GREY, LABEL_GREY, LABEL_GREY, alpha]);
                }
            }
        }
        left += letter_width;
    }
}

fn lay_on_white(pixel: &mut Rgba<u8>) {
    let [.., alpha] = pixel.0;
    let mix =
        |part: u8| (u32::from(part) * u32::from(alpha) + 255 * (255 - u32::from(alpha))) / 255;
    let [r, g, b, _] = pixel.0.map(|part| mix(part) as u8);
    pixel.0 = [r, g, b, 255];
}

#[cfg(test)]
mod tests {
    use super::*;

    type Ball = (Vec<[f32; 3]>, Vec<[u32; 3]>);

    /// A sphere of latitude and longitude bands, stretched along one axis.
    fn ball(radius: f32, stretched: usize, factor: f32) -> Ball {
        let (rows, columns) = (24_u32, 48_u32);
        let mut vertices = Vec::new();
        for row in 0..=rows {
            let (height, ring) = (std::f32::consts::PI * row as f32 / rows as f32).sin_cos();
            for column in 0..columns {
                let (y, x) = (std::f32::consts::TAU * column as f32 / columns as f32).sin_cos();
                let mut vertex = [height * x, height * y, ring].map(|part| radius * part);
                vertex[stretched] *= factor;
                vertices.push(vertex);
            }
        }
        let cell = |row: u32, column: u32| {
            let (a, b) = (
                row * columns + column,
                row * columns + (column + 1) % columns,
            );
            [[a, a + columns, b], [b, a + columns, b + columns]]
        };
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        (
            vertices,
            cells.flat_map(|(row, column)| cell(row, column)).collect(),
        )
    }

    fn drawn(balls: &[Ball], view: &View) -> RgbaImage {
        let frames: Vec<Frame<'_>> = balls
            .iter()
            .enumerate()
            .map(|(i, (vertices, triangles))| Frame {
                vertices,
                triangles,
                time: i as f32,
            })
            .collect();
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("strip.png");
        strip(&frames, view, &path).expect("a picture");
        image::open(&path).expect("a PNG").to_rgba8()
    }

    /// Without a ground shadow: from just below the horizon.
    const BARE: View = View {
        up: Axis::Y,
        azimuth: 0.0,
        elevation: -0.1,
        height: 200,
        background: Background::Transparent,
    };

    /// Columns and rows that hold opaque pixels of the panels, labels left out.
    fn opaque(picture: &RgbaImage, columns: std::ops::Range<u32>) -> (usize, usize) {
        let solid = |x: u32, y: u32| picture.get_pixel(x, y)[3] == 255;
        let wide = columns
            .clone()
            .filter(|&x| (0..200).any(|y| solid(x, y)))
            .count();
        let high = (0..200)
            .filter(|&y| columns.clone().any(|x| solid(x, y)))
            .count();
        (wide, high)
    }

    #[test]
    fn all_panels_have_one_scale_and_the_largest_surface_fills_its_panel() {
        let picture = drawn(&[ball(1.0, 0, 1.0), ball(0.5, 0, 1.0)], &BARE);
        let half = picture.width() / 2;
        let (wide, high) = opaque(&picture, 0..half);
        // 90 % of 200 pixels; two of its edges are only partly covered.
        assert!(
            (177..=180).contains(&wide) && (177..=180).contains(&high),
            "{wide} x {high}"
        );
        let (wide, high) = opaque(&picture, half..2 * half);
        assert!(
            (87..=90).contains(&wide) && (87..=90).contains(&high),
            "{wide} x {high}"
        );
    }

    #[test]
    fn the_up_axis_points_up_and_the_camera_turns_from_the_axis_after_it() {
        for (up, axis) in [(Axis::X, 0), (Axis::Y, 1), (Axis::Z, 2)] {
            let seen = |stretched: usize, azimuth: f32| {
                let view = View {
                    up,
                    azimuth,
                    ..BARE
                };
                let picture = drawn(&[ball(1.0, stretched, 2.0)], &view);
                opaque(&picture, 0..picture.width())
            };
            let (wide, high) = seen(axis, 0.0);
            assert!(
                high > 2 * wide - 6,
                "{up:?}: stretched upwards: {wide} x {high}"
            );
            let (wide, high) = seen((axis + 1) % 3, 0.0);
            assert!(
                wide.abs_diff(high) < 3,
                "{up:?}: stretched to the viewer: {wide} x {high}"
            );
            let (wide, high) = seen((axis + 1) % 3, 90.0);
            assert!(
                wide > 2 * high - 6,
                "{up:?}: stretched to the right: {wide} x {high}"
            );
        }
    }

    #[test]
    fn light_comes_from_the_upper_left_and_the_background_is_as_asked() {
        let clear = drawn(&[ball(1.0, 0, 1.0)], &BARE);
        let brightness = |x: u32, y: u32| -> u32 {
            clear.get_pixel(x, y).0[..3]
                .iter()
                .map(|&part| u32::from(part))
                .sum()
        };
        assert!(brightness(70, 60) > brightness(130, 140) + 60);
        assert_eq!(clear.get_pixel(2, 2)[3], 0);
        let white = drawn(
            &[ball(1.0, 0, 1.0)],
            &View {
                background: Background::White,
                ..BARE
            },
        );
        assert_eq!(white.get_pixel(2, 2).0, [255; 4]);
    }

    #[test]
    fn what_cannot_be_drawn_is_refused_and_leaves_no_file() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("strip.png");
        let (vertices, triangles) = ball(1.0, 0, 1.0);
        let refused = |vertices: &[[f32; 3]], triangles: &[[u32; 3]], count: usize, height: u32| {
            let frames = vec![
                Frame {
                    vertices,
                    triangles,
                    time: 0.5
                };
                count
            ];
            let view = View { height, ..BARE };
            let message = strip(&frames, &view, &path)
                .expect_err("no picture")
                .to_string();
            assert!(message.contains("strip.png") && !path.exists(), "{message}");
            message
        };
        assert!(refused(&vertices, &triangles, 0, 100).contains("0 surfaces"));
        assert!(refused(&vertices, &triangles, 1, 0).contains("0 pixels high"));
        assert!(refused(&[], &[], 1, 100).contains("time 0.5"));
        assert!(refused(&[[f32::NAN; 3]], &[], 1, 100).contains("time 0.5"));
        assert!(refused(&vertices, &[[0, 1, 9999]], 1, 100).contains("time 0.5"));
        assert!(refused(&vertices, &triangles, 20, 1000).contains("pixels wide"));
    }
}
