//! What is said to the boards: questions for their configurations, and changes of them.
//!
//! A configuration is taken as a whole, and another program may have changed it. So it is read right before it
//! is changed, and the change names what it replaces: if that is not in force any more, the board refuses, and
//! the change is made again of what is. If no answer comes, the same is done again.

use protocol::actuators::{self, ACTUATOR_BLOCK, ACTUATORS, Actuator, Actuators};
use protocol::{Configuration, ConfigurationReport, Configure, Message, Question, Refusal};

use super::settings::{Misread, Setting};
use crate::clock::is_due;

/// A question, or a change, that was not answered is repeated after so long, in µs.
const AGAIN_US: u64 = 300_000;
/// A change that was not answered is given up after so long, in µs.
const GIVEN_UP_US: u64 = 2_000_000;

/// What is to be changed of a board's configuration, all at once.
#[derive(Clone, Debug, Default)]
pub struct Change {
    /// Settings, each with its new value as it was typed.
    pub settings: Vec<(&'static Setting, String)>,
    /// What the display's fingertip carries.
    pub actuators: Option<Box<[Actuator; ACTUATORS]>>,
}

impl Change {
    /// Whether nothing is to be changed.
    pub const fn is_empty(&self) -> bool {
        self.settings.is_empty() && self.actuators.is_none()
    }

    /// `configuration` with the change made. Fails if a text is no value of its setting.
    fn of(&self, mut configuration: Configuration) -> Result<Configuration, Misread> {
        for (setting, text) in &self.settings {
            configuration = setting.changed(configuration, text)?;
        }
        if let (Configuration::Display(display), Some(described)) =
            (&mut configuration, &self.actuators)
        {
            display.actuators = actuators::hash(described);
        }
        Ok(configuration)
    }

    /// The description of the actuators, in the parts in which it is sent.
    fn blocks(&self) -> impl Iterator<Item = Message> {
        let described = self.actuators.iter().flat_map(|described| {
            let (blocks, _) = described.as_chunks::<ACTUATOR_BLOCK>();
            blocks.iter().zip((0..).step_by(ACTUATOR_BLOCK))
        });
        described.map(|(block, first)| {
            Message::Actuators(Actuators {
                first,
                actuators: *block,
            })
        })
    }

    /// Each setting that is to be changed, and its value in `configuration`, with its unit.
    pub fn values(&self, configuration: &Configuration) -> Vec<(&'static str, String)> {
        let value = |setting: &Setting| setting.value(configuration).unwrap_or_default();
        let settings = self.settings.iter().map(|(setting, _)| {
            let text = [value(setting).as_str(), setting.unit].join(" ");
            (setting.name, text.trim_end().to_owned())
        });
        settings.collect()
    }
}

/// A change on its way.
#[derive(Clone, Debug)]
struct Changing {
    change: Change,
    since_us: u64,
    /// What was sent, once the configuration in force is known.
    sent: Option<Sent>,
}

/// A change as it was sent.
#[derive(Clone, Copy, Debug)]
struct Sent {
    configuration: Configuration,
    /// The hash of what it replaces.
    replaces: u32,
    at_us: u64,
    /// Whether no answer came, and what is in force was asked for once more.
    is_overdue: bool,
}

impl Changing {
    /// Whether a refusal is of this change as it was `sent`. All programs at a port hear the answers to each of them.
    fn is_own(&self, refusal: &Refusal, sent: &Configuration) -> bool {
        use protocol::Setting as On;
        let is_beyond = |value: i64| !(refusal.low..=refusal.high).contains(&value);
        let setting = |name: &str| self.change.settings.iter().find(|(of, _)| of.name == name);
        let actuators = self.change.actuators.as_ref();
        let is_actuators = |value: fn(&Actuator) -> i64| {
            let actuator = actuators.and_then(|all| all.get(usize::from(refusal.index)));
            actuator.is_some_and(|actuator| is_beyond(value(actuator)))
        };
        match refusal.setting {
            // It is made of the board's own word, and of whole blocks.
            On::Role | On::ActuatorsFirst => false,
            On::Rendering => {
                actuators.is_some()
                    || ["rendering", "mode"]
                        .into_iter()
                        .any(|name| setting(name).is_some())
            }
            On::ActuatorX => is_actuators(|actuator| actuator.x_um.into()),
            On::ActuatorY => is_actuators(|actuator| actuator.y_um.into()),
            On::ActuatorGain => is_actuators(|actuator| actuator.gain_q15.into()),
            On::ActuatorResonance => is_actuators(|actuator| actuator.resonance_dhz.into()),
            On::ActuatorDamping => is_actuators(|actuator| actuator.damping_percent.into()),
            on => {
                let value = setting(on.name()).and_then(|(of, _)| of.value(sent));
                value
                    .and_then(|value| value.parse().ok())
                    .is_some_and(is_beyond)
            }
        }
    }

    /// How long a program with a description waits until it sends it again, in µs, besides [`AGAIN_US`]: each as long as
    /// its description tells, since those that send two at once send neither.
    fn spread_us(&self) -> u64 {
        let hash = self
            .change
            .actuators
            .as_ref()
            .map(|all| actuators::hash(all));
        u64::from(hash.unwrap_or_default() % 500) * 1_000
    }
}

/// What a change has come to.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// It is in force: each setting that was changed, and its value with its unit.
    Taken(Vec<(&'static str, String)>),
    /// The board refused it.
    Refused(Refusal),
    /// The text is no value of it.
    Misread(Misread),
    /// The board does not answer.
    Unanswered,
}

/// Settings that are in force, and their values, in words.
pub fn taken(values: &[(&'static str, String)]) -> String {
    let values: Vec<_> = (values.iter())
        .map(|(name, value)| format!("{name} is {value}"))
        .collect();
    format!("{} now", values.join(", "))
}

/// The orders to one board.
#[derive(Clone, Debug, Default)]
pub struct Orders {
    /// When the configuration was asked for last, while it is wanted.
    wanted: Option<Option<u64>>,
    change: Option<Changing>,
    outbox: Vec<Message>,
}

impl Orders {
    /// Asks for the configuration.
    pub fn read(&mut self) {
        self.wanted.get_or_insert(None);
    }

    /// Makes `change`, and keeps all other settings.
    pub fn change(&mut self, change: Change, now_us: u64) {
        self.change = Some(Changing {
            change,
            since_us: now_us,
            sent: None,
        });
        // What is known may be old.
        self.wanted = Some(None);
    }

    /// The board has gone: what was on the way is void.
    pub fn lost(&mut self) {
        self.wanted = None;
        self.outbox.clear();
    }

    /// The board has answered, at `now_us`. What has come of a change, if it was the answer to one.
    pub fn on_report(&mut self, now_us: u64, report: &ConfigurationReport) -> Option<Outcome> {
        let sent = self.change.as_ref().and_then(|changing| changing.sent);
        // A refusal may be another program's: what is asked about a change is asked all the same.
        if !(report.refused.is_some() && sent.is_some_and(|sent| sent.is_overdue)) {
            self.wanted = None;
        }
        let changing = self.change.as_mut()?;
        let Some(sent) = sent else {
            return self.make_change(now_us, report);
        };
        match report.refused {
            None if report.configuration == sent.configuration => {
                let values = changing.change.values(&sent.configuration);
                self.change = None;
                Some(Outcome::Taken(values))
            }
            // It was not heard.
            None if sent.is_overdue => self.make_change(now_us, report),
            // The answer to somebody else.
            None => None,
            Some(refusal) => match refusal.setting {
                // That of another program, if what this one replaces is in force; else another's came in between.
                protocol::Setting::Replaces if report.hash == sent.replaces => None,
                protocol::Setting::Replaces => self.make_change(now_us, report),
                // Not all of the description was heard, or another program's came in between.
                protocol::Setting::Actuators => {
                    let own = changing.change.actuators.as_ref();
                    let own = own.map(|all| i64::from(actuators::hash(all)));
                    if own.is_some_and(|own| own != refusal.low)
                        && let Some(sent) = &mut changing.sent
                        && !sent.is_overdue
                    {
                        sent.is_overdue = true;
                        self.wanted = Some(Some(now_us + changing.spread_us()));
                    }
                    None
                }
                _ if changing.is_own(&refusal, &sent.configuration) => {
                    self.change = None;
                    Some(Outcome::Refused(refusal))
                }
                _ => None,
            },
        }
    }

    /// Makes the change of what `report` says is in force.
    fn make_change(&mut self, now_us: u64, report: &ConfigurationReport) -> Option<Outcome> {
        let changing = self.change.as_mut()?;
        match changing.change.of(report.configuration) {
            // There is nothing to change, or an answer came so late that it had been given up.
            Ok(configuration) if configuration == report.configuration => {
                let values = changing.change.values(&configuration);
                self.change = None;
                Some(Outcome::Taken(values))
            }
            Ok(configuration) => {
                changing.sent = Some(Sent {
                    configuration,
                    replaces: report.hash,
                    at_us: now_us,
                    is_overdue: false,
                });
                self.outbox.extend(changing.change.blocks());
                self.outbox.push(Message::Configure(Configure {
                    replaces: Some(report.hash),
                    configuration,
                }));
                None
            }
            Err(misread) => {
                self.change = None;
                Some(Outcome::Misread(misread))
            }
        }
    }

    /// Repeats what was not answered; what is given up is returned.
    pub fn elapse(&mut self, now_us: u64, is_known: bool) -> Option<Outcome> {
        if let Some(changing) = &mut self.change
            && let Some(sent) = &mut changing.sent
            && is_due(Some(sent.at_us), AGAIN_US, now_us)
            && !sent.is_overdue
        {
            sent.is_overdue = true;
            self.wanted = Some(None);
        }
        if let Some(asked_us) = &mut self.wanted
            && is_known
            && is_due(*asked_us, AGAIN_US, now_us)
        {
            *asked_us = Some(now_us);
            self.outbox.push(Message::Question(Question::Configuration));
        }
        let given_up =
            |changing: &mut Changing| is_due(Some(changing.since_us), GIVEN_UP_US, now_us);
        self.change.take_if(given_up).map(|_| Outcome::Unanswered)
    }

    /// What is to be said now.
    pub fn take(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.outbox)
    }
}
