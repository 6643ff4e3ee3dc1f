//! What a step is made of, and how what is seen is judged.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::quantity::Quantity;
use super::sight::Sight;

/// A step of bringing a bench up.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Its name, in commands and in the state file: never changes.
    pub name: String,
    /// The section of "Your first bench" that it is of.
    pub section: u8,
    /// What it is about, in a line.
    pub title: String,
    /// What to wire or to do before it is measured.
    pub to_do: String,
    /// Who can tell how it went.
    pub witness: Witness,
    /// The steps without which it can't pass.
    pub needs: Vec<String>,
    /// What is measured. All of it has to be within its limit.
    pub measures: Vec<Measure>,
}

/// Who can tell how a step went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Witness {
    /// The boards.
    Boards,
    /// The USB of this computer: nothing is to be seen of a bench whose ports are named in its file.
    Usb,
    /// A person: with hands, eyes or an instrument.
    Person,
}

/// Something that is measured.
#[derive(Debug, Deserialize)]
pub struct Measure {
    /// What it is.
    pub what: String,
    /// Its unit; empty for words and counts.
    #[serde(default)]
    pub unit: String,
    /// What is seen of the bench; none if a person is asked.
    pub seen: Option<Quantity>,
    /// What it has to be.
    #[serde(flatten)]
    pub limit: Limit,
    /// What to try if it is not; none if that follows from what is seen.
    pub advice: Option<String>,
}

/// What a value has to be.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Limit {
    /// This or more.
    AtLeast(f64),
    /// This or less.
    AtMost(f64),
    /// From the first to the second.
    Within(f64, f64),
    /// This word.
    Word(String),
}

/// What was measured: in JSON a number or a string.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
// Not untagged: serde does not tell a number by that where a crate of the build wants numbers of any precision.
#[serde(from = "serde_json::Value", into = "serde_json::Value")]
pub enum Value {
    /// A number, in its measure's unit.
    Number(f64),
    /// A word.
    Word(String),
}

/// A value beside its limit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// What was measured.
    pub what: String,
    /// Its unit; empty for words and counts.
    pub unit: String,
    /// Its value; none if it was not to be seen.
    pub value: Option<Value>,
    /// What it had to be, in words.
    pub limit: String,
    /// Whether it was.
    pub passes: bool,
    /// What to try, if it was not.
    pub advice: Option<String>,
}

impl Step {
    /// Whether it asks for an answer.
    pub fn asks(&self) -> bool {
        self.measures.iter().any(|measure| measure.seen.is_none())
    }

    /// Everything that it measures, judged by what has been seen and by what `answer` makes of a question.
    pub fn judge(
        &self,
        sight: &Sight,
        mut answer: impl FnMut(&Measure) -> Option<Value>,
    ) -> Vec<Figure> {
        let judge = |measure: &Measure| {
            let value = match measure.seen {
                Some(quantity) => quantity.value(sight),
                None => answer(measure),
            };
            measure.judge(value, sight)
        };
        self.measures.iter().map(judge).collect()
    }
}

impl Measure {
    fn judge(&self, value: Option<Value>, sight: &Sight) -> Figure {
        let passes = value.as_ref().is_some_and(|value| self.limit.holds(value));
        let advice = || {
            let seen = || self.seen.map(|quantity| quantity.advice(sight));
            self.advice.clone().or_else(seen).unwrap_or_default()
        };
        Figure {
            what: self.what.clone(),
            unit: self.unit.clone(),
            value,
            limit: self.limit.to_string(),
            passes,
            advice: (!passes).then(advice),
        }
    }
}

impl Limit {
    fn holds(&self, value: &Value) -> bool {
        match (self, value) {
            (Self::AtLeast(low), Value::Number(number)) => number >= low,
            (Self::AtMost(high), Value::Number(number)) => number <= high,
            (Self::Within(low, high), Value::Number(number)) => (low..=high).contains(&number),
            (Self::Word(due), Value::Word(word)) => due == word,
            _ => false,
        }
    }
}

impl From<serde_json::Value> for Value {
    fn from(value: serde_json::Value) -> Self {
        match (value.as_f64(), value.as_str()) {
            (Some(number), _) => Self::Number(number),
            (None, Some(word)) => Self::Word(word.to_owned()),
            (None, None) => Self::Word(value.to_string()),
        }
    }
}

impl From<Value> for serde_json::Value {
    fn from(value: Value) -> Self {
        match value {
            Value::Number(number) => Self::from(number),
            Value::Word(word) => Self::String(word),
        }
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtLeast(low) => write!(f, "at least {low}"),
            Self::AtMost(0.0) => f.write_str("0"),
            Self::AtMost(high) => write!(f, "at most {high}"),
            Self::Within(low, high) => write!(f, "{low} to {high}"),
            Self::Word(word) => f.write_str(word),
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) if number.fract() == 0.0 => write!(f, "{number}"),
            Self::Number(number) => write!(f, "{number:.3}"),
            Self::Word(word) => f.write_str(word),
        }
    }
}

/// `estimates a second: 99.8 Hz (98 to 102)`.
impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (what, unit, limit) = (&self.what, &self.unit, &self.limit);
        let gap = if unit.is_empty() { "" } else { " " };
        match &self.value {
            Some(value) => write!(f, "{what}: {value}{gap}{unit} (has to be: {limit})"),
            None => write!(f, "{what}: not to be seen (has to be: {limit}{gap}{unit})"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_beyond_its_limit_or_not_seen_or_of_another_kind_does_not_pass() {
        let number = |value| Some(Value::Number(value));
        let word = |text: &str| Some(Value::Word(text.to_owned()));
        let known = || Limit::Word("known".to_owned());
        for (limit, value, passes) in [
            (Limit::AtLeast(2.0), number(2.0), true),
            (Limit::AtLeast(2.0), number(1.9), false),
            (Limit::AtMost(0.0), number(0.0), true),
            (Limit::AtMost(0.0), number(1.0), false),
            (Limit::Within(1.0, 2.0), number(2.1), false),
            (Limit::Within(1.0, 2.0), number(f64::NAN), false),
            (Limit::AtLeast(f64::MIN), number(f64::NAN), false),
            (known(), word("known"), true),
            (known(), word("absent"), false),
            (known(), number(1.0), false),
            (Limit::AtLeast(0.0), word("known"), false),
            (Limit::AtLeast(0.0), None, false),
        ] {
            let measure = Measure {
                what: "it".to_owned(),
                unit: String::new(),
                seen: None,
                limit: limit.clone(),
                advice: Some("see the wire".to_owned()),
            };
            let figure = measure.judge(value.clone(), &Sight::default());
            assert_eq!(figure.passes, passes, "{limit:?} {value:?}");
            assert_eq!(figure.advice.is_none(), passes);
        }
    }
}
