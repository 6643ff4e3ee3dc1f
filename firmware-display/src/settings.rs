//! The board's configuration: taken as a whole or not at all.

use protocol::actuators::{self, ACTUATOR_BLOCK, ACTUATORS, Actuator, DEFAULT_ACTUATORS};
use protocol::{
    Actuators, Configuration, ConfigurationReport, Configure, DisplayConfiguration, Refusal,
    Rendering, Setting,
};

use crate::pattern::Pattern;
use crate::skin::{Skin, any_is_modelled};

/// What is in force, and the description of the actuators that is being sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    configuration: DisplayConfiguration,
    actuators: [Actuator; ACTUATORS],
    sent: [Actuator; ACTUATORS],
}

impl Settings {
    /// What a board starts with.
    pub const DEFAULT: Self = Self {
        configuration: DisplayConfiguration::DEFAULT,
        actuators: DEFAULT_ACTUATORS,
        sent: DEFAULT_ACTUATORS,
    };

    /// A board that has taken `configuration`, which names `actuators` by their hash.
    ///
    /// # Errors
    /// The first value out of its range.
    pub fn new(
        configuration: DisplayConfiguration,
        actuators: &[Actuator; ACTUATORS],
    ) -> Result<Self, Refusal> {
        let mut settings = Self {
            sent: *actuators,
            ..Self::DEFAULT
        };
        settings.take(&Configure::anyway(Configuration::Display(configuration)))?;
        Ok(settings)
    }

    /// The configuration in force.
    pub const fn configuration(&self) -> &DisplayConfiguration {
        &self.configuration
    }

    /// The actuators in force.
    pub const fn actuators(&self) -> &[Actuator; ACTUATORS] {
        &self.actuators
    }

    /// Whether what is in force is what [`Settings::on_configure`] lets through; else memory has changed by
    /// itself.
    pub fn are_sound(&self) -> bool {
        actuators::hash(&self.actuators) == self.configuration.actuators
            && self.configuration.check().is_ok()
    }

    /// Keeps a block of a description until a configuration asks for it; None if there is nothing to
    /// say, else the answer.
    pub fn on_actuators(&mut self, block: &Actuators) -> Option<ConfigurationReport> {
        let first = usize::from(block.first);
        if first < ACTUATORS && first.is_multiple_of(ACTUATOR_BLOCK) {
            self.sent[first..first + ACTUATOR_BLOCK].copy_from_slice(&block.actuators);
            return None;
        }
        Some(self.refusing(Some(Refusal {
            setting: Setting::ActuatorsFirst,
            index: block.first,
            low: 0,
            high: (ACTUATORS - ACTUATOR_BLOCK) as i64,
        })))
    }

    /// Takes a configuration whose every value, and whose every actuator's, is in its range, if what it
    /// replaces is in force; any other changes nothing. The answer names what is in force then.
    pub fn on_configure(&mut self, asked: &Configure) -> ConfigurationReport {
        let taken = self.take(asked);
        self.refusing(taken.err())
    }

    /// What is in force.
    pub fn report(&self) -> ConfigurationReport {
        self.refusing(None)
    }

    fn take(&mut self, request: &Configure) -> Result<(), Refusal> {
        let refuse = |setting| Refusal {
            setting,
            index: 0,
            low: 0,
            high: 0,
        };
        let Configuration::Display(asked) = &request.configuration else {
            return Err(refuse(Setting::Role));
        };
        request.check_replaces(self.report().hash)?;
        asked.check()?;
        let mut actuators = &self.actuators;
        if asked.actuators != self.configuration.actuators {
            let sent = actuators::hash(&self.sent);
            if asked.actuators != sent {
                return Err(Refusal {
                    low: sent.into(),
                    high: sent.into(),
                    ..refuse(Setting::Actuators)
                });
            }
            actuators::check(&self.sent)?;
            actuators = &self.sent;
        }
        check_effort(asked, actuators)?;
        self.actuators = *actuators;
        self.configuration = *asked;
        Ok(())
    }

    fn refusing(&self, refused: Option<Refusal>) -> ConfigurationReport {
        ConfigurationReport::of(Configuration::Display(self.configuration), refused)
    }
}

/// What there is time for, and what of it a place takes. A lane, a different place, phase or resonance, takes one: 0.5 µs by
/// the lower of two estimates (`hil-sim budget`). With so much the emulated board is never late.
const fn effort(rendering: Rendering, is_modelled: bool) -> (usize, usize) {
    match (rendering, is_modelled) {
        (Rendering::Texture, true) => (72, 6),
        (Rendering::Texture, false) => (64, 4),
        (Rendering::Fundamental | Rendering::Shape, _) => (64, 3),
    }
}

/// Checks that the words can be worked out in time.
///
/// # Errors
/// If more than the sine is asked for, of actuators with too many different places and phases, or with too many different
/// resonances at these. In uniform mode all places are one.
pub fn check_effort(
    configuration: &DisplayConfiguration,
    actuators: &[Actuator; ACTUATORS],
) -> Result<(), Refusal> {
    let is_modelled = any_is_modelled(actuators);
    if configuration.rendering == Rendering::Fundamental && !is_modelled {
        return Ok(());
    }
    let pattern = Pattern::new(configuration.mode, actuators);
    let lanes = Skin::new(configuration.rendering, actuators, &pattern).lanes();
    let (most, of_place) = effort(configuration.rendering, is_modelled);
    let most_places = most / (of_place + 1);
    let most_lanes = if pattern.places() > most_places {
        most_places
    } else {
        most - of_place * pattern.places()
    };
    if lanes <= most_lanes {
        return Ok(());
    }
    Err(Refusal {
        setting: Setting::Rendering,
        index: 0,
        low: 1,
        high: most_lanes as i64,
    })
}

#[cfg(test)]
mod tests {
    use protocol::actuators::grid;
    use protocol::{DisplayState, Mode, SensorConfiguration, Trip};

    use super::*;
    use crate::{Display, Senses};

    fn send(settings: &mut Settings, described: &[Actuator; ACTUATORS]) {
        for first in (0..ACTUATORS).step_by(ACTUATOR_BLOCK) {
            let block = Actuators {
                first: first as u8,
                actuators: described[first..first + ACTUATOR_BLOCK].try_into().unwrap(),
            };
            assert_eq!(settings.on_actuators(&block), None);
        }
    }

    fn asking_for(described: &[Actuator; ACTUATORS]) -> Configuration {
        Configuration::Display(DisplayConfiguration {
            amplitude_mv: 1_234,
            actuators: actuators::hash(described),
            ..DisplayConfiguration::DEFAULT
        })
    }

    #[test]
    fn a_description_comes_into_force_with_the_configuration_that_names_it_and_not_before() {
        let mut settings = Settings::DEFAULT;
        let described = grid(700);
        send(&mut settings, &described);
        assert_eq!(settings.actuators(), &DEFAULT_ACTUATORS);
        let asked = asking_for(&described);
        let report = settings.on_configure(&Configure::anyway(asked));
        assert_eq!((report.refused, report.configuration), (None, asked));
        assert_eq!(report.hash, asked.hash());
        assert_eq!(settings.actuators(), &described);
    }

    #[test]
    fn the_description_in_force_is_kept_by_a_configuration_that_names_it() {
        let mut settings = Settings::DEFAULT;
        send(&mut settings, &grid(700));
        let report = settings.on_configure(&Configure::anyway(asking_for(&DEFAULT_ACTUATORS)));
        assert_eq!(report.refused, None);
        assert_eq!(settings.actuators(), &DEFAULT_ACTUATORS);
    }

    #[test]
    fn nothing_changes_when_one_block_was_lost() {
        let mut settings = Settings::DEFAULT;
        let described = grid(700);
        let block = Actuators {
            first: 20,
            actuators: described[20..30].try_into().unwrap(),
        };
        assert_eq!(settings.on_actuators(&block), None);
        let report = settings.on_configure(&Configure::anyway(asking_for(&described)));
        let refused = report.refused.unwrap();
        assert_eq!(refused.setting, Setting::Actuators);
        // With the hash of what was received.
        let mut received = DEFAULT_ACTUATORS;
        received[20..30].copy_from_slice(&described[20..30]);
        let hash = i64::from(actuators::hash(&received));
        assert_eq!((refused.low, refused.high), (hash, hash));
        let in_force = Configuration::Display(DisplayConfiguration::DEFAULT);
        assert_eq!(report.configuration, in_force);
        assert_eq!(report.hash, in_force.hash());
        assert_eq!(settings.actuators(), &DEFAULT_ACTUATORS);
    }

    #[test]
    fn an_actuator_out_of_its_range_is_named_and_nothing_changes() {
        for (change, setting, low, high) in [
            (
                (|a| a.x_um = 20_001) as fn(&mut Actuator),
                Setting::ActuatorX,
                -20_000,
                20_000,
            ),
            (|a| a.y_um = -20_001, Setting::ActuatorY, -20_000, 20_000),
            (|a| a.gain_q15 = 32_769, Setting::ActuatorGain, 0, 32_768),
        ] {
            let mut settings = Settings::DEFAULT;
            let mut described = grid(1_000);
            change(&mut described[37]);
            send(&mut settings, &described);
            let before = (*settings.configuration(), *settings.actuators());
            let report = settings.on_configure(&Configure::anyway(asking_for(&described)));
            let expected = Refusal {
                setting,
                index: 37,
                low,
                high,
            };
            assert_eq!(report.refused, Some(expected));
            assert_eq!(before, (*settings.configuration(), *settings.actuators()));
        }
    }

    #[test]
    fn the_other_boards_configuration_and_a_block_that_fits_nowhere_are_refused() {
        let mut settings = Settings::DEFAULT;
        let other = Configuration::Sensor(SensorConfiguration::DEFAULT);
        let report = settings.on_configure(&Configure::anyway(other));
        assert_eq!(report.refused.unwrap().setting, Setting::Role);
        for first in [5, 50, 255] {
            let block = Actuators {
                first,
                actuators: [Actuator::at(0, 0); ACTUATOR_BLOCK],
            };
            let refused = settings.on_actuators(&block).unwrap().refused.unwrap();
            assert_eq!(
                (refused.setting, refused.index, refused.high),
                (Setting::ActuatorsFirst, first, 40)
            );
        }
        assert_eq!(settings, Settings::DEFAULT);
    }

    #[test]
    fn what_replaces_another_configuration_than_the_one_in_force_is_refused_with_that() {
        let mut settings = Settings::DEFAULT;
        let before = settings.report();
        let replacing = |amplitude_mv| Configure {
            replaces: Some(before.hash),
            configuration: Configuration::Display(DisplayConfiguration {
                amplitude_mv,
                ..DisplayConfiguration::DEFAULT
            }),
        };
        let taken = settings.on_configure(&replacing(4_000));
        assert_eq!(taken.refused, None);
        let refused = settings.on_configure(&replacing(3_000));
        let setting = refused.refused.map(|refusal| refusal.setting);
        assert_eq!(setting, Some(Setting::Replaces));
        assert_eq!(refused.configuration, taken.configuration);
        assert_eq!(settings.configuration().amplitude_mv, 4_000);
    }

    fn take(
        mode: Mode,
        rendering: Rendering,
        actuators: &[Actuator; ACTUATORS],
    ) -> Result<(), Refusal> {
        let configuration = DisplayConfiguration {
            mode,
            rendering,
            actuators: actuators::hash(actuators),
            ..DisplayConfiguration::DEFAULT
        };
        Settings::new(configuration, actuators).map(|_| ())
    }

    const fn too_many(most: i64) -> Result<(), Refusal> {
        Err(Refusal {
            setting: Setting::Rendering,
            index: 0,
            low: 1,
            high: most,
        })
    }

    /// So many places, in turn.
    fn at_places(places: i16) -> [Actuator; ACTUATORS] {
        let mut actuators = DEFAULT_ACTUATORS;
        for (actuator, index) in actuators.iter_mut().zip(0..) {
            actuator.x_um = 10 * (index % places);
        }
        actuators
    }

    #[test]
    fn more_than_a_sine_is_refused_for_too_many_places() {
        for (rendering, most, most_modelled) in [
            (Rendering::Fundamental, 50, 16),
            (Rendering::Shape, 16, 16),
            (Rendering::Texture, 12, 10),
        ] {
            for (resonance_dhz, most) in [(0, most), (500, most_modelled)] {
                for places in [most, 50.min(most + 1)] {
                    let mut actuators = at_places(places);
                    for actuator in &mut actuators {
                        actuator.resonance_dhz = resonance_dhz;
                    }
                    let expected = if places <= most {
                        Ok(())
                    } else {
                        too_many(most.into())
                    };
                    let taken = take(Mode::Travelling, rendering, &actuators);
                    assert_eq!(taken, expected, "{rendering:?} {places}");
                    assert_eq!(take(Mode::Uniform, rendering, &actuators), Ok(()));
                }
            }
        }
    }

    #[test]
    fn too_many_resonances_at_too_many_places_are_refused_and_fifty_at_one_are_not() {
        for (rendering, places, most) in [
            (Rendering::Fundamental, 10, 34),
            (Rendering::Shape, 10, 34),
            (Rendering::Texture, 5, 42),
            (Rendering::Texture, 10, 12),
        ] {
            for resonances in [most, most + 1] {
                let mut actuators = at_places(places);
                for (actuator, index) in actuators.iter_mut().zip(0..) {
                    // Of the first ones each has its own, the others have that of one at their place.
                    actuator.resonance_dhz = 500
                        + if index < resonances {
                            index
                        } else {
                            index % places as u16
                        };
                }
                let expected = if resonances == most {
                    Ok(())
                } else {
                    too_many(most.into())
                };
                let taken = take(Mode::Travelling, rendering, &actuators);
                assert_eq!(taken, expected, "{rendering:?} {places} {resonances}");
            }
            let mut actuators = at_places(places);
            for (actuator, index) in actuators.iter_mut().zip(0..) {
                actuator.resonance_dhz = 500 + index;
            }
            assert_eq!(take(Mode::Uniform, rendering, &actuators), Ok(()));
        }
    }

    #[test]
    fn settings_that_changed_by_themselves_are_not_sound_and_stop_the_display() {
        assert!(Settings::DEFAULT.are_sound());
        let spoil: [fn(&mut Settings); 3] = [
            |settings| settings.actuators[41].gain_q15 ^= 1 << 3,
            |settings| settings.configuration.actuators ^= 1,
            |settings| settings.configuration.amplitude_mv = 5_001,
        ];
        for spoil in spoil {
            let mut settings = Settings::DEFAULT;
            spoil(&mut settings);
            assert!(!settings.are_sound());
            let stopped = DisplayState::Stopped(Trip::Memory);
            assert_eq!(Display::new(&settings, None).state(), stopped);
            let mut display = Display::new(&Settings::DEFAULT, None);
            display.configure(&settings);
            assert!(!display.tick(0, &Senses::default()).release);
            assert_eq!(display.state(), stopped);
        }
    }
}
