//! What a step is made of, how what is seen is judged, and the steps themselves: the table `steps.toml`.

use std::fmt;
use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use super::quantity::{Quantity, Value};
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
    /// The steps that have to have passed before anybody does what this one says, whoever asks for it: they keep a person
    /// from harm.
    #[serde(default)]
    pub guarded_by: Vec<String>,
    /// Whether the display is told to take [`FIRST_AMPLITUDE_MV`] first: its own after a start is 5 V.
    #[serde(default)]
    pub sets_amplitude: bool,
    /// What is measured. All of it has to be within its limit.
    pub measures: Vec<Measure>,
}

/// Who can tell how a step went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Witness {
    Boards,
    /// The USB of this computer: nothing is to be seen of a bench whose ports are named in its file.
    Usb,
    /// A person: with hands, eyes or an instrument.
    Person,
}

/// Something that is measured.
#[derive(Debug, Deserialize)]
pub struct Measure {
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
    AtLeast(f64),
    AtMost(f64),
    /// From the first to the second.
    Within(f64, f64),
    Word(String),
}

/// A value beside its limit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    pub what: String,
    /// Its unit; empty for words and counts.
    pub unit: String,
    /// Its value; none if it was not to be seen.
    pub value: Option<Value>,
    /// What it had to be, in words.
    pub limit: String,
    pub passes: bool,
    /// What to try, if it was not.
    pub advice: Option<String>,
}

impl Step {
    /// Whether it asks for an answer.
    pub fn asks(&self) -> bool {
        self.measures.iter().any(|measure| measure.seen.is_none())
    }

    /// What it measures, judged by what has been seen and by what `answer` makes of a question. Who is asked does
    /// something first, so no question is put where what is seen is not as it has to be.
    pub fn judge(
        &self,
        sight: &Sight,
        mut answer: impl FnMut(&Measure) -> Option<Value>,
    ) -> Vec<Figure> {
        let (seen, asked): (Vec<_>, Vec<_>) =
            self.measures.iter().partition(|of| of.seen.is_some());
        let of_boards =
            |measure: &&Measure| measure.judge(measure.seen?.value(sight), sight).into();
        let mut figures: Vec<Figure> = seen.iter().filter_map(of_boards).collect();
        if figures.iter().all(|figure| figure.passes) {
            figures.extend(asked.iter().map(|of| of.judge(answer(of), sight)));
        }
        figures
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

/// The amplitude that the first stroke is made with, in mV.
pub const FIRST_AMPLITUDE_MV: u16 = 1_000;

#[derive(Deserialize)]
struct Table {
    steps: Vec<Step>,
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    toml::from_str(include_str!("steps.toml")).expect("a table that the tests have read")
});

pub fn all() -> impl Iterator<Item = &'static Step> {
    TABLE.steps.iter()
}

pub fn named(name: &str) -> Option<&'static Step> {
    all().find(|step| step.name == name)
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

#[cfg(test)]
mod steps_tests {
    use super::*;
    use crate::bringup::sight::Sight;

    #[test]
    fn every_step_has_a_name_of_its_own_and_needs_only_what_comes_before_it() {
        let mut before = Vec::new();
        for step in all() {
            assert!(!before.contains(&step.name), "{} twice", step.name);
            for need in step.needs.iter().chain(&step.guarded_by) {
                assert!(before.contains(need), "{} before {need}", step.name);
            }
            before.push(step.name.clone());
        }
    }

    #[test]
    fn nobody_is_asked_to_put_a_finger_on_before_the_amplitude_is_seen_to_be_low() {
        let step = named("finger").expect("a step");
        assert!(step.sets_amplitude);
        for (amplitude, questions) in [
            (None, 0),
            (Some(Err("out of range".to_owned())), 0),
            (Some(Ok(5_000)), 0),
            (Some(Ok(FIRST_AMPLITUDE_MV)), 1),
        ] {
            let sight = Sight {
                amplitude,
                ..Sight::default()
            };
            let mut asked = 0;
            let figures = step.judge(&sight, |_| {
                asked += 1;
                Some(Value::Word("yes".to_owned()))
            });
            let passes = figures.iter().all(|figure| figure.passes);
            assert_eq!((asked, passes), (questions, questions == 1));
        }
    }

    #[test]
    fn where_nothing_is_seen_no_step_passes_and_each_says_what_to_try() {
        for step in all() {
            assert!(!step.measures.is_empty() && !step.to_do.is_empty());
            let figures = step.judge(&Sight::default(), |_| None);
            for figure in figures.iter().filter(|figure| !figure.passes) {
                assert!(
                    figure
                        .advice
                        .as_ref()
                        .is_some_and(|advice| advice.len() > 10)
                );
            }
            // What USB has attached is nothing, and so is what this user may not open.
            assert!(figures.iter().any(|figure| !figure.passes), "{}", step.name);
        }
    }
}
