//! `f` and `V` on a grid, as an archive of numpy: for programs that know nothing of networks.

use std::io::{self, Write};
use std::path::Path;

use zip::write::{SimpleFileOptions, ZipWriter};

use super::trained::Trained;
use crate::atomic::write_atomically;
use crate::error::{Error, Result};

/// The most nodes of all times together: 16 bytes each.
const MOST_NODES: usize = 1 << 28;

/// Nodes that are evaluated at once.
const AT_A_TIME: usize = 1 << 16;

/// A grid of `f` and `V`.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldGrid {
    /// Nodes along each axis.
    pub nodes: [usize; 3],
    /// Times.
    pub times: usize,
    /// Whether the file has `V`: some methods move no points.
    pub has_velocity: bool,
}

/// Numbers at normalised places at a time, in the coordinates of the shapes.
type Values<'a> = dyn Fn(&[[f32; 3]], f64) -> Vec<f32> + 'a;

impl Trained {
    /// Writes `f` and `V` at the nodes of a grid over the box of the run, as a `.npz` archive of 32-bit arrays in
    /// the coordinates and the unit of the shapes:
    ///
    /// | array | shape | |
    /// |---|---|---|
    /// | `times` | `[t]` | the times |
    /// | `x`, `y`, `z` | `[nx]`, `[ny]`, `[nz]` | the coordinates of the nodes, 64-bit |
    /// | `f` | `[t, nx, ny, nz]` | signed distance, negative inside |
    /// | `velocity` | `[t, nx, ny, nz, 3]` | of what moves points: displacement per unit of time |
    ///
    /// `nodes`: along the longest side, 2 or more. `progress` is given the nodes done so far, and all.
    ///
    /// # Errors
    /// A time out of range, too many nodes, a method without a field, a file that cannot be written.
    pub fn write_field(
        &self,
        nodes: usize,
        times: &[f64],
        path: &Path,
        mut progress: impl FnMut(usize, usize),
    ) -> Result<FieldGrid> {
        let clock = self.clock();
        let units: Result<Vec<f64>> = times.iter().map(|t| clock.unit(*t)).collect();
        let units = units?;
        let learned = self.learned();
        let field = learned.deformation.field().ok_or_else(|| {
            let text = "this method has no distance field; it carries the source's mesh";
            Error::usage(text)
        })?;
        let motion = learned.deformation.motion();
        let axes = self.axes(nodes, &units)?;
        let counts = axes.each_ref().map(Vec::len);
        let count: usize = counts.iter().product();
        if count.saturating_mul(times.len()) > MOST_NODES {
            return Err(Error::usage(format!(
                "{} nodes at {} times: at most {MOST_NODES} in all; take fewer of either",
                count,
                times.len()
            )));
        }
        let all = count * times.len() * if motion.is_some() { 2 } else { 1 };
        let mut done = 0;
        let mut each = |out: &mut dyn Write, values: &Values<'_>| {
            for &time in &units {
                for chunk in self.places(&axes, time).chunks(AT_A_TIME) {
                    let found = values(chunk, time).into_iter();
                    let bytes: Vec<u8> = found.flat_map(f32::to_le_bytes).collect();
                    out.write_all(&bytes)?;
                    done += chunk.len();
                    progress(done, all);
                }
            }
            Ok::<_, io::Error>(())
        };
        write_atomically(path, |out| {
            let mut archive = ZipWriter::new_stream(out);
            let [nx, ny, nz] = counts;
            array(&mut archive, "times", "<f8", &[times.len()])?;
            archive.write_all(&bytes(times))?;
            for (name, axis) in ["x", "y", "z"].into_iter().zip(&axes) {
                array(&mut archive, name, "<f8", &[axis.len()])?;
                archive.write_all(&bytes(axis))?;
            }
            array(&mut archive, "f", "<f4", &[times.len(), nx, ny, nz])?;
            each(&mut archive, &|points, time| {
                let place = learned.coordinates.at(time);
                let own = |value: f32| place.invert_length(f64::from(value)) as f32;
                field.values(points, time).into_iter().map(own).collect()
            })?;
            if let Some(motion) = motion {
                array(
                    &mut archive,
                    "velocity",
                    "<f4",
                    &[times.len(), nx, ny, nz, 3],
                )?;
                each(&mut archive, &|points, time| {
                    let found = motion.velocities(points, time);
                    let found = learned.coordinates.velocities(time, points, &found);
                    let parts = found.into_flattened().into_iter();
                    parts.map(|part| (part / clock.length()) as f32).collect()
                })?;
            }
            archive.finish()?;
            Ok(())
        })?;
        Ok(FieldGrid {
            nodes: counts,
            times: times.len(),
            has_velocity: motion.is_some(),
        })
    }

    /// The nodes, normalised at a time, those along z following one another.
    fn places(&self, [x, y, z]: &[Vec<f64>; 3], time: f64) -> Vec<[f32; 3]> {
        let place = self.learned().coordinates.at(time);
        let mut places = Vec::with_capacity(x.len() * y.len() * z.len());
        for &x in x {
            for &y in y {
                places.extend(z.iter().map(|&z| place.apply([x, y, z])));
            }
        }
        places
    }

    /// The coordinates of the nodes along each axis of the box, or of the box round those of all times.
    fn axes(&self, nodes: usize, times: &[f64]) -> Result<[Vec<f64>; 3]> {
        if nodes < 2 {
            return Err(Error::usage(format!("{nodes} nodes: must be 2 or more")));
        }
        let learned = self.learned();
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let some = if times.is_empty() { &[0.0] } else { times };
        for &time in some {
            let place = learned.coordinates.at(time);
            for corner in learned.bounds.corners() {
                let x = place.invert(corner);
                low = [0, 1, 2].map(|axis| low[axis].min(x[axis]));
                high = [0, 1, 2].map(|axis| high[axis].max(x[axis]));
            }
        }
        let longest = (0..3)
            .map(|axis| high[axis] - low[axis])
            .fold(0.0, f64::max);
        let apart = longest / (nodes - 1) as f64;
        Ok([0, 1, 2].map(|axis| {
            // The longest side has all of its nodes, whatever the rounding.
            let count = ((high[axis] - low[axis]) / apart - 1e-6).ceil() as usize + 1;
            (0..count).map(|k| low[axis] + apart * k as f64).collect()
        }))
    }
}

/// Begins an array of an archive.
fn array<W: Write + io::Seek>(
    archive: &mut ZipWriter<W>,
    name: &str,
    kind: &str,
    shape: &[usize],
) -> io::Result<()> {
    // Sizes beyond 4 GiB are allowed, and nothing is compressed: numpy reads it as it is.
    let options = SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Stored)
        .large_file(true);
    archive.start_file(format!("{name}.npy"), options)?;
    archive.write_all(&npy_header(kind, shape))
}

/// The header of a `.npy` file, version 1.0; the numbers follow it, the last side running fastest.
pub(super) fn npy_header(kind: &str, shape: &[usize]) -> Vec<u8> {
    let sides: String = shape.iter().map(|side| format!("{side}, ")).collect();
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({sides}), }}");
    // The numbers begin at a multiple of 64 bytes.
    let length = (10 + text.len() + 1).next_multiple_of(64) - 10;
    text.extend(std::iter::repeat_n(' ', length - text.len() - 1));
    text.push('\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend((length as u16).to_le_bytes());
    header.extend(text.as_bytes());
    header
}

/// Numbers as they stand in such a file.
pub(super) fn bytes(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}
