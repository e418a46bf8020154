//! What a recipe key accepts: its type, its range, its unit and what 0 means, and the value that
//! comes out of TOML when it does.

use std::fmt;

use toml::de::DeValue;

/// A value that has passed its key's rule.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value {
    Whole(u64),
    Number(f64),
    Numbers(Vec<f64>),
    Flag(bool),
    Text(String),
}

/// The value as TOML; reading it again gives the same value.
impl fmt::Display for Value {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Whole(number) => write!(out, "{number}"),
            Value::Number(number) => write_number(out, *number),
            Value::Numbers(numbers) => {
                out.write_str("[")?;
                for (place, number) in numbers.iter().enumerate() {
                    out.write_str(if place == 0 { "" } else { ", " })?;
                    write_number(out, *number)?;
                }
                out.write_str("]")
            }
            Value::Flag(flag) => write!(out, "{flag}"),
            Value::Text(text) => write!(out, "{}", toml::Value::String(text.clone())),
        }
    }
}

/// Shortest form that reads back exactly: 100, 0.001, 1e-7.
fn write_number(out: &mut fmt::Formatter<'_>, number: f64) -> fmt::Result {
    if number.fract() == 0.0 && number.abs() < 1e15 {
        write!(out, "{number:.0}")
    } else {
        write!(out, "{number:?}")
    }
}

/// The type of a key and its range.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind {
    Whole {
        low: u64,
        high: u64,
    },
    Number(Range),
    /// A list with at least one number.
    Numbers(Range),
    Flag,
    /// One of these words.
    Word(&'static [&'static str]),
    Path,
    /// One of these words, or a path.
    WordOrPath(&'static [&'static str]),
}

/// A range of numbers; `above` leaves `low` itself out.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Range {
    pub(crate) low: f64,
    pub(crate) above: bool,
    pub(crate) high: f64,
}

/// What a key accepts, and how messages and comments put it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rule {
    pub(crate) kind: Kind,
    unit: &'static str,
    zero: &'static str,
}

impl Rule {
    const fn of(kind: Kind) -> Rule {
        Rule {
            kind,
            unit: "",
            zero: "",
        }
    }

    /// A whole number, both ends included.
    pub(crate) const fn whole(low: u64, high: u64) -> Rule {
        Rule::of(Kind::Whole { low, high })
    }

    /// A number, both ends included.
    pub(crate) const fn number(low: f64, high: f64) -> Rule {
        Rule::of(Kind::Number(Range {
            low,
            above: false,
            high,
        }))
    }

    /// A finite number that is 0 or more, such as the weight of a term.
    pub(crate) const fn positive_or_zero() -> Rule {
        Rule::number(0.0, f64::INFINITY)
    }

    /// A number above 0 and at most `high`.
    pub(crate) const fn above_zero(high: f64) -> Rule {
        Rule::of(Kind::Number(Range {
            low: 0.0,
            above: true,
            high,
        }))
    }

    /// A list of at least one number, each above 0 and at most `high`.
    pub(crate) const fn list_above_zero(high: f64) -> Rule {
        Rule::of(Kind::Numbers(Range {
            low: 0.0,
            above: true,
            high,
        }))
    }

    /// A list of at least one number, both ends included.
    pub(crate) const fn list(low: f64, high: f64) -> Rule {
        Rule::of(Kind::Numbers(Range {
            low,
            above: false,
            high,
        }))
    }

    /// `true` or `false`.
    pub(crate) const fn flag() -> Rule {
        Rule::of(Kind::Flag)
    }

    /// One of `words`.
    pub(crate) const fn word(words: &'static [&'static str]) -> Rule {
        Rule::of(Kind::Word(words))
    }

    /// The path of a file.
    pub(crate) const fn path() -> Rule {
        Rule::of(Kind::Path)
    }

    /// One of `words` or the path of a file.
    pub(crate) const fn word_or_path(words: &'static [&'static str]) -> Rule {
        Rule::of(Kind::WordOrPath(words))
    }

    /// The same rule for a quantity in this unit.
    pub(crate) const fn unit(self, unit: &'static str) -> Rule {
        Rule { unit, ..self }
    }

    /// The same rule, where 0 does this.
    pub(crate) const fn zero(self, zero: &'static str) -> Rule {
        Rule { zero, ..self }
    }

    /// Whether a value given on the command line may come without quotes.
    pub(crate) fn takes_text(&self) -> bool {
        matches!(self.kind, Kind::Word(_) | Kind::Path | Kind::WordOrPath(_))
    }

    /// The values allowed and what 0 does, as in "0 or more (0 turns volume preservation off)".
    pub(crate) fn allowed(&self) -> String {
        match self.zero {
            "" => self.range(),
            zero => format!("{} (0 {zero})", self.range()),
        }
    }

    /// The same with the unit, as it stands in a comment above the key.
    pub(crate) fn described(&self) -> String {
        let mut described = match self.unit {
            "" => self.range(),
            unit => format!("{unit}, {}", self.range()),
        };
        if !self.zero.is_empty() {
            described.push_str("; 0 ");
            described.push_str(self.zero);
        }
        described
    }

    fn range(&self) -> String {
        match self.kind {
            Kind::Whole { low, high } => format!("from {low} to {}", grouped(high)),
            Kind::Number(range) => range.to_string(),
            Kind::Numbers(range) => format!("a list of numbers, each {range}"),
            Kind::Flag => "true or false".to_owned(),
            Kind::Word(words) => listed(words),
            Kind::Path => "the path of a file".to_owned(),
            Kind::WordOrPath(words) => {
                format!(
                    "{} or the path of a file (folder/name.extension)",
                    quoted(words).join(", ")
                )
            }
        }
    }

    /// The value, or what it must be instead.
    ///
    /// # Errors
    /// The end of a sentence that begins with "must be".
    pub(crate) fn admit(&self, found: &DeValue<'_>) -> Result<Value, String> {
        match self.kind {
            Kind::Whole { low, high } => {
                let DeValue::Integer(digits) = found else {
                    return Err(format!("a whole number {}", self.allowed()));
                };
                u64::from_str_radix(digits.as_str(), digits.radix())
                    .ok()
                    .filter(|number| (low..=high).contains(number))
                    .map(Value::Whole)
                    .ok_or_else(|| self.allowed())
            }
            Kind::Number(range) => self.number_within(found, range).map(Value::Number),
            Kind::Numbers(range) => match found.as_array() {
                Some(items) if !items.is_empty() => items
                    .iter()
                    .map(|item| {
                        self.number_within(item.get_ref(), range)
                            .map_err(|_allowed_for_one| self.allowed())
                    })
                    .collect::<Result<_, _>>()
                    .map(Value::Numbers),
                _ => Err(self.allowed()),
            },
            Kind::Flag => found
                .as_bool()
                .map(Value::Flag)
                .ok_or_else(|| self.allowed()),
            Kind::Word(words) => self.text(found, |text| words.contains(&text)),
            Kind::Path => self.text(found, |text| !text.is_empty()),
            Kind::WordOrPath(words) => {
                self.text(found, |text| words.contains(&text) || looks_like_path(text))
            }
        }
    }

    fn number_within(&self, found: &DeValue<'_>, range: Range) -> Result<f64, String> {
        let number = match found {
            DeValue::Float(digits) => digits.as_str().parse().ok(),
            DeValue::Integer(digits) => i128::from_str_radix(digits.as_str(), digits.radix())
                .map(|whole| whole as f64)
                .ok(),
            _ => return Err(format!("a number, {}", self.allowed())),
        };
        // Networks and losses are in single precision, where a greater number is an infinity.
        match number.filter(|number: &f64| (*number as f32).is_finite()) {
            Some(number) if range.contains(number) => Ok(number),
            Some(_) => Err(self.allowed()),
            None => Err(format!(
                "a finite number in single precision, {}",
                self.allowed()
            )),
        }
    }

    fn text(&self, found: &DeValue<'_>, fits: impl Fn(&str) -> bool) -> Result<Value, String> {
        match found.as_str() {
            Some(text) if fits(text) => Ok(Value::Text(text.to_owned())),
            _ => Err(self.allowed()),
        }
    }
}

impl Range {
    fn contains(self, number: f64) -> bool {
        let low_enough = number <= self.high;
        let high_enough = if self.above {
            number > self.low
        } else {
            number >= self.low
        };
        low_enough && high_enough
    }
}

impl fmt::Display for Range {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.above, self.high.is_finite()) {
            (false, false) => write!(out, "{} or more", self.low),
            (false, true) => write!(out, "from {} to {}", self.low, self.high),
            (true, false) => write!(out, "above {}", self.low),
            (true, true) => write!(out, "above {} and at most {}", self.low, self.high),
        }
    }
}

/// A misspelt word is not taken for a file: a path has a folder or an extension.
pub(crate) fn looks_like_path(text: &str) -> bool {
    text.contains(['.', '/', std::path::MAIN_SEPARATOR])
}

fn quoted(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| format!("\"{word}\"")).collect()
}

/// `"a", "b" or "c"`.
fn listed(words: &[&str]) -> String {
    match quoted(words).split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => String::new(),
    }
}

/// The digits in threes, as TOML reads them: 10_000_000.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut grouped = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && digits.len() > 4 && (digits.len() - place).is_multiple_of(3) {
            grouped.push('_');
        }
        grouped.push(digit);
    }
    grouped
}
