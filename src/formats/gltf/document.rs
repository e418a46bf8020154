//! The container: JSON, and the bytes within it, beside it or in it as text.

use std::path::Path;

use base64::Engine as _;
use base64::engine::DecodePaddingMode;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig};
use serde_json::Value;

use crate::formats::error::ShapeError;
use crate::formats::lines::shown;
use crate::formats::shape::file_bytes;

/// Extensions that change nothing of what is read here, or that are followed.
const KNOWN: [&str; 7] = [
    "KHR_mesh_quantization",
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_",
    "KHR_xmp",
    "KHR_animation_pointer",
];

/// A file that was opened.
pub(super) struct Document<'a> {
    pub path: &'a Path,
    root: Value,
    buffers: Vec<Vec<u8>>,
}

impl<'a> Document<'a> {
    /// Reads the file, and all bytes that it refers to.
    ///
    /// # Errors
    /// What is no glTF 2.0, what is truncated, a file beside it that cannot be read, compression.
    pub(super) fn open(path: &'a Path) -> Result<Self, ShapeError> {
        let bytes = file_bytes(path)?;
        let (text, chunk) = if bytes.starts_with(b"glTF") {
            chunks(&bytes).map_err(|problem| ShapeError::malformed(path, problem))?
        } else {
            (bytes.as_slice(), None)
        };
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
        let root = serde_json::from_slice(text).map_err(|error| {
            ShapeError::malformed(
                path,
                format!("its JSON: {error}: not a glTF file, or truncated"),
            )
        })?;
        let mut document = Self {
            path,
            root,
            buffers: Vec::new(),
        };
        document.check()?;
        for index in 0..document.count("buffers") {
            let bytes = document.load(index, chunk)?;
            document.buffers.push(bytes);
        }
        Ok(document)
    }

    /// An error about this file.
    pub(super) fn malformed(&self, problem: impl Into<String>) -> ShapeError {
        ShapeError::malformed(self.path, problem)
    }

    /// Whether it is of this version, and needs nothing that is not understood.
    fn check(&self) -> Result<(), ShapeError> {
        let version = self.root["asset"]["version"].as_str().unwrap_or("none");
        if version.split('.').next() != Some("2") {
            let version = shown(version);
            return Err(self.malformed(format!(
                "glTF version {version:?}: must be 2.0; export it as glTF 2.0"
            )));
        }
        let required = self.root["extensionsRequired"]
            .as_array()
            .into_iter()
            .flatten();
        for name in required.filter_map(Value::as_str) {
            if name.contains("draco") || name.contains("meshopt") {
                let problem = format!(
                    "its meshes are compressed ({}): export it without compression",
                    shown(name)
                );
                return Err(self.malformed(problem));
            }
            if !KNOWN.iter().any(|known| name.starts_with(known)) {
                let problem = format!(
                    "it requires the extension {}, which is not read; export it without",
                    shown(name)
                );
                return Err(self.malformed(problem));
            }
        }
        Ok(())
    }

    /// The whole JSON.
    pub(super) fn root(&self) -> &Value {
        &self.root
    }

    /// How many elements a list of the file has.
    pub(super) fn count(&self, list: &str) -> usize {
        self.root[list].as_array().map_or(0, Vec::len)
    }

    /// An element of a list of the file.
    ///
    /// # Errors
    /// If there is none.
    pub(super) fn element(&self, list: &str, index: usize) -> Result<&Value, ShapeError> {
        self.root[list].get(index).ok_or_else(|| {
            let count = self.count(list);
            self.malformed(format!(
                "{list}[{index}] does not exist (the file has {count})"
            ))
        })
    }

    /// A whole number from 0 of a part of the file; none where it is not stated.
    ///
    /// # Errors
    /// What is no such number.
    pub(super) fn whole(&self, of: &Value, key: &str) -> Result<Option<usize>, ShapeError> {
        let Some(value) = of.get(key) else {
            return Ok(None);
        };
        let found = value.as_u64().and_then(|found| usize::try_from(found).ok());
        found.map(Some).ok_or_else(|| {
            let value = shown(&value.to_string());
            self.malformed(format!("{key} {value}: must be a whole number from 0"))
        })
    }

    /// The bytes of a view, and how far its elements are apart, if it says so.
    ///
    /// # Errors
    /// A view that reaches beyond its buffer.
    pub(super) fn view(&self, index: usize) -> Result<(&[u8], Option<usize>), ShapeError> {
        let view = self.element("bufferViews", index)?;
        let buffer = self.whole(view, "buffer")?.unwrap_or(usize::MAX);
        self.element("buffers", buffer)?;
        let bytes = &self.buffers[buffer];
        let start = self.whole(view, "byteOffset")?.unwrap_or(0);
        let length = self.whole(view, "byteLength")?.unwrap_or(0);
        let end = start.checked_add(length);
        let found = end.and_then(|end| bytes.get(start..end)).ok_or_else(|| {
            let (name, held) = (format!("bufferViews[{index}]"), bytes.len());
            self.malformed(format!(
                "{name} has {length} bytes from {start}, but its buffer has {held}: truncated"
            ))
        })?;
        Ok((found, self.whole(view, "byteStride")?))
    }

    /// The bytes of a buffer.
    fn load(&self, index: usize, chunk: Option<&[u8]>) -> Result<Vec<u8>, ShapeError> {
        let buffer = self.element("buffers", index)?;
        let bytes = match (buffer["uri"].as_str(), chunk) {
            (Some(uri), _) => self.fetch(uri)?,
            (None, Some(chunk)) if index == 0 => chunk.to_vec(),
            // What a compressed file keeps for others.
            _ => Vec::new(),
        };
        let needed = self.whole(buffer, "byteLength")?.unwrap_or(0);
        let is_whole = bytes.len() >= needed || bytes.is_empty() && index > 0;
        if is_whole {
            return Ok(bytes);
        }
        let found = bytes.len();
        let problem =
            format!("buffers[{index}] has {found} bytes, {needed} needed: the file is truncated");
        Err(self.malformed(problem))
    }

    /// The bytes that a URI stands for: in the text itself, or in a file beside this one.
    ///
    /// # Errors
    /// What is neither, and what cannot be read.
    pub(super) fn fetch(&self, uri: &str) -> Result<Vec<u8>, ShapeError> {
        if let Some(data) = uri.strip_prefix("data:") {
            let text = data.split_once(";base64,").map(|(_, text)| text.trim_end());
            let lenient = GeneralPurposeConfig::new()
                .with_decode_padding_mode(DecodePaddingMode::Indifferent);
            let engine = GeneralPurpose::new(&base64::alphabet::STANDARD, lenient);
            let decoded = text.and_then(|text| engine.decode(text).ok());
            return decoded.ok_or_else(|| {
                self.malformed(format!("{:?}: must be data in base64", shown(uri)))
            });
        }
        let name = decoded(uri);
        // Of Windows, too: a drive, or a backslash.
        if name.contains(':') || name.starts_with(['/', '\\']) {
            let problem = format!(
                "{:?}: must be the name of a file beside this one",
                shown(uri)
            );
            return Err(self.malformed(problem));
        }
        file_bytes(&self.path.with_file_name(name)).map_err(|error| {
            let reason = match error {
                ShapeError::Unreadable { reason, .. } => format!("cannot be read: {reason}"),
                _ => "is empty".to_owned(),
            };
            self.malformed(format!(
                "refers to {:?} beside it, which {reason}",
                shown(uri)
            ))
        })
    }
}

/// A URI with its escapes (`%20`) as what they stand for.
fn decoded(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let escaped = (first == b'%')
            .then(|| after.first_chunk::<2>())
            .flatten()
            .and_then(|digits| std::str::from_utf8(digits).ok())
            .and_then(|digits| u8::from_str_radix(digits, 16).ok());
        bytes.push(escaped.unwrap_or(first));
        rest = if escaped.is_some() {
            &after[2..]
        } else {
            after
        };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// The JSON and the bytes of a GLB file.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| {
        let word = bytes.get(at..).and_then(|rest| rest.first_chunk());
        word.map(|word| u32::from_le_bytes(*word) as usize)
    };
    let (version, length) = (word(4), word(8));
    if let Some(version) = version.filter(|version| *version != 2) {
        return Err(format!(
            "GLB version {version}: must be 2; export it as glTF 2.0"
        ));
    }
    if length.is_none_or(|length| length > bytes.len()) {
        let (length, found) = (length.unwrap_or(12), bytes.len());
        return Err(format!(
            "its header claims {length} bytes, but it has {found}: it is truncated"
        ));
    }
    let (mut text, mut chunk) = (None, None);
    let mut at = 12;
    while let (Some(size), Some(kind)) = (word(at), bytes.get(at + 4..at + 8)) {
        let start = at + 8;
        let data = bytes.get(start..start + size);
        let data = data.ok_or_else(|| {
            format!("the chunk at byte {at} claims {size} bytes: truncated or malformed")
        })?;
        match kind {
            b"JSON" if text.is_none() => text = Some(data),
            b"BIN\0" if chunk.is_none() => chunk = Some(data),
            _ => {}
        }
        at = start + size;
    }
    Ok((
        text.ok_or("it has no chunk of JSON: it is malformed")?,
        chunk,
    ))
}
