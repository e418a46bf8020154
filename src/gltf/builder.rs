//! Accessors over one buffer, and the container around it.
//!
//! A GLB file is a header of 12 bytes, a chunk of JSON and a chunk of bytes, each padded to 4.

use serde_json::{Value, json};

/// How numbers are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// As 32-bit floating-point numbers, which every reader understands.
    #[default]
    Full,
    /// Positions as 16-bit and normals as 8-bit integers, by KHR_mesh_quantization: half of the size, off by
    /// 2e-5 of the shape, and not understood by every reader.
    Compact,
}

/// Why a file cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum GltfError {
    /// The format counts bytes in 32 bits.
    #[error(
        "{bytes} bytes: a GLB file holds at most 4294967295; ask for fewer times or a lower resolution"
    )]
    TooLarge {
        /// What it would take.
        bytes: usize,
    },
}

/// Whether a shape of so many vertices at so many times can be one file, to be asked before anything is computed.
///
/// # Errors
/// [`GltfError::TooLarge`] if its positions and normals alone are too many.
pub(crate) fn check_size(
    vertices: usize,
    times: usize,
    is_mesh: bool,
    precision: Precision,
) -> Result<(), GltfError> {
    let (position, normal) = match precision {
        Precision::Full => (12, 12),
        Precision::Compact => (8, 4),
    };
    let each = if is_mesh { position + normal } else { position };
    let bytes = vertices.saturating_mul(times).saturating_mul(each);
    match u32::try_from(bytes) {
        Ok(_) => Ok(()),
        Err(_) => Err(GltfError::TooLarge { bytes }),
    }
}

/// The extension that allows positions and normals to be integers.
pub(super) const QUANTISED: &str = "KHR_mesh_quantization";

/// The component types of glTF.
const I8: u32 = 5120;
const I16: u32 = 5122;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

/// What a view of the buffer is for, as glTF numbers it.
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// The largest index of 16 bits: 65535 means that a strip starts again.
const LARGEST_U16: u32 = 65534;

/// Collects the data of a file: each method adds one accessor and returns its number.
#[derive(Default)]
pub(super) struct Builder {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Builder {
    /// Bytes as they are, such as a picture; the number of their view.
    pub(super) fn view(&mut self, bytes: impl IntoIterator<Item = u8>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - start;
        let view = json!({"buffer": 0, "byteOffset": start, "byteLength": length});
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, view: usize, of: u32, count: usize, kind: &str) -> usize {
        let accessor =
            json!({"bufferView": view, "componentType": of, "count": count, "type": kind});
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn vertices(&mut self, bytes: impl IntoIterator<Item = u8>, stride: usize) -> usize {
        let view = self.view(bytes);
        self.views[view]["target"] = json!(VERTICES);
        self.views[view]["byteStride"] = json!(stride);
        view
    }

    /// Floating-point vectors, one for each vertex; with their bounds where they are positions.
    pub(super) fn vectors<const N: usize>(&mut self, values: &[[f32; N]], bounds: bool) -> usize {
        let bytes = values.iter().flatten().flat_map(|part| part.to_le_bytes());
        let view = self.vertices(bytes, 4 * N);
        let at = self.accessor(view, F32, values.len(), &format!("VEC{N}"));
        if bounds {
            self.bound(at, values.iter().map(|value| value.map(f64::from)));
        }
        at
    }

    /// Positions in 0 to 1, as 16-bit numbers.
    pub(super) fn unit_positions(&mut self, values: &[[f32; 3]]) -> usize {
        let whole = |x: &[f32; 3]| x.map(|part| (part.clamp(0.0, 1.0) * 65535.0).round() as u16);
        let whole: Vec<[u16; 3]> = values.iter().map(whole).collect();
        let bytes = whole
            .iter()
            .flat_map(|&[x, y, z]| [x, y, z, 0])
            .flat_map(u16::to_le_bytes);
        let view = self.vertices(bytes, 8);
        self.normalised(view, U16, whole.iter().map(|x| x.map(f64::from)), true)
    }

    /// Displacements in -1 to 1, as 16-bit numbers.
    pub(super) fn unit_displacements(&mut self, values: &[[f32; 3]]) -> usize {
        let whole = |x: &[f32; 3]| x.map(|part| (part.clamp(-1.0, 1.0) * 32767.0).round() as i16);
        let whole: Vec<[i16; 3]> = values.iter().map(whole).collect();
        let bytes = whole
            .iter()
            .flat_map(|&[x, y, z]| [x, y, z, 0])
            .flat_map(i16::to_le_bytes);
        let view = self.vertices(bytes, 8);
        self.normalised(view, I16, whole.iter().map(|x| x.map(f64::from)), true)
    }

    /// Normals, or their changes, as 8-bit numbers. A change beyond 1 is cut off: the light is then slightly
    /// wrong where a surface turns by more than a right angle.
    pub(super) fn unit_normals(&mut self, values: &[[f32; 3]]) -> usize {
        let whole = |x: &[f32; 3]| x.map(|part| (part.clamp(-1.0, 1.0) * 127.0).round() as i8);
        let whole: Vec<[i8; 3]> = values.iter().map(whole).collect();
        let bytes = whole
            .iter()
            .flat_map(|&[x, y, z]| [x, y, z, 0])
            .flat_map(i8::to_le_bytes);
        let view = self.vertices(bytes, 4);
        self.normalised(view, I8, whole.iter().map(|x| x.map(f64::from)), false)
    }

    fn normalised(
        &mut self,
        view: usize,
        of: u32,
        values: impl ExactSizeIterator<Item = [f64; 3]>,
        bounds: bool,
    ) -> usize {
        let at = self.accessor(view, of, values.len(), "VEC3");
        self.accessors[at]["normalized"] = json!(true);
        if bounds {
            self.bound(at, values);
        }
        at
    }

    /// Colours of red, green, blue and opacity, 0 to 1 and linear in light, as 16-bit numbers.
    pub(super) fn colours(&mut self, values: &[[f32; 4]]) -> usize {
        let whole = |part: &f32| ((part.clamp(0.0, 1.0) * 65535.0).round() as u16).to_le_bytes();
        let view = self.vertices(values.iter().flatten().flat_map(whole), 8);
        let at = self.accessor(view, U16, values.len(), "VEC4");
        self.accessors[at]["normalized"] = json!(true);
        at
    }

    /// The corners of triangles; 16 bits each where that is enough for so many vertices.
    pub(super) fn triangles(&mut self, triangles: &[[u32; 3]], vertices: usize) -> usize {
        let corners = triangles.iter().flatten();
        let is_narrow = vertices <= LARGEST_U16 as usize + 1;
        let view = match is_narrow {
            true => self.view(corners.flat_map(|corner| (*corner as u16).to_le_bytes())),
            false => self.view(corners.flat_map(|corner| corner.to_le_bytes())),
        };
        self.views[view]["target"] = json!(INDICES);
        let of = if is_narrow { U16 } else { U32 };
        self.accessor(view, of, 3 * triangles.len(), "SCALAR")
    }

    /// Ascending times of an animation, in seconds.
    pub(super) fn times(&mut self, seconds: &[f32]) -> usize {
        let at = self.numbers(seconds, "SCALAR", 1);
        self.bound(at, seconds.iter().map(|time| [f64::from(*time)]));
        at
    }

    /// What an animation sets, `parts` numbers for each value.
    pub(super) fn numbers(&mut self, values: &[f32], kind: &str, parts: usize) -> usize {
        let view = self.view(values.iter().flat_map(|value| value.to_le_bytes()));
        self.accessor(view, F32, values.len() / parts, kind)
    }

    /// States the least and the greatest of each component.
    fn bound<const N: usize>(&mut self, at: usize, values: impl Iterator<Item = [f64; N]>) {
        let (mut low, mut high) = ([f64::INFINITY; N], [f64::NEG_INFINITY; N]);
        for value in values {
            for k in 0..N {
                low[k] = low[k].min(value[k]);
                high[k] = high[k].max(value[k]);
            }
        }
        self.accessors[at]["min"] = json!(low.as_slice());
        self.accessors[at]["max"] = json!(high.as_slice());
    }

    /// The whole file: `root` without its buffers, views, accessors and asset.
    ///
    /// # Errors
    /// [`GltfError::TooLarge`].
    pub(super) fn finish(mut self, mut root: Value) -> Result<Vec<u8>, GltfError> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let generator = concat!("isomorph ", env!("CARGO_PKG_VERSION"));
        root["asset"] = json!({"version": "2.0", "generator": generator});
        if !self.bytes.is_empty() {
            root["buffers"] = json!([{"byteLength": self.bytes.len()}]);
            root["bufferViews"] = json!(self.views);
            root["accessors"] = json!(self.accessors);
        }
        let mut text = root.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let chunks: &[(&[u8], &[u8])] = &[(b"JSON", &text), (b"BIN\0", &self.bytes)];
        let chunks = &chunks[..if self.bytes.is_empty() { 1 } else { 2 }];
        let bytes = 12 + chunks.iter().map(|(_, data)| 8 + data.len()).sum::<usize>();
        let length = |count: usize| {
            let fits = u32::try_from(count).map(u32::to_le_bytes);
            fits.map_err(|_too_large| GltfError::TooLarge { bytes })
        };
        let mut file = Vec::with_capacity(bytes);
        file.extend_from_slice(b"glTF");
        file.extend(2u32.to_le_bytes());
        file.extend(length(bytes)?);
        for (kind, data) in chunks {
            file.extend(length(data.len())?);
            file.extend_from_slice(kind);
            file.extend_from_slice(data);
        }
        Ok(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_one_file_is_refused_before_it_is_computed() {
        let check = |vertices, precision| check_size(vertices, 100, true, precision);
        assert!(check(1_700_000, Precision::Full).is_ok());
        assert!(check(1_900_000, Precision::Compact).is_ok());
        let refused = check(1_900_000, Precision::Full).expect_err("4.6 GB");
        let said = "4560000000 bytes: a GLB file holds at most 4294967295; ask for fewer times";
        assert!(refused.to_string().starts_with(said), "{refused}");
        assert!(check_size(usize::MAX, 2, false, Precision::Compact).is_err());
    }
}
