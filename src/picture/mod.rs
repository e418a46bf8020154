//! Surfaces with their times as one PNG, side by side, or as a moving picture.
//!
//! | file | what it holds |
//! |---|---|
//! | `camera.rs` | from where the surfaces are seen: one camera and one scale for all |
//! | `film.rs` | the same one after the other, as a moving picture |
//! | `canvas.rs` | pixels in rows, and PNG |
//! | `raster.rs` | how one surface is drawn: depth buffer, light, colour of its time |
//!
//! Arrows run one way: `picture -> geometry` (normals of a mesh), `picture -> atomic`.

mod camera;
mod canvas;
mod film;
mod raster;

use std::io;
use std::path::Path;

use glam::Vec3;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use rayon::prelude::*;

use crate::atomic::write_atomically;
use crate::geometry::vertex_normals;
use camera::Camera;
pub(crate) use camera::View;
use canvas::Canvas;
pub(crate) use film::film;
use raster::Projected;

const WHITE: [u8; 3] = [255; 3];
/// Height of the letters of a label, and how many a panel has room for.
const LETTERS: RasterHeight = RasterHeight::Size24;
const LABEL: usize = 9;
/// How dark labels are on white, 0 to 1.
const INK: f32 = 0.6;

/// One surface of a strip.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame<'a> {
    /// Vertex positions.
    pub vertices: &'a [[f32; 3]],
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
    /// Time in [0, 1]: the colour from blue over purple to orange.
    pub time: f32,
    /// The time as the label has it.
    pub named: f64,
}

/// A strip that cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PictureError {
    /// No surface, or no room for one.
    #[error("{0}: nothing to draw; give at least one surface and a height of at least one pixel")]
    Empty(String),
    /// A surface without vertices, with a coordinate that is not finite, an index out of range, or a
    /// time outside [0, 1].
    #[error(
        "{0}: the surface at time {1} cannot be drawn: it needs vertices, all finite, and triangles that name them; \
         extract it again"
    )]
    Surface(String, f64),
    /// What the file system says; names the file.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Draws surfaces side by side into one PNG, in the order given, each with its time below.
///
/// # Errors
/// [`PictureError`]; then no file is written.
pub(crate) fn strip(frames: &[Frame<'_>], view: &View, path: &Path) -> Result<(), PictureError> {
    check(frames, view, path)?;
    let points = frames.iter().flat_map(|frame| frame.vertices);
    let camera = Camera::new(points.map(|&point| point.into()), view, text_width(LABEL));
    let panels: Vec<_> = frames
        .par_iter()
        .map(|frame| draw(frame, &camera))
        .collect();
    let width = camera.width * frames.len();
    let mut picture = Canvas::new(width, view.height as usize + LETTERS.val(), WHITE);
    for (number, (pixels, frame)) in panels.iter().zip(frames).enumerate() {
        place(
            &mut picture,
            pixels,
            frame.named,
            &camera,
            number * camera.width,
        );
    }
    let png = picture.png().map_err(io::Error::other)?;
    Ok(write_atomically(path, |out| out.write_all(&png))?)
}

/// Puts a surface that was drawn into a picture, from column `left` on, with its time below.
fn place(picture: &mut Canvas, pixels: &[[u8; 3]], time: f64, camera: &Camera, left: usize) {
    for (place, &pixel) in pixels.iter().enumerate() {
        let (x, y) = (left + place % camera.width, place / camera.width);
        picture.put(x, y, pixel);
    }
    let label = format!("t = {}", short(time));
    write(picture, &label, left + camera.width / 2, camera.height);
}

/// A time in at most five letters, where that is possible.
fn short(time: f64) -> String {
    match time.abs() {
        0.0..10.0 => format!("{time:.2}"),
        10.0..1000.0 => format!("{time:.1}"),
        _ => format!("{time:.0}"),
    }
}

fn check(frames: &[Frame<'_>], view: &View, path: &Path) -> Result<(), PictureError> {
    let path = path.display().to_string();
    if frames.is_empty() || view.height == 0 {
        return Err(PictureError::Empty(path));
    }
    let is_drawable = |frame: &&Frame<'_>| {
        let count = frame.vertices.len();
        let mut coordinates = frame.vertices.as_flattened().iter();
        let mut indices = frame.triangles.as_flattened().iter();
        count > 0
            && (0.0..=1.0).contains(&frame.time)
            && coordinates.all(|part| part.is_finite())
            && indices.all(|&vertex| (vertex as usize) < count)
    };
    match frames.iter().find(|frame| !is_drawable(frame)) {
        Some(frame) => Err(PictureError::Surface(path, frame.named)),
        None => Ok(()),
    }
}

fn draw(frame: &Frame<'_>, camera: &Camera) -> Vec<[u8; 3]> {
    let points = frame.vertices.iter();
    let normals = vertex_normals(frame.vertices, frame.triangles);
    let surface = Projected {
        points: points.map(|&point| camera.project(point.into())).collect(),
        normals: normals
            .into_iter()
            .map(|normal| camera.turn * Vec3::from(normal))
            .collect(),
        triangles: frame.triangles,
        time: frame.time,
    };
    raster::draw(&surface, camera.width, camera.height)
}

/// Pixels of a text of so many letters.
fn text_width(letters: usize) -> usize {
    letters * get_raster_width(FontWeight::Regular, LETTERS)
}

/// Writes a text below `top`, centred.
fn write(picture: &mut Canvas, text: &str, middle: usize, top: usize) {
    let mut left = middle - text_width(text.len()) / 2;
    let letters = text.chars();
    for letter in letters.filter_map(|letter| get_raster(letter, FontWeight::Regular, LETTERS)) {
        for (y, row) in (top..).zip(letter.rows()) {
            for (x, &ink) in (left..).zip(row) {
                picture.put(x, y, [255 - (INK * f32::from(ink)) as u8; 3]);
            }
        }
        left += text_width(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Ball = (Vec<[f32; 3]>, Vec<[u32; 3]>);

    /// From the front, y up.
    const FRONT: View = View {
        azimuth: 0.0,
        elevation: 0.0,
        height: 200,
    };

    /// A sphere of latitude and longitude bands.
    fn ball(radius: f32) -> Ball {
        let (rows, columns) = (24_u32, 48_u32);
        let place = |row: u32, column: u32| {
            let (ring, height) = (std::f32::consts::PI * row as f32 / rows as f32).sin_cos();
            let (y, x) = (std::f32::consts::TAU * column as f32 / columns as f32).sin_cos();
            [ring * x, ring * y, height].map(|part| radius * part)
        };
        let cells = || (0..=rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        let corners = |(row, column): (u32, u32)| {
            let [a, b] = [column, (column + 1) % columns].map(|side| row * columns + side);
            [[a, a + columns, b], [b, a + columns, b + columns]]
        };
        let vertices = cells().map(|(row, column)| place(row, column)).collect();
        let triangles = cells().filter(|cell| cell.0 < rows).flat_map(corners);
        (vertices, triangles.collect())
    }

    fn drawn(balls: &[Ball]) -> Canvas {
        let frames: Vec<Frame<'_>> = (0u32..)
            .zip(balls)
            .map(|(number, (vertices, triangles))| Frame {
                vertices,
                triangles,
                time: number as f32,
                named: f64::from(number),
            })
            .collect();
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("strip.png");
        strip(&frames, &FRONT, &path).expect("a picture");
        Canvas::read(&path)
    }

    #[test]
    fn all_panels_have_one_scale_and_the_largest_surface_fills_its_panel() {
        let picture = drawn(&[ball(1.0), ball(0.5)]);
        let half = picture.width() / 2;
        let is_inked = |x: usize, y: usize| picture.get(x, y) != WHITE;
        for (columns, size) in [(0..half, 176_usize), (half..2 * half, 88)] {
            let wide = columns
                .clone()
                .filter(|&x| (0..200).any(|y| is_inked(x, y)));
            let high = (0..200).filter(|&y| columns.clone().any(|x| is_inked(x, y)));
            // 88 % of 200 pixels, and half of that; an edge may touch one more pixel at either end.
            for found in [wide.count(), high.count()] {
                assert!((size - 2..=size + 2).contains(&found), "{found} for {size}");
            }
        }
        let is_labelled = |columns: std::ops::Range<usize>| {
            columns
                .into_iter()
                .any(|x| (200..picture.height()).any(|y| is_inked(x, y)))
        };
        assert!(is_labelled(0..half) && is_labelled(half..2 * half));
    }

    #[test]
    fn light_comes_from_the_upper_left_and_the_colour_follows_the_time() {
        let picture = drawn(&[ball(1.0), ball(1.0)]);
        let half = picture.width() / 2;
        let brightness = |x: usize, y: usize| picture.get(x, y).map(u32::from).iter().sum::<u32>();
        assert!(brightness(70, 60) > brightness(130, 140) + 60);
        let [red, _, blue] = picture.get(100, 100);
        assert!(blue > red, "at time 0");
        let [red, _, blue] = picture.get(half + 100, 100);
        assert!(red > blue, "at time 1");
    }

    #[test]
    fn what_cannot_be_drawn_is_refused_and_leaves_no_file() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("strip.png");
        let (vertices, triangles) = ball(1.0);
        let refused = |vertices: &[[f32; 3]], triangles: &[[u32; 3]], count: usize, height: u32| {
            let frame = Frame {
                vertices,
                triangles,
                time: 0.5,
                named: 0.5,
            };
            let view = View { height, ..FRONT };
            let error = strip(&vec![frame; count], &view, &path).expect_err("no picture");
            let message = error.to_string();
            assert!(message.contains("strip.png") && !path.exists(), "{message}");
            message
        };
        assert!(refused(&vertices, &triangles, 0, 100).contains("nothing to draw"));
        assert!(refused(&vertices, &triangles, 1, 0).contains("nothing to draw"));
        assert!(refused(&[], &[], 1, 100).contains("time 0.5"));
        assert!(refused(&[[f32::NAN; 3]], &[], 1, 100).contains("time 0.5"));
        assert!(refused(&vertices, &[[0, 1, 9999]], 1, 100).contains("time 0.5"));
    }
}
