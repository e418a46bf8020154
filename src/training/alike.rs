//! Whether a record that was read has the form of the one that the recipe's network would write.
//!
//! burn's readers trust what they read: an identifier that is none and an array of another shape end in a panic,
//! in reading or at the first product. A file with the right checksum is not always one of ours.

use burn::module::ParamId;
use rmpv::Value;

/// The most letters of an identifier: 64 bits in base 32. burn fails on longer ones.
const ID_LETTERS: usize = 13;

/// What a record has that one of the same network cannot have, in words; `like` is a record of that network.
///
/// Lists have equal lengths, arrays equal shapes and types of numbers and as many bytes as those need, and
/// parameters valid identifiers. Numbers may differ.
pub(crate) fn difference(found: &Value, like: &Value) -> Option<String> {
    compared(found, like, "")
}

/// What is no part of an optimiser's state for the network whose record is `net`, in words.
///
/// Its entries belong to parameters of the network. One is of as many axes as its parameter, every array in it has the
/// shape of that parameter, and it holds no other list.
pub(crate) fn stray_state(state: &Value, net: &Value) -> Option<String> {
    let mut shapes = Vec::new();
    parameters(net, &mut shapes);
    let Some(Value::Map(entries)) = field(state, "item") else {
        return Some("holds no states".to_owned());
    };
    entries.iter().find_map(|(id, state)| {
        let id = id.as_str().unwrap_or_default();
        let known = shapes.iter().find(|(of, _)| *of == id);
        let Some((_, array)) = known else {
            return Some(format!("{id:?} is no parameter of the network"));
        };
        let problem = match of_rank(state, array) {
            Some(state) => arrays_like(state, array),
            None => Some("has another number of axes".to_owned()),
        };
        problem.map(|what| format!("the state of parameter {id}: {what}"))
    })
}

fn compared(found: &Value, like: &Value, place: &str) -> Option<String> {
    if is_array(like) {
        return unlike_arrays(found, like).map(|what| at(place, &what));
    }
    match (found, like) {
        (_, Value::Map(entries)) => entries.iter().find_map(|(key, like)| {
            let name = key.as_str().unwrap_or_default();
            let place = format!("{place}/{name}");
            match field(found, name) {
                None => Some(at(&place, "is missing")),
                Some(id) if name == "id" => (!is_id(id)).then(|| at(&place, "is no identifier")),
                Some(found) => compared(found, like, &place),
            }
        }),
        (Value::Array(found), Value::Array(like)) if found.len() == like.len() => {
            let mut pairs = found.iter().zip(like).enumerate();
            pairs.find_map(|(k, (found, like))| compared(found, like, &format!("{place}/{k}")))
        }
        (_, Value::Array(like)) => Some(at(place, &format!("is no list of {}", like.len()))),
        _ => None,
    }
}

fn at(place: &str, what: &str) -> String {
    let place = place.trim_start_matches("/item").trim_start_matches('/');
    format!("{place} {what}")
}

/// The entry of a map.
pub(crate) fn field<'a>(value: &'a Value, name: &str) -> Option<&'a Value> {
    let Value::Map(entries) = value else {
        return None;
    };
    let found = entries.iter().find(|(key, _)| key.as_str() == Some(name));
    found.map(|(_, value)| value)
}

/// The entry of a map, to be changed.
#[cfg(test)]
pub(crate) fn field_mut<'a>(value: &'a mut Value, name: &str) -> &'a mut Value {
    let Value::Map(entries) = value else {
        panic!("entries by name");
    };
    let mut found = entries.iter_mut();
    let found = found.find(|(key, _)| key.as_str() == Some(name));
    &mut found.expect("there is such an entry").1
}

/// burn writes an array as its bytes beside its shape and the type of its numbers.
fn is_array(value: &Value) -> bool {
    ["bytes", "shape", "dtype"]
        .map(|name| field(value, name))
        .iter()
        .all(Option::is_some)
}

fn unlike_arrays(found: &Value, like: &Value) -> Option<String> {
    if ["shape", "dtype"].map(|name| field(found, name))
        != ["shape", "dtype"].map(|name| field(like, name))
    {
        return Some("has another shape than the recipe's network".to_owned());
    }
    let bytes = |value| {
        field(value, "bytes")
            .and_then(Value::as_slice)
            .map(<[u8]>::len)
    };
    (bytes(found) != bytes(like)).then(|| "holds too few or too many numbers".to_owned())
}

/// What burn wrote in the variant of a state for arrays of as many axes as this one has, if that is the only variant.
fn of_rank<'a>(state: &'a Value, array: &Value) -> Option<&'a Value> {
    let axes = field(array, "shape")?.as_array()?.len();
    let variants = field(state, "V1")?;
    (variants.as_map()?.len() == 1).then_some(())?;
    field(variants, &format!("Rank{axes}"))
}

/// The first array in a state that is not like this one, or a list that is no array.
fn arrays_like(state: &Value, like: &Value) -> Option<String> {
    if field(state, "bytes").is_some() {
        return unlike_arrays(state, like);
    }
    match state {
        Value::Map(entries) => entries
            .iter()
            .find_map(|(_, value)| arrays_like(value, like)),
        Value::Array(_) | Value::Binary(_) => Some("holds a list that is no array".to_owned()),
        _ => None,
    }
}

fn is_id(value: &Value) -> bool {
    let valid = |text: &str| text.len() <= ID_LETTERS && ParamId::try_deserialize(text).is_some();
    value.as_str().is_some_and(valid)
}

/// The identifiers of all parameters in a record, with their arrays.
fn parameters<'a>(value: &'a Value, found: &mut Vec<(&'a str, &'a Value)>) {
    if let (Some(id), Some(array)) = (field(value, "id"), field(value, "param")) {
        found.push((id.as_str().unwrap_or_default(), array));
        return;
    }
    match value {
        Value::Map(entries) => entries
            .iter()
            .for_each(|(_, value)| parameters(value, found)),
        Value::Array(values) => values.iter().for_each(|value| parameters(value, found)),
        _ => {}
    }
}
