//! Networks and optimiser states as bytes, in full precision: what a checkpoint is made of.

use std::io;

use burn::record::{FullPrecisionSettings, NamedMpkBytesRecorder, Record, Recorder};
use burn::tensor::backend::Backend;

/// The burn release whose records these are.
pub const BURN_VERSION: &str = "0.21.0";

/// Named records: names of files and their contents.
#[derive(Clone, Debug, Default)]
pub struct Records(pub Vec<(String, Vec<u8>)>);

/// A record that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{file}: {problem}")]
pub struct RecordError {
    /// The name of its file.
    pub file: String,
    /// What is wrong with it.
    pub problem: String,
}

impl Records {
    /// Adds a record.
    ///
    /// # Errors
    /// What burn's recorder says.
    pub fn push<B: Backend>(&mut self, name: String, record: impl Record<B>) -> io::Result<()> {
        let recorder = NamedMpkBytesRecorder::<FullPrecisionSettings>::default();
        let bytes = Recorder::<B>::record(&recorder, record, ())
            .map_err(|error| io::Error::other(error.to_string()))?;
        self.0.push((name, bytes));
        Ok(())
    }

    /// The record of a name.
    ///
    /// # Errors
    /// [`RecordError`] if it is not there or is not of this kind.
    pub fn get<B: Backend, R: Record<B>>(
        &self,
        name: &str,
        device: &B::Device,
    ) -> Result<R, RecordError> {
        let refused = |problem: String| RecordError {
            file: name.to_owned(),
            problem,
        };
        let found = self.0.iter().find(|(file, _)| file == name);
        let (_, bytes) = found.ok_or_else(|| refused("is not part of it".to_owned()))?;
        let recorder = NamedMpkBytesRecorder::<FullPrecisionSettings>::default();
        Recorder::<B>::load(&recorder, bytes.clone(), device)
            .map_err(|error| refused(error.to_string()))
    }
}
