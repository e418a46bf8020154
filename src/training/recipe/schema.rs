//! How the recipe's keys are declared: `sections!` turns one table of keys into the structs that
//! the program reads and into [`Key`]s, from which parsing, checks and printing all work.

use std::path::PathBuf;

use super::rule::{Rule, Value};
use super::words::Preset;

/// One key of the recipe.
#[derive(Debug)]
pub(super) struct Key {
    /// The section's name; empty for a key above all sections.
    pub(super) section: &'static str,
    /// The field's name, which is the key's with `_` for `-`.
    pub(super) field: &'static str,
    pub(super) doc: &'static str,
    pub(super) rule: Rule,
    /// TOML for quick, default, quality and paper; `_` where only the user can know.
    pub(super) columns: [&'static str; 4],
}

impl Key {
    /// The key within its section, such as `learning-rate`.
    pub(super) fn name(&self) -> String {
        self.field.replace('_', "-")
    }

    /// The key with its section, such as `training.learning-rate`.
    pub(super) fn id(&self) -> String {
        match self.section {
            "" => self.name(),
            section => format!("{section}.{}", self.name()),
        }
    }

    /// The value that a preset gives, as TOML; `None` where the recipe must give one.
    pub(super) fn column(&self, preset: Preset) -> Option<&'static str> {
        let [quick, default, quality, paper] = self.columns;
        let text = match preset {
            Preset::Quick => quick,
            Preset::Default => default,
            Preset::Quality => quality,
            Preset::Paper => paper,
        };
        (text != "_").then_some(text)
    }

    /// The value that a preset gives, `None` where the recipe must give one.
    pub(super) fn preset_value(&self, preset: Preset) -> Option<Value> {
        self.column(preset).map(|text| {
            toml::de::DeValue::parse(text)
                .map_err(|error| error.message().to_owned())
                .and_then(|value| self.rule.admit(value.get_ref()))
                .expect("each preset's column is read by the tests")
        })
    }
}

/// A section's name and what it is about.
#[derive(Debug)]
pub(super) struct Section {
    pub(super) name: &'static str,
    pub(super) doc: &'static str,
}

/// A type that a field of the recipe can have.
pub(super) trait Setting: Sized {
    /// The field, `None` if the value is of another type.
    fn from_value(value: Value) -> Option<Self>;
    /// The value that gives the field back.
    fn to_value(&self) -> Value;
}

macro_rules! settings {
    ($($Type:ty as $Variant:ident: $into:expr, $from:expr;)+) => { $(
        impl Setting for $Type {
            fn from_value(value: Value) -> Option<$Type> {
                match value { Value::$Variant(inner) => $into(inner), _ => None }
            }

            fn to_value(&self) -> Value {
                Value::$Variant($from(self))
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

/// Declares the recipe: sections of keys, each with its type, its four preset columns and its
/// rule. A doc comment becomes both the field's documentation and the comment in the TOML.
macro_rules! sections {
    ($(
        $(#[doc = $about:literal])+
        $section:ident: $Section:ident {
            $(
                $(#[doc = $doc:literal])+
                $field:ident: $type:ty = $quick:tt | $default:tt | $quality:tt | $paper:tt, $rule:expr;
            )+
        }
    )+) => {
        /// Everything that decides a run, every key with a value.
        #[derive(Debug, Clone, PartialEq)]
        pub struct Recipe {
            /// What the keys that the recipe left out fell back to.
            pub preset: Preset,
            $( $(#[doc = $about])+ pub $section: $Section, )+
        }

        $(
            $(#[doc = $about])+
            #[derive(Debug, Clone, PartialEq)]
            pub struct $Section {
                $(
                    $(#[doc = $doc])+
                    #[doc = concat!(
                        "\n\nPresets quick | default | quality | paper: `",
                        stringify!($quick), " | ", stringify!($default), " | ",
                        stringify!($quality), " | ", stringify!($paper),
                        "`; allowed: `", stringify!($rule), "`."
                    )]
                    pub $field: $type,
                )+
            }
        )+

        /// The sections in the order in which they are printed.
        pub(super) static SECTIONS: &[Section] = &[
            $( Section { name: stringify!($section), doc: concat!($($about),+) }, )+
        ];

        /// The keys of all sections, in the order in which they are printed.
        pub(super) static KEYS: &[Key] = &[
            $( $( Key {
                section: stringify!($section),
                field: stringify!($field),
                doc: concat!($($doc),+),
                rule: $rule,
                columns: [
                    stringify!($quick),
                    stringify!($default),
                    stringify!($quality),
                    stringify!($paper),
                ],
            }, )+ )+
        ];

        impl Recipe {
            /// The recipe with these values, which are in the order of `KEYS` and have passed
            /// their rules.
            pub(super) fn from_values(
                preset: Preset,
                values: impl IntoIterator<Item = Value>,
            ) -> Recipe {
                let mut values = values.into_iter();
                Recipe {
                    preset,
                    $( $section: $Section { $(
                        $field: values
                            .next()
                            .and_then(Setting::from_value)
                            .expect("one value per key, of the type that its rule admits"),
                    )+ }, )+
                }
            }

            /// The values in the order of `KEYS`.
            pub(super) fn values(&self) -> Vec<Value> {
                vec![ $( $( self.$section.$field.to_value(), )+ )+ ]
            }
        }
    };
}

pub(super) use sections;
