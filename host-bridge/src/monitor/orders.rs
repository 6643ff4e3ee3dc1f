//! What is said to the boards: questions for their configurations, and changes of them.
//!
//! A configuration is taken as a whole, and another program may have changed it. So it is read right before it
//! is changed, and the change names what it replaces: if that is not in force any more, the board refuses, and
//! the change is made again of what is.

use protocol::{Configuration, ConfigurationReport, Configure, Message, Question, Refusal};

use super::settings::{Misread, Setting};
use crate::clock::is_due;

/// A question that was not answered is repeated after so long, in µs.
const AGAIN_US: u64 = 300_000;
/// A change that was not answered is given up after so long, in µs.
const GIVEN_UP_US: u64 = 2_000_000;

/// A setting that is to be changed.
#[derive(Clone, Debug)]
struct Change {
    setting: &'static Setting,
    text: String,
    since_us: u64,
    /// What was sent, once the configuration in force is known.
    sent: Option<Configuration>,
}

/// What a change has come to.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// The setting is in force.
    Taken {
        /// Its name.
        name: &'static str,
        /// Its value, with its unit.
        value: String,
    },
    /// The board refused it.
    Refused(Refusal),
    /// The text is no value of it.
    Misread(Misread),
    /// The board does not answer.
    Unanswered,
}

/// The orders to one board.
#[derive(Clone, Debug, Default)]
pub struct Orders {
    /// When the configuration was asked for last, while it is wanted.
    wanted: Option<Option<u64>>,
    change: Option<Change>,
    outbox: Vec<Message>,
}

impl Orders {
    /// Asks for the configuration.
    pub fn read(&mut self) {
        self.wanted.get_or_insert(None);
    }

    /// Changes one setting and keeps all others.
    pub fn change(&mut self, setting: &'static Setting, text: &str, now_us: u64) {
        self.change = Some(Change {
            setting,
            text: text.to_owned(),
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

    /// The board has answered. What has come of a change, if it was the answer to one.
    pub fn on_report(&mut self, report: &ConfigurationReport) -> Option<Outcome> {
        self.wanted = None;
        let change = self.change.as_mut()?;
        match (change.sent, report.refused) {
            (None, _) => self.make_change(report),
            // Another program's change came in between.
            (Some(_), Some(refusal)) if refusal.setting == protocol::Setting::Replaces => {
                self.make_change(report)
            }
            (Some(_), Some(refusal)) => {
                self.change = None;
                Some(Outcome::Refused(refusal))
            }
            (Some(sent), None) if report.configuration == sent => {
                let setting = change.setting;
                self.change = None;
                Some(Outcome::Taken {
                    name: setting.name,
                    value: [
                        setting.value(&sent).unwrap_or_default().as_str(),
                        setting.unit,
                    ]
                    .join(" ")
                    .trim_end()
                    .to_owned(),
                })
            }
            // The answer to somebody else.
            (Some(_), None) => None,
        }
    }

    /// Makes the change of what `report` says is in force.
    fn make_change(&mut self, report: &ConfigurationReport) -> Option<Outcome> {
        let change = self.change.as_mut()?;
        match change.setting.changed(report.configuration, &change.text) {
            Ok(configuration) => {
                change.sent = Some(configuration);
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
        if let Some(asked_us) = &mut self.wanted
            && is_known
            && is_due(*asked_us, AGAIN_US, now_us)
        {
            *asked_us = Some(now_us);
            self.outbox.push(Message::Question(Question::Configuration));
        }
        let given_up = |change: &mut Change| is_due(Some(change.since_us), GIVEN_UP_US, now_us);
        self.change.take_if(given_up).map(|_| Outcome::Unanswered)
    }

    /// What is to be said now.
    pub fn take(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.outbox)
    }
}
