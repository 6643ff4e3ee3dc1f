//! The table of faults, `catalogue.toml`: what each kind is, how it is done, and what is expected of the boards.

use std::sync::LazyLock;

use protocol::{Hold, Role, Trip};
use serde::de::Error;
use serde::{Deserialize, Deserializer};
use strum::IntoStaticStr;
use toml::{Table, Value};

use super::kind::Kind;

/// All kinds, in the order in which they are listed.
pub fn rows() -> &'static [Row] {
    static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| {
        let file: Catalogue =
            toml::from_str(include_str!("catalogue.toml")).expect("tests read it");
        let rows = file.fault.iter().map(|row| file.row(row.clone()));
        rows.collect::<Result<_, _>>().expect("tests read it")
    });
    &ROWS
}

/// What the catalogue says of a kind.
impl Kind {
    /// All of them, in the order of the catalogue.
    pub fn all() -> impl Iterator<Item = Self> {
        rows().iter().map(|row| row.kind)
    }

    /// What there is to know of it.
    pub fn row(self) -> &'static Row {
        &rows()[self as usize]
    }

    /// Its name in scenes.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// The kind of a name in scenes.
    pub fn from_name(name: &str) -> Option<Self> {
        rows()
            .iter()
            .find(|row| row.name == name)
            .map(|row| row.kind)
    }
}

#[derive(Deserialize)]
struct Catalogue {
    /// Signs that are named together.
    lists: Table,
    /// Templates of rows.
    like: Table,
    fault: Vec<Table>,
}

impl Catalogue {
    fn row(&self, mut row: Table) -> Result<Row, toml::de::Error> {
        while let Some(Value::String(name)) = row.remove("like") {
            let template = self.like.get(&name).and_then(Value::as_table);
            for (key, value) in template.ok_or_else(|| toml::de::Error::custom(&name))? {
                row.entry(key).or_insert_with(|| value.clone());
            }
        }
        for key in ["signs", "also"] {
            if let Some(Value::Array(signs)) = row.get_mut(key) {
                *signs = self.spread(signs);
            }
        }
        row.insert("name".to_owned(), row["kind"].clone());
        Value::Table(row).try_into()
    }

    /// Signs with each list's in place of its name.
    fn spread(&self, signs: &[Value]) -> Vec<Value> {
        let list = |sign: &Value| self.lists.get(sign.as_str()?)?.as_array();
        let spread = signs.iter().map(|sign| match list(sign) {
            Some(list) => self.spread(list),
            None => vec![sign.clone()],
        });
        spread.collect::<Vec<_>>().concat()
    }
}

/// What stands in the table for good.
fn text<'de, D: Deserializer<'de>>(from: D) -> Result<&'static str, D::Error> {
    Ok(String::deserialize(from)?.leak())
}

fn list<'de, D: Deserializer<'de>, T: Deserialize<'de>>(from: D) -> Result<&'static [T], D::Error> {
    Ok(Vec::deserialize(from)?.leak())
}

fn boards<'de, D: Deserializer<'de>>(from: D) -> Result<&'static [Role], D::Error> {
    let names = Vec::<String>::deserialize(from)?;
    let roles = names.iter().map(|name| board(name));
    let roles: Option<Vec<Role>> = roles.collect();
    Ok(roles.ok_or_else(|| D::Error::custom("no board"))?.leak())
}

fn board(name: &str) -> Option<Role> {
    let boards = [Role::Sensor, Role::Display];
    boards.into_iter().find(|role| role.name() == name)
}

/// A kind of fault.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Which.
    pub kind: Kind,
    /// Its name in scenes.
    #[serde(deserialize_with = "text")]
    pub name: &'static str,
    /// What breaks, for a person.
    #[serde(deserialize_with = "text")]
    pub meaning: &'static str,
    /// What the simulator does, and where.
    #[serde(deserialize_with = "text")]
    pub injected: &'static str,
    /// How long it lasts.
    #[serde(default)]
    pub lasts: Lasts,
    /// The keys that it takes beside `at_s`, `kind` and `for_s`.
    #[serde(default, deserialize_with = "list")]
    pub keys: &'static [Key],
    /// Where it can be done.
    #[serde(default)]
    pub needs: Needs,
    /// What the display is to do.
    #[serde(default)]
    pub class: Class,
    /// Time in ms in which all outputs have to be at 0 V; none if it can't put out a wrong voltage.
    pub safe_within_ms: Option<f64>,
    /// For which reasons the display may say that it has stopped: for one of them if it has to stop, and for
    /// nothing else.
    #[serde(default, deserialize_with = "list")]
    pub trips: &'static [Trip],
    /// What shows it: one of these has to. Without any it must not show.
    #[serde(default, deserialize_with = "list")]
    pub signs: &'static [Sign],
    /// In which time in ms; none if that depends on what arrives: then when that is a reason to hold.
    pub seen_within_ms: Option<f64>,
    /// When it shows.
    #[serde(default)]
    pub shows: Shows,
    /// From which time in ms on no estimate is stood by until it ends; none if what the sensor says is not affected.
    pub nothing_valid_after_ms: Option<f64>,
    /// What else may show. Anything else must not.
    #[serde(default, deserialize_with = "list")]
    pub also: &'static [Sign],
    /// Resets of the display board that may come of it.
    #[serde(default)]
    pub resets: usize,
    /// In which time in ms after its end the display drives again while the hand moves; none if it must not, or
    /// never ceases to.
    pub again_within_ms: Option<f64>,
    /// Whether the sensor forgets what it has felt: then the arm has to go over three waves anew as well.
    #[serde(default)]
    pub forgets: bool,
    /// Boards that it keeps from talking. The others go on: the sensor with estimates, the display with motions.
    #[serde(default, deserialize_with = "boards")]
    pub silences: &'static [Role],
    /// What is expected, for a person.
    #[serde(deserialize_with = "text")]
    pub expected: &'static str,
    /// How long a campaign looks on after it has begun, in s.
    #[serde(default = "quarter_s")]
    pub watch_s: f64,
}

fn quarter_s() -> f64 {
    0.25
}

/// How long a fault lasts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lasts {
    /// It happens, and takes no `for_s`.
    #[default]
    Once,
    /// So long in s, unless `for_s` says otherwise.
    For(f64),
    /// To the end, unless `for_s` says otherwise.
    ForGood,
}

/// Where a fault can be done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Needs {
    /// In both engines.
    Nothing,
    /// On emulated boards.
    #[default]
    Boards,
}

/// When a fault shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shows {
    /// From its beginning on.
    #[default]
    Meanwhile,
    /// Once it is over: nobody is there to say so before.
    WhenOver,
    /// While the display drives: else no words go out, and CLR is low.
    WhileDriving,
}

/// What the display is to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, IntoStaticStr)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Class {
    /// 0 V for good: until its power goes.
    #[default]
    Stops,
    /// 0 V until what is wrong is over, then it may drive again.
    Fades,
    /// It drives on: nothing wrong can come of it.
    Holds,
    /// The sensor board's: the display holds, or fades if it lasts.
    Sensor,
}

/// What shows from outside that something is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub enum Sign {
    /// The display says that it is on its way to 0 V, and why.
    Fading(Hold),
    /// The display says that it has stopped, and why.
    Stopped(Trip),
    /// A counter of a board's port, or of the board itself, has gone up; its name as in `Status`.
    Counted(Role, &'static str),
    /// The converters' clear line fell.
    ClearFell,
    /// A board was reset, and not by the scene.
    Reset(Role),
    /// A board greets as one that has just started.
    Greets(Role),
    /// The display refuses a setting.
    Refuses,
    /// The sensor says that the gauge is not well.
    GaugeNotGood,
    /// The sensor stands by no estimate.
    NoValidEstimate,
    /// The sensor says that it has stopped the arm, and why.
    ArmStopped(Trip),
}

impl TryFrom<String> for Sign {
    type Error = String;

    /// As `catalogue.toml` has it.
    fn try_from(text: String) -> Result<Self, String> {
        let trip = |why: &str| {
            let mut all = Trip::ALL.into_iter();
            all.find(|trip| format!("{trip:?}") == why)
        };
        let known = match text.split(' ').collect::<Vec<_>>()[..] {
            ["fading", why] => Hold::ALL
                .into_iter()
                .find(|hold| format!("{hold:?}") == why)
                .map(Self::Fading),
            ["stopped", why] => trip(why).map(Self::Stopped),
            ["arm-stopped", why] => trip(why).map(Self::ArmStopped),
            ["clear-fell"] => Some(Self::ClearFell),
            ["refuses"] => Some(Self::Refuses),
            ["gauge-not-good"] => Some(Self::GaugeNotGood),
            ["no-valid-estimate"] => Some(Self::NoValidEstimate),
            [name, "reset"] => board(name).map(Self::Reset),
            [name, "greets"] => board(name).map(Self::Greets),
            [name, counter] => {
                board(name).map(|role| Self::Counted(role, counter.to_owned().leak()))
            }
            _ => None,
        };
        known.ok_or_else(|| format!("\"{text}\" is no sign"))
    }
}

/// A number that a kind takes.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Key {
    /// Its name in scenes.
    #[serde(deserialize_with = "text")]
    pub name: &'static str,
    /// What it is, with its unit.
    #[serde(deserialize_with = "text")]
    pub meaning: &'static str,
    /// Its value if it is not given.
    pub default: f64,
    /// Its lowest value.
    pub low: f64,
    /// Its highest value.
    pub high: f64,
    /// Whether it is a whole number.
    #[serde(default)]
    pub whole: bool,
    /// Between which values a campaign draws it; if none, it leaves it at its default.
    pub drawn: Option<(f64, f64)>,
}

impl Lasts {
    /// `for_s` where the scene gives none.
    pub const fn default_s(self) -> Option<f64> {
        match self {
            Self::For(s) => Some(s),
            Self::Once | Self::ForGood => None,
        }
    }
}

impl Class {
    /// Its name in the list and in the campaign's table.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Whether the display may drive again before its power has gone.
    pub const fn may_drive_again(self) -> bool {
        !matches!(self, Self::Stops)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::scene::fault::MOST_KEYS;

    #[test]
    fn every_kind_has_one_row_and_a_kebab_case_name() {
        let kinds: HashSet<Kind> = rows().iter().map(|row| row.kind).collect();
        let names: HashSet<&str> = rows().iter().map(|row| row.name).collect();
        assert_eq!((kinds.len(), names.len()), (rows().len(), rows().len()));
        // Clock drift is declared last.
        assert_eq!(rows().len(), Kind::ClockDrift as usize + 1);
        for row in rows() {
            let kebab = |byte: u8| byte.is_ascii_lowercase() || byte == b'-';
            assert!(row.name.bytes().all(kebab), "{}", row.name);
            assert_eq!(Kind::from_name(row.name), Some(row.kind));
            assert_eq!(row.kind.row().kind, row.kind);
        }
    }

    #[test]
    fn defaults_are_within_their_ranges_and_what_is_drawn_too() {
        for row in rows() {
            assert!(row.keys.len() <= MOST_KEYS);
            for key in row.keys {
                let allowed = key.low..=key.high;
                let (low, high) = key.drawn.unwrap_or((key.default, key.default));
                assert!(
                    [key.default, low, high].iter().all(|v| allowed.contains(v)),
                    "{} {}",
                    row.name,
                    key.name
                );
            }
        }
    }

    #[test]
    fn what_can_put_out_a_wrong_voltage_is_to_be_seen_and_leads_to_zero() {
        for row in rows() {
            if row.safe_within_ms.is_some() {
                assert!(!row.signs.is_empty(), "{}", row.name);
                let ends = matches!(row.class, Class::Stops | Class::Fades);
                assert!(ends, "{}", row.name);
            }
            assert!(row.watch_s >= row.lasts.default_s().unwrap_or(0.0));
        }
    }

    #[test]
    fn every_row_says_how_it_ends_and_a_campaign_looks_on_until_then() {
        for row in rows() {
            assert_eq!(
                row.class == Class::Stops,
                !row.trips.is_empty(),
                "{}",
                row.name
            );
            let ends_ms = row.lasts.default_s().unwrap_or(0.0) * 1e3;
            if let Some(again_ms) = row.again_within_ms {
                assert!(row.class.may_drive_again(), "{}", row.name);
                assert!(row.watch_s * 1e3 > ends_ms + again_ms, "{}", row.name);
            }
            if let Some(seen_ms) = row.seen_within_ms {
                assert!(row.watch_s * 1e3 > seen_ms, "{}", row.name);
            }
        }
    }
}
