//! `[display]`: how the display board is set, its fifty actuators included.

use protocol::actuators::{self, ACTUATORS, Actuator};
use protocol::{DEFAULT_ACTUATORS, DisplayConfiguration};

/// How the display board is set. `configuration` names `actuators` by their hash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Display {
    /// The board's settings.
    pub configuration: DisplayConfiguration,
    /// The actuators, in the order of the DACs' channels.
    pub actuators: Box<[Actuator; ACTUATORS]>,
}

impl Default for Display {
    fn default() -> Self {
        Self {
            configuration: DisplayConfiguration::DEFAULT,
            actuators: Box::new(DEFAULT_ACTUATORS),
        }
    }
}

impl Display {
    /// The default settings with other actuators.
    pub fn with_actuators(described: [Actuator; ACTUATORS]) -> Self {
        Self {
            configuration: DisplayConfiguration {
                actuators: actuators::hash(&described),
                ..DisplayConfiguration::DEFAULT
            },
            actuators: Box::new(described),
        }
    }
}
