//! Networks and optimiser states as bytes, in full precision: what a checkpoint is made of.
//!
//! burn keeps the states of optimisers in hash maps, and writes them in the order of their hashes, which is another
//! one in each process. Here all maps are sorted by their keys: equal states are equal bytes.

use std::io;

use burn::record::{FullPrecisionSettings, NamedMpkBytesRecorder, Record, Recorder};
use burn::tensor::backend::Backend;
use rmpv::Value;

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
        self.0.push((name, sorted(&bytes)?));
        Ok(())
    }

    /// The first record with an array in it that holds something other than finite numbers.
    pub fn not_finite(&self) -> Option<&str> {
        let mut records = self.0.iter();
        let found = records.find(|(_, bytes)| {
            let value = rmpv::decode::read_value(&mut bytes.as_slice());
            value.is_ok_and(|value| holds_no_number(&value))
        });
        found.map(|(name, _)| name.as_str())
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

/// The same MessagePack with its maps in the order of their keys.
fn sorted(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut value = rmpv::decode::read_value(&mut &*bytes).map_err(io::Error::other)?;
    sort(&mut value);
    let mut out = Vec::with_capacity(bytes.len());
    rmpv::encode::write_value(&mut out, &value).map_err(io::Error::other)?;
    Ok(out)
}

fn sort(value: &mut Value) {
    match value {
        Value::Map(entries) => {
            entries.sort_by_cached_key(|(key, _)| key.to_string());
            entries.iter_mut().for_each(|(_, value)| sort(value));
        }
        Value::Array(values) => values.iter_mut().for_each(sort),
        _ => {}
    }
}

/// Whether an array of 32-bit numbers, which burn writes as its bytes beside their type, holds NaN or infinity.
fn holds_no_number(value: &Value) -> bool {
    match value {
        Value::Map(entries) => {
            let named = |name| entries.iter().find(|(key, _)| key.as_str() == Some(name));
            let is_f32 = named("dtype").is_some_and(|(_, kind)| kind.as_str() == Some("F32"));
            match named("bytes") {
                Some((_, Value::Binary(bytes))) if is_f32 => bytes
                    .chunks_exact(4)
                    .any(|b| !f32::from_le_bytes([b[0], b[1], b[2], b[3]]).is_finite()),
                _ => entries.iter().any(|(_, value)| holds_no_number(value)),
            }
        }
        Value::Array(values) => values.iter().any(holds_no_number),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use burn::module::{AutodiffModule, Module, ModuleMapper, Param};
    use burn::optim::{AdamConfig, GradientsParams, Optimizer};
    use burn::tensor::Tensor;
    use burn_autodiff::Autodiff;
    use burn_ndarray::NdArray;
    use isomorph_model::{ImplicitNet, ImplicitNetConfig};

    use super::*;

    type B = Autodiff<NdArray>;

    fn net(first: f32) -> ImplicitNet<B> {
        let config = ImplicitNetConfig {
            depth: 2,
            width: 4,
            activation: isomorph_model::autodiff::activation::Activation::Softplus { beta: 10.0 },
            frequencies: 0,
            skip: 0,
            sphere_radius: 0.3,
        };
        let device = Default::default();
        let net: ImplicitNet<NdArray> = config.init(3, &device);
        ImplicitNet::from_inner(net.map(&mut Times(first)))
    }

    /// Multiplies all weights.
    struct Times(f32);

    impl ModuleMapper<NdArray> for Times {
        fn map_float<const D: usize>(
            &mut self,
            param: Param<Tensor<NdArray, D>>,
        ) -> Param<Tensor<NdArray, D>> {
            param.map(|tensor| tensor * self.0)
        }
    }

    /// The records of a network and of Adam after a step.
    fn records(factor: f32) -> Records {
        let net = net(factor);
        let device = Default::default();
        let x = Tensor::<B, 2>::ones([5, 3], &device) * 0.1;
        let t = Tensor::<B, 2>::zeros([5, 1], &device);
        let mut adam = AdamConfig::new().init::<B, ImplicitNet<B>>();
        let gradients = net.forward(x, t).sum().backward();
        let gradients = GradientsParams::from_grads(gradients, &net);
        let net = adam.step(0.1, net, gradients);
        let mut records = Records::default();
        records
            .push::<B>("net.mpk".to_owned(), net.into_record())
            .expect("encoded");
        records
            .push::<B>("adam.mpk".to_owned(), adam.to_record())
            .expect("encoded");
        records
    }

    #[test]
    fn equal_states_are_equal_bytes_and_are_read_back() {
        let (one, other) = (records(1.0), records(1.0));
        // Six arrays in a hash map: with another order in one of them 719 times of 720.
        assert_eq!(one.0, other.0);
        let device = Default::default();
        let record = one.get::<B, _>("net.mpk", &device).expect("it is there");
        let mut again = Records::default();
        let net = net(2.0).load_record(record);
        again
            .push::<B>("net.mpk".to_owned(), net.into_record())
            .expect("encoded");
        assert_eq!(again.0[0], one.0[0]);
        assert_eq!(one.not_finite(), None);
    }

    #[test]
    fn weights_that_are_no_numbers_are_found() {
        let found = records(f32::NAN);
        assert_eq!(found.not_finite(), Some("net.mpk"));
        let found = records(f32::INFINITY);
        assert_eq!(found.not_finite(), Some("net.mpk"));
    }
}
