//! A reader of GLB for tests, written from the specification alone: it holds every accessor against its view,
//! its alignment and its stated bounds.

use serde_json::Value;

/// A file that was read.
pub(super) struct Glb {
    pub(super) root: Value,
    bytes: Vec<u8>,
}

fn number(value: &Value) -> usize {
    value.as_u64().map_or(0, |found| found as usize)
}

impl Glb {
    /// Reads a file and checks each of its accessors.
    pub(super) fn read(file: &[u8]) -> Self {
        let word = |at: usize| {
            let bytes = file[at..at + 4].try_into().expect("four bytes");
            u32::from_le_bytes(bytes) as usize
        };
        assert_eq!(
            (&file[..4], word(4), word(8)),
            (&b"glTF"[..], 2, file.len())
        );
        let text = word(12);
        assert_eq!((&file[16..20], text % 4), (&b"JSON"[..], 0));
        let root: Value = serde_json::from_slice(&file[20..20 + text]).expect("JSON");
        let rest = &file[20 + text..];
        let bytes = match rest {
            [] => Vec::new(),
            _ => {
                assert_eq!(
                    (&rest[4..8], word(20 + text)),
                    (&b"BIN\0"[..], rest.len() - 8)
                );
                rest[8..].to_vec()
            }
        };
        assert_eq!(bytes.len() % 4, 0);
        assert_eq!(number(&root["buffers"][0]["byteLength"]), bytes.len());
        let glb = Self { root, bytes };
        let accessors = glb.root["accessors"]
            .as_array()
            .cloned()
            .unwrap_or_default();
        for k in 0..accessors.len() {
            glb.check(k);
        }
        glb
    }

    /// Whether an accessor lies in its view, is aligned, and has the bounds that it states.
    fn check(&self, index: usize) {
        let accessor = &self.root["accessors"][index];
        let whole = accessor["normalized"] == Value::Bool(true);
        let rows = self.raw(index);
        for (name, fold) in [("min", f64::min as fn(f64, f64) -> f64), ("max", f64::max)] {
            let Some(stated) = accessor[name].as_array() else {
                continue;
            };
            for (part, stated) in stated.iter().enumerate() {
                let found = rows.iter().map(|row| row[part]).reduce(fold);
                assert_eq!(
                    stated.as_f64(),
                    found,
                    "{name} of accessor {index}, whole: {whole}"
                );
            }
        }
    }

    /// The rows of an accessor as they are stored.
    fn raw(&self, index: usize) -> Vec<Vec<f64>> {
        let accessor = &self.root["accessors"][index];
        let parts = match accessor["type"].as_str() {
            Some("SCALAR") => 1,
            Some("VEC2") => 2,
            Some("VEC3") => 3,
            other => {
                assert_eq!(other, Some("VEC4"));
                4
            }
        };
        let of = number(&accessor["componentType"]);
        let size = match of {
            5120 | 5121 => 1,
            5122 | 5123 => 2,
            _ => 4,
        };
        let view = &self.root["bufferViews"][number(&accessor["bufferView"])];
        let stride = view["byteStride"]
            .as_u64()
            .map_or(parts * size, |found| found as usize);
        let (start, count) = (number(&view["byteOffset"]), number(&accessor["count"]));
        assert!(count > 0, "accessor {index} is empty");
        assert_eq!(
            (start % 4, stride % size),
            (0, 0),
            "alignment of accessor {index}"
        );
        let end = (count - 1) * stride + parts * size;
        assert!(
            end <= number(&view["byteLength"]),
            "accessor {index} leaves its view"
        );
        let part = |at: usize| {
            let bytes = &self.bytes[at..at + size];
            let four = || bytes.try_into().expect("four bytes");
            let two = || bytes.try_into().expect("two bytes");
            match of {
                5120 => f64::from(bytes[0] as i8),
                5122 => f64::from(i16::from_le_bytes(two())),
                5123 => f64::from(u16::from_le_bytes(two())),
                5125 => f64::from(u32::from_le_bytes(four())),
                _ => f64::from(f32::from_le_bytes(four())),
            }
        };
        let row = |k: usize| {
            (0..parts)
                .map(|j| part(start + k * stride + j * size))
                .collect()
        };
        (0..count).map(row).collect()
    }

    /// The rows of an accessor as a viewer takes them.
    pub(super) fn rows(&self, accessor: &Value) -> Vec<Vec<f64>> {
        let index = number(accessor);
        let found = &self.root["accessors"][index];
        let most = match (
            found["normalized"] == Value::Bool(true),
            number(&found["componentType"]),
        ) {
            (true, 5120) => 127.0,
            (true, 5122) => 32767.0,
            (true, 5123) => 65535.0,
            _ => 1.0,
        };
        let row = |row: Vec<f64>| row.into_iter().map(|part| part / most).collect();
        self.raw(index).into_iter().map(row).collect()
    }

    /// The same of three parts.
    pub(super) fn vectors(&self, accessor: &Value) -> Vec<[f64; 3]> {
        let row = |row: Vec<f64>| row.try_into().expect("three parts");
        self.rows(accessor).into_iter().map(row).collect()
    }

    /// The same of one part.
    pub(super) fn numbers(&self, accessor: &Value) -> Vec<f64> {
        self.rows(accessor).concat()
    }

    /// The bytes of a view.
    pub(super) fn view(&self, index: usize) -> &[u8] {
        let view = &self.root["bufferViews"][index];
        let start = number(&view["byteOffset"]);
        &self.bytes[start..start + number(&view["byteLength"])]
    }
}

/// Whether positions are the same to within a distance along each axis.
pub(super) fn approx(found: &[Vec<[f64; 3]>], right: &[Vec<[f64; 3]>], within: f64) {
    assert_eq!(found.len(), right.len());
    for (found, right) in found.iter().zip(right) {
        assert_eq!(found.len(), right.len());
        for (x, y) in found.iter().flatten().zip(right.iter().flatten()) {
            assert!(
                (x - y).abs() <= within,
                "{x} instead of {y}, within {within}"
            );
        }
    }
}
