//! How the recipe's keys are declared: `section!` turns one table of keys into the struct that the
//! program reads and into [`Key`]s, from which parsing, checks and printing all work.

use super::rule::{Rule, Value};
use super::words::Preset;

/// One key of the recipe.
#[derive(Debug)]
pub(crate) struct Key {
    /// The section's name; empty for a key above all sections.
    pub(crate) section: &'static str,
    /// The field's name, which is the key's with `_` for `-`.
    pub(crate) field: &'static str,
    /// What it means: the comment above it.
    pub(crate) doc: &'static str,
    /// What it accepts.
    pub(crate) rule: Rule,
    /// TOML for instant, quick, default, quality and paper; `_` where only the user can know.
    pub(crate) columns: [&'static str; 5],
}

impl Key {
    /// The key within its section, such as `learning-rate`.
    pub(crate) fn name(&self) -> String {
        self.field.replace('_', "-")
    }

    /// The key with its section, such as `training.learning-rate`.
    pub(crate) fn id(&self) -> String {
        match self.section {
            "" => self.name(),
            section => format!("{section}.{}", self.name()),
        }
    }

    /// The value that a preset gives, as TOML; `None` where the recipe must give one.
    pub(crate) fn column(&self, preset: Preset) -> Option<&'static str> {
        let [instant, quick, default, quality, paper] = self.columns;
        let text = match preset {
            Preset::Instant => instant,
            Preset::Quick => quick,
            Preset::Default => default,
            Preset::Quality => quality,
            Preset::Paper => paper,
        };
        (text != "_").then_some(text)
    }

    /// The value that a preset gives, `None` where the recipe must give one.
    pub(crate) fn preset_value(&self, preset: Preset) -> Option<Value> {
        self.column(preset).map(|text| self.value(text))
    }

    /// The value that TOML of our own tables stands for.
    ///
    /// # Panics
    /// If the key does not take it, which the tests of the tables rule out.
    pub(crate) fn value(&self, text: &str) -> Value {
        toml::de::DeValue::parse(text)
            .map_err(|error| error.message().to_owned())
            .and_then(|value| self.rule.admit(value.get_ref()))
            .expect("each value of the tables is read by the tests")
    }
}

/// A section: its name, what it is about, and its keys in the order in which they are printed.
#[derive(Debug)]
pub(crate) struct Section {
    pub(crate) name: &'static str,
    pub(crate) doc: &'static str,
    pub(crate) keys: &'static [Key],
}

/// The typed form of a section.
pub(crate) trait Keyed: Sized {
    /// The section that it is the form of.
    const SECTION: &'static Section;

    /// The section with these values, one for each key in their order, which have passed their rules.
    fn from_values(values: impl IntoIterator<Item = Option<Value>>) -> Self;

    /// The values in the order of the keys.
    fn to_values(&self) -> Vec<Option<Value>>;
}

/// Declares one section of keys, each with its type, its five preset columns and its rule. A doc
/// comment becomes both the field's documentation and the comment in the TOML.
macro_rules! section {
    (
        $(#[doc = $about:literal])+
        $section:ident: $Section:ident {
            $(
                $(#[doc = $doc:literal])+
                $field:ident: $type:ty = $instant:tt | $quick:tt | $default:tt | $quality:tt | $paper:tt, $rule:expr;
            )+
        }
    ) => {
        $(#[doc = $about])+
        #[allow(unreachable_pub, reason = "the sections of one method alone are of this crate")]
        #[derive(Debug, Clone, PartialEq)]
        pub struct $Section {
            $(
                $(#[doc = $doc])+
                #[doc = concat!(
                    "\n\nPresets instant | quick | default | quality | paper: `",
                    stringify!($instant), " | ", stringify!($quick), " | ", stringify!($default), " | ",
                    stringify!($quality), " | ", stringify!($paper),
                    "`; allowed: `", stringify!($rule), "`."
                )]
                pub $field: $type,
            )+
        }

        impl $crate::recipe::schema::Keyed for $Section {
            const SECTION: &'static $crate::recipe::schema::Section =
                &$crate::recipe::schema::Section {
                    name: stringify!($section),
                    doc: concat!($($about),+),
                    keys: &[$(
                        $crate::recipe::schema::Key {
                            section: stringify!($section),
                            field: stringify!($field),
                            doc: concat!($($doc),+),
                            rule: $rule,
                            columns: [
                                stringify!($instant),
                                stringify!($quick),
                                stringify!($default),
                                stringify!($quality),
                                stringify!($paper),
                            ],
                        },
                    )+],
                };

            fn from_values(
                values: impl IntoIterator<Item = Option<$crate::recipe::rule::Value>>,
            ) -> Self {
                let mut values = values.into_iter();
                Self { $(
                    $field: match values.next().flatten() {
                        Some(value) => $crate::recipe::setting::Setting::from_value(value),
                        None => $crate::recipe::setting::Setting::absent(),
                    }
                    .expect("one value per key, of the type that its rule admits"),
                )+ }
            }

            fn to_values(&self) -> Vec<Option<$crate::recipe::rule::Value>> {
                vec![$( $crate::recipe::setting::Setting::to_value(&self.$field), )+]
            }
        }
    };
}

pub(crate) use section;
