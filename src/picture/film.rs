//! Surfaces one after the other in a moving picture: an animated PNG, which browsers play and all else shows as
//! its first frame.

use std::io;
use std::path::Path;

use png::{BitDepth, ColorType, Encoder, EncodingError};
use rayon::prelude::*;

use super::camera::Camera;
use super::canvas::Canvas;
use super::{Frame, LABEL, LETTERS, PictureError, View, WHITE, check, draw, place, text_width};
use crate::atomic::write_atomically;

/// Milliseconds for which the first and the last surface stand still.
const HELD: u16 = 600;

/// Draws surfaces one after the other, there and back without end, each with its time below; `seconds` ascend and say
/// when each is shown.
///
/// # Errors
/// [`PictureError`]; then no file is written.
pub(crate) fn film(
    frames: &[Frame<'_>],
    seconds: &[f32],
    view: &View,
    path: &Path,
) -> Result<(), PictureError> {
    check(frames, view, path)?;
    let points = frames.iter().flat_map(|frame| frame.vertices);
    let camera = Camera::new(points.map(|&point| point.into()), view, text_width(LABEL));
    let pictures: Vec<Canvas> = frames
        .par_iter()
        .map(|frame| {
            let size = [camera.width, camera.height + LETTERS.val()];
            let mut picture = Canvas::new(size[0], size[1], WHITE);
            place(&mut picture, &draw(frame, &camera), frame.named, &camera, 0);
            picture
        })
        .collect();
    let bytes = animated(&pictures, &order(seconds)).map_err(io::Error::other)?;
    Ok(write_atomically(path, |out| out.write_all(&bytes))?)
}

/// The frames there and back, each with the milliseconds for which it is shown.
fn order(seconds: &[f32]) -> Vec<(usize, u16)> {
    let last = seconds.len() - 1;
    let back = (1..last).rev();
    let shown = (0..=last).chain(back).map(|k| {
        if k == 0 || k == last {
            return (k, HELD);
        }
        let until = (seconds[k + 1] - seconds[k - 1]) / 2.0;
        (k, (1000.0 * until).round().max(1.0) as u16)
    });
    shown.collect()
}

/// An animated PNG of these pictures, which are of one size.
fn animated(pictures: &[Canvas], order: &[(usize, u16)]) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    let [width, height] = pictures[0].size().map(|side| side as u32);
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    if order.len() > 1 {
        // Again and again.
        encoder.set_animated(order.len() as u32, 0)?;
    }
    let mut writer = encoder.write_header()?;
    for &(k, milliseconds) in order {
        if order.len() > 1 {
            writer.set_frame_delay(milliseconds, 1000)?;
        }
        writer.write_image_data(pictures[k].bytes())?;
    }
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frames_go_there_and_back_and_stand_at_the_ends() {
        assert_eq!(
            order(&[0.0, 0.5, 2.0]),
            [(0, HELD), (1, 1000), (2, HELD), (1, 1000)]
        );
        assert_eq!(order(&[0.0, 2.0]), [(0, HELD), (1, HELD)]);
        assert_eq!(order(&[0.5]), [(0, HELD)]);
    }

    #[test]
    fn the_file_is_an_animation_of_all_frames() {
        let corners = [[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]; 3];
        let frames: Vec<Frame<'_>> = (corners.iter().zip([0.0, 0.5, 1.0]))
            .map(|(vertices, time)| Frame {
                vertices,
                triangles: &[[0, 1, 2]],
                time,
                named: f64::from(time),
            })
            .collect();
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("film.png");
        film(&frames, &[0.0, 1.0, 2.0], &View::default(), &path).expect("a picture");
        let file = io::BufReader::new(std::fs::File::open(&path).expect("a file"));
        let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
        let control = reader.info().animation_control().copied();
        assert_eq!(control.map(|control| control.num_frames), Some(4));
        let mut bytes = vec![0; reader.output_buffer_size().expect("a size that fits")];
        for _ in 0..4 {
            reader.next_frame(&mut bytes).expect("whole pixels");
        }
        assert!(reader.next_frame(&mut bytes).is_err(), "four frames");
    }
}
