//! Networks and optimiser states as bytes, in full precision: what a checkpoint is made of.
//!
//! burn keeps the states of optimisers in hash maps, and writes them in the order of their hashes, which is another
//! one in each process. Here all maps are sorted by their keys: equal states are equal bytes.

use std::io;

use burn::record::{FullPrecisionSettings, NamedMpkBytesRecorder, Record, Recorder};
use burn::tensor::backend::Backend;
use rmpv::Value;
use serde::de::DeserializeOwned;

use crate::alike;

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

impl RecordError {
    /// Of a file and what is wrong with it.
    pub fn new(file: &str, problem: impl Into<String>) -> Self {
        Self {
            file: file.to_owned(),
            problem: problem.into(),
        }
    }
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

    /// The record of a network, read with care: only if it has the form of the one of this name in `like`.
    ///
    /// # Errors
    /// [`RecordError`] if it is not there, is not of this kind or is of another network.
    pub fn get<B: Backend, R: Record<B>>(
        &self,
        name: &str,
        like: &Self,
        device: &B::Device,
    ) -> Result<R, RecordError> {
        let problem = alike::difference(&self.value(name)?, &like.value(name)?);
        self.read(name, problem, device)
    }

    /// The record of an optimiser's states, if they are of the parameters of the network in record `net`.
    ///
    /// # Errors
    /// As of [`Self::get`].
    pub(crate) fn states<B: Backend, R: Record<B>>(
        &self,
        name: &str,
        net: &str,
        device: &B::Device,
    ) -> Result<R, RecordError> {
        let problem = alike::stray_state(&self.value(name)?, &self.value(net)?);
        self.read(name, problem, device)
    }

    /// What burn's recorder makes of a record in which no problem was found.
    fn read<B: Backend, R: Record<B>>(
        &self,
        name: &str,
        problem: Option<String>,
        device: &B::Device,
    ) -> Result<R, RecordError> {
        if let Some(problem) = problem {
            return Err(RecordError::new(name, problem));
        }
        let recorder = NamedMpkBytesRecorder::<FullPrecisionSettings>::default();
        Recorder::<B>::load(&recorder, self.known(name)?.to_vec(), device)
            .map_err(|error| RecordError::new(name, error.to_string()))
    }

    /// An entry of a network's record that is no array of numbers, such as a grid.
    ///
    /// # Errors
    /// [`RecordError`] if the record or the entry is not there, or is of another kind.
    pub(crate) fn constant<T: DeserializeOwned>(
        &self,
        name: &str,
        entry: &str,
    ) -> Result<T, RecordError> {
        let record = self.value(name)?;
        let item = alike::field(&record, "item");
        let found = item.and_then(|item| alike::field(item, entry));
        let missing = || RecordError::new(name, format!("{entry} is missing"));
        rmpv::ext::from_value(found.ok_or_else(missing)?.clone())
            .map_err(|error| RecordError::new(name, format!("{entry}: {error}")))
    }

    /// The bytes of a record, if it is there.
    pub fn bytes(&self, name: &str) -> Option<&[u8]> {
        let found = self.0.iter().find(|(file, _)| file == name);
        found.map(|(_, bytes)| bytes.as_slice())
    }

    fn known(&self, name: &str) -> Result<&[u8], RecordError> {
        let missing = || RecordError::new(name, "is not part of it");
        self.bytes(name).ok_or_else(missing)
    }

    fn value(&self, name: &str) -> Result<Value, RecordError> {
        rmpv::decode::read_value(&mut self.known(name)?)
            .map_err(|error| RecordError::new(name, error.to_string()))
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
            let kind = alike::field(value, "dtype").and_then(Value::as_str);
            match alike::field(value, "bytes") {
                Some(Value::Binary(bytes)) if kind == Some("F32") => bytes
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
    use burn::module::{Module, ModuleMapper, Param};
    use burn::optim::adaptor::OptimizerAdaptor;
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
        let net: ImplicitNet<B> = config.init(3, &device);
        net.map(&mut Times(first))
    }

    /// Multiplies all weights.
    struct Times(f32);

    impl ModuleMapper<B> for Times {
        fn map_float<const D: usize>(&mut self, param: Param<Tensor<B, D>>) -> Param<Tensor<B, D>> {
            param.map(|tensor| (tensor * self.0).detach().require_grad())
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
        assert!(
            one.0[1].1.len() > one.0[0].1.len(),
            "two moments of each weight"
        );
        let device = Default::default();
        let record = one
            .get::<B, _>("net.mpk", &other, &device)
            .expect("it is there");
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

    /// The values along a path of names and places, changed.
    fn changed(value: &mut Value, path: &[&str], change: &dyn Fn(&mut Value)) {
        let Some((name, rest)) = path.split_first() else {
            return change(value);
        };
        match value {
            Value::Map(entries) => {
                let mut found = entries
                    .iter_mut()
                    .filter(|(key, _)| key.as_str() == Some(name));
                let (_, value) = found.next().expect("there is such an entry");
                changed(value, rest, change);
            }
            Value::Array(values) => {
                let place: usize = name.parse().expect("a place");
                changed(&mut values[place], rest, change);
            }
            _ => panic!("nothing lies in it"),
        }
    }

    /// The problem that is found where one of the two records is changed.
    fn problem(name: &str, path: &[&str], change: impl Fn(&mut Value)) -> String {
        let own = records(1.0);
        let mut found = own.clone();
        let (_, bytes) = found
            .0
            .iter_mut()
            .find(|(file, _)| file == name)
            .expect("it is there");
        let mut value = rmpv::decode::read_value(&mut bytes.as_slice()).expect("MessagePack");
        changed(&mut value, path, &change);
        bytes.clear();
        rmpv::encode::write_value(bytes, &value).expect("encoded");
        let device = Default::default();
        let error = match name {
            "net.mpk" => found
                .get::<B, <ImplicitNet<B> as Module<B>>::Record>(name, &own, &device)
                .err(),
            _ => found
                .states::<B, <Adam as Optimizer<ImplicitNet<B>, B>>::Record>(
                    name, "net.mpk", &device,
                )
                .err(),
        };
        let error = error.expect("it is refused");
        assert_eq!(error.file, name);
        error.problem
    }

    type Adam = OptimizerAdaptor<burn::optim::Adam, ImplicitNet<B>, B>;

    #[test]
    fn a_record_of_another_form_is_refused_before_burn_reads_it() {
        let weight = |last| ["item", "mlp", "layers", "1", "weight", last];
        let text = |text: &'static str| move |value: &mut Value| *value = text.into();
        let at = |what: &str| format!("mlp/layers/1/weight{what}");
        // burn's own reader panics at the first three.
        for id in ["0\u{e9}00000000", "080", "0123456789abcdefghijklmnop"] {
            let found = problem("net.mpk", &weight("id"), text(id));
            assert_eq!(found, at("/id is no identifier"), "{id}");
        }
        let found = problem("net.mpk", &weight("id"), |value| *value = Value::Nil);
        assert_eq!(found, at("/id is no identifier"));
        let array = [&weight("param")[..], &["shape"]].concat();
        let found = problem("net.mpk", &array, |value| {
            *value = Value::Array(vec![4.into()]);
        });
        assert_eq!(
            found,
            at("/param has another shape than the recipe's network")
        );
        let array = [&weight("param")[..], &["bytes"]].concat();
        let found = problem("net.mpk", &array, |value| {
            *value = Value::Binary(vec![0; 8]);
        });
        assert_eq!(found, at("/param holds too few or too many numbers"));
        let found = problem("net.mpk", &weight("param")[..5], |value| {
            *value = Value::Map(vec![]);
        });
        assert_eq!(found, at("/id is missing"));
        let found = problem("net.mpk", &weight("param")[..3], |value| {
            *value = Value::Array(vec![]);
        });
        assert_eq!(found, "mlp/layers is no list of 3");
    }

    #[test]
    fn states_of_another_network_are_refused_before_burn_reads_them() {
        let first = |value: &mut Value, change: &dyn Fn(&mut (Value, Value))| {
            let Value::Map(entries) = value else {
                panic!("states by parameter");
            };
            change(&mut entries[0]);
        };
        let found = problem("adam.mpk", &["item"], |value| {
            first(value, &|(id, _)| *id = "what?".into());
        });
        assert_eq!(found, "\"what?\" is no parameter of the network");
        let found = problem("adam.mpk", &["item"], |value| {
            first(value, &|(_, state)| cut(state));
        });
        assert!(
            found.ends_with("holds too few or too many numbers"),
            "{found}"
        );
        let found = problem("adam.mpk", &["item"], |value| *value = Value::Nil);
        assert_eq!(found, "holds no states");
        // burn's own reader panics at the first two, as a tensor has its number of axes in its type.
        for name in ["Rank3", "Rank0", "Rank9"] {
            let found = problem("adam.mpk", &["item"], |value| {
                first(value, &|(_, state)| {
                    renamed(alike::field_mut(state, "V1"), "Rank2", name);
                });
            });
            assert!(
                found.ends_with(": has another number of axes"),
                "{name}: {found}"
            );
        }
        // burn reads an array from a list of its parts as well.
        let found = problem("adam.mpk", &["item"], |value| {
            first(value, &|(_, state)| as_lists(state));
        });
        assert!(found.ends_with("holds a list that is no array"), "{found}");
    }

    fn renamed(value: &mut Value, name: &str, other: &str) {
        let Value::Map(entries) = value else {
            panic!("entries by name");
        };
        let mut keys = entries.iter_mut().map(|(key, _)| key);
        let key = keys.find(|key| key.as_str() == Some(name));
        *key.expect("there is such an entry") = other.into();
    }

    /// Writes every array as a list of its parts.
    fn as_lists(value: &mut Value) {
        let parts = ["bytes", "shape", "dtype"].map(|name| alike::field(value, name).cloned());
        if let [Some(bytes), Some(shape), Some(kind)] = parts {
            *value = Value::Array(vec![bytes, shape, kind]);
        } else if let Value::Map(entries) = value {
            entries.iter_mut().for_each(|(_, value)| as_lists(value));
        }
    }

    /// Takes the last four bytes of every array.
    fn cut(value: &mut Value) {
        match value {
            Value::Binary(bytes) => bytes.truncate(bytes.len() - 4),
            Value::Map(entries) => entries.iter_mut().for_each(|(_, value)| cut(value)),
            Value::Array(values) => values.iter_mut().for_each(cut),
            _ => {}
        }
    }
}
