//! The keys that choose between words, as enums: `words!` gives each its spelling in the recipe,
//! `words_of!` gives one to enums of the model.

use std::fmt;
use std::path::PathBuf;

use isomorph_model::operators::Derivatives;
use isomorph_model::trajectory::Integrator;

use super::rule::{Value, looks_like_path};
use super::setting::Setting;

/// Declares enums whose variants are words of the recipe.
macro_rules! words {
    ($(
        $(#[$about:meta])+
        $Name:ident { $( $(#[$meaning:meta])+ $Variant:ident = $word:literal, )+ }
    )+) => { $(
        $(#[$about])+
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $Name { $( $(#[$meaning])+ $Variant, )+ }

        impl $Name {
            /// Every variant.
            pub const ALL: &'static [$Name] = &[$($Name::$Variant),+];

            /// Every word, in the order of the variants.
            pub const WORDS: &'static [&'static str] = &[$($word),+];

            /// The variant as it is written in a recipe.
            pub const fn word(self) -> &'static str {
                match self { $( $Name::$Variant => $word, )+ }
            }

            /// The variant that `word` spells, if one does.
            pub fn from_word(word: &str) -> Option<$Name> {
                match word { $( $word => Some($Name::$Variant), )+ _ => None }
            }
        }

        impl fmt::Display for $Name {
            fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                out.write_str(self.word())
            }
        }

        impl Setting for $Name {
            fn from_value(value: Value) -> Option<$Name> {
                match value { Value::Text(word) => $Name::from_word(&word), _ => None }
            }

            fn to_value(&self) -> Option<Value> {
                Some(Value::Text(self.word().to_owned()))
            }
        }
    )+ };
}

words! {
    /// Values of all keys that a recipe does not give.
    Preset {
        /// A result within seconds on a CPU: splines, solved for.
        Instant = "instant",
        /// A first result of networks within minutes on a CPU.
        Quick = "quick",
        /// The balance of quality and time that the project recommends.
        Default = "default",
        /// The best results, and slow.
        Quality = "quality",
        /// The paper's networks, weights and schedule, with the least corrections that make
        /// them work.
        Paper = "paper",
    }

    /// Where the normals of the shapes come from.
    NormalSource {
        /// Those given with a shape, else estimated ones.
        Auto = "auto",
        /// Those given with the shapes; both must have them.
        Given = "given",
        /// Estimated from the neighbours of each point and oriented, given ones or not.
        Estimate = "estimate",
        /// None: the terms that need them are left out.
        None = "none",
    }

    /// Whether raw scans are cleaned.
    Cleaning {
        /// What is no part of a surface is left out.
        Auto = "auto",
        /// All points are used.
        None = "none",
    }

    /// Whether shapes are laid onto each other before anything is learned.
    Align {
        /// They lie as their files say.
        None = "none",
        /// By turns and shifts.
        Rigid = "rigid",
        /// By turns, shifts and factors of size.
        Similarity = "similarity",
        /// By what is clearly needed: mostly nothing.
        Auto = "auto",
    }

    /// The nonlinearity of a network.
    Activation {
        /// `ln(1 + exp(beta x)) / beta`.
        Softplus = "softplus",
        /// `sin(beta x)`.
        Sine = "sine",
    }

    /// Where `f(x, t)` comes from.
    GeometryKind {
        /// One network of position and time.
        Network = "network",
        /// Two end fields, carried by the flow of `V`.
        Flow = "flow",
    }

    /// What `V` is made of.
    VelocityKind {
        /// A network, which is trained.
        Network = "network",
        /// Splines, which are solved for.
        Spline = "spline",
        /// Splines, which are solved for and then trained like a network.
        TrainedSpline = "trained-spline",
    }

    /// The form of the level-set equation.
    LevelSetForm {
        /// Modified: `f_t + V.grad f + lambda_l f R = 0`, `R = -<J n, n>`.
        Mlse = "mlse",
        /// Original: `f_t + V.grad f = 0`, with the Eikonal equation beside it.
        Olse = "olse",
    }

    /// What moves the weights against their gradients.
    Optimiser {
        /// Adam for all weights.
        Adam = "adam",
        /// Muon for the matrices between hidden layers, Adam for all other weights.
        Muon = "muon",
    }

    /// How the learning rates fall over the steps.
    Schedule {
        /// Along half a cosine wave down to `final-learning-rate`.
        Cosine = "cosine",
        /// By the factor `decay` every `decay-every` of the steps.
        Step = "step",
    }

    /// How the motion through many key frames is found.
    Motion {
        /// One field through all of them, smooth in time.
        Smooth = "smooth",
        /// From each to the next by itself; the speed may jump at a key frame.
        Pairs = "pairs",
    }

    /// The times at which the terms between the shapes are sampled.
    TimeSampling {
        /// Uniform in [0, 1], with a share exactly at both ends.
        Random = "random",
        /// The multiples of `1 / time-steps`.
        Grid = "grid",
    }
}

/// Spells enums of the model in the recipe.
macro_rules! words_of {
    ($( $Name:ident as $WORDS:ident { $( $Variant:ident = $word:literal, )+ } )+) => { $(
        #[doc = concat!("The words of a recipe for [`", stringify!($Name), "`].")]
        pub const $WORDS: &[&str] = &[$($word),+];

        impl Setting for $Name {
            fn from_value(value: Value) -> Option<$Name> {
                match value {
                    Value::Text(word) => match word.as_str() {
                        $( $word => Some($Name::$Variant), )+
                        _ => None,
                    },
                    _ => None,
                }
            }

            fn to_value(&self) -> Option<Value> {
                let word = match self { $( $Name::$Variant => $word, )+ };
                Some(Value::Text(word.to_owned()))
            }
        }
    )+ };
}

words_of! {
    Integrator as INTEGRATORS { Euler = "euler", Midpoint = "midpoint", Rk4 = "rk4", }
    Derivatives as DERIVATIVES { Nested = "nested", Forward = "forward", }
}

/// Which points of the two shapes are known to correspond.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Correspondences {
    /// None are known.
    None,
    /// Vertex i of the source is vertex i of the target.
    SameVertices,
    /// Pairs that are found before training, from the shapes alone.
    Match,
    /// The pairs, or the map, of a file.
    File(PathBuf),
}

impl Correspondences {
    /// The words that stand for no file.
    pub const WORDS: &'static [&'static str] = &["none", "same-vertices", "match"];
}

impl Setting for Correspondences {
    fn from_value(value: Value) -> Option<Correspondences> {
        match value {
            Value::Text(text) => Some(match text.as_str() {
                "none" => Correspondences::None,
                "same-vertices" => Correspondences::SameVertices,
                "match" => Correspondences::Match,
                _ => Correspondences::File(text.into()),
            }),
            _ => None,
        }
    }

    fn to_value(&self) -> Option<Value> {
        Some(Value::Text(match self {
            Correspondences::None => "none".to_owned(),
            Correspondences::SameVertices => "same-vertices".to_owned(),
            Correspondences::Match => "match".to_owned(),
            // A name without folder or extension would read as a misspelt word.
            Correspondences::File(path) => match path.to_string_lossy() {
                text if looks_like_path(&text) => text.into_owned(),
                text => format!("./{text}"),
            },
        }))
    }
}
