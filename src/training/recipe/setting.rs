//! Types that a field of the recipe can have.

use std::path::PathBuf;

use super::rule::Value;

/// A type that a field of the recipe can have.
pub(crate) trait Setting: Sized {
    /// The field, `None` if the value is of another type.
    fn from_value(value: Value) -> Option<Self>;

    /// The value that gives the field back.
    fn to_value(&self) -> Option<Value>;

    /// The field where the recipe has no value, if it can do without.
    fn absent() -> Option<Self> {
        None
    }
}

impl<T: Setting> Setting for Option<T> {
    fn from_value(value: Value) -> Option<Self> {
        T::from_value(value).map(Some)
    }

    fn to_value(&self) -> Option<Value> {
        self.as_ref().and_then(Setting::to_value)
    }

    fn absent() -> Option<Self> {
        Some(None)
    }
}

macro_rules! settings {
    ($($Type:ty as $Variant:ident: $into:expr, $from:expr;)+) => { $(
        impl Setting for $Type {
            fn from_value(value: Value) -> Option<$Type> {
                match value { Value::$Variant(inner) => $into(inner), _ => None }
            }

            fn to_value(&self) -> Option<Value> {
                Some(Value::$Variant($from(self)))
            }
        }
    )+ };
}

settings! {
    u64 as Whole: Some, |number: &u64| *number;
    usize as Whole: |number| usize::try_from(number).ok(), |number: &usize| *number as u64;
    f64 as Number: Some, |number: &f64| *number;
    Vec<f64> as Numbers: Some, |numbers: &Vec<f64>| numbers.clone();
    bool as Flag: Some, |flag: &bool| *flag;
    PathBuf as Text: |text| Some(PathBuf::from(text)),
        |path: &PathBuf| path.to_string_lossy().into_owned();
}
