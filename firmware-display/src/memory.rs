//! A second copy of what only changes on request, with every bit turned over, so that a change that
//! nobody asked for is noticed.

use protocol::actuators::Actuator;
use protocol::{ACTUATORS, DisplayConfiguration};

use crate::stimulus::Stimulus;

/// Actuators compared in a tick: all of them within 17 ticks, 8.5 ms at 2 kHz.
const PER_TICK: usize = 3;

/// Words that say all of a configuration, and of an actuator.
const SETTINGS: usize = 6;
const TRAITS: usize = 4;

/// The second copy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Memory {
    settings: [u32; SETTINGS],
    actuators: [[u32; TRAITS]; ACTUATORS],
    next: usize,
}

impl Memory {
    /// A second copy of these.
    pub fn of(configuration: &DisplayConfiguration, actuators: &[Actuator; ACTUATORS]) -> Self {
        Self {
            settings: settings(configuration).map(|word| !word),
            actuators: actuators.map(|actuator| traits(&actuator).map(|word| !word)),
            next: 0,
        }
    }

    /// Compares the configuration, and the next few actuators that the stimulus is made with, with their
    /// second copies. False if one of them has changed.
    pub fn agrees(&mut self, configuration: &DisplayConfiguration, stimulus: &Stimulus) -> bool {
        let mut agrees = differences(&settings(configuration), &self.settings) == 0;
        for _ in 0..PER_TICK {
            let next = self.next;
            self.next = if next + 1 < ACTUATORS { next + 1 } else { 0 };
            // An index that is none is itself a fault of memory.
            agrees &= match (stimulus.actuators().get(next), self.actuators.get(next)) {
                (Some(actuator), Some(copy)) => {
                    differences(&traits(actuator), copy) == 0 && stimulus.follows_from(next)
                }
                _ => false,
            };
        }
        agrees
    }
}

fn differences<const N: usize>(words: &[u32; N], copies: &[u32; N]) -> u32 {
    let pairs = words.iter().zip(copies);
    pairs.fold(0, |differences, (word, copy)| differences | (word ^ !copy))
}

fn settings(c: &DisplayConfiguration) -> [u32; SETTINGS] {
    [
        pair(c.max_age_ms, c.glide_ms),
        pair(c.fade_in_ms, c.fade_out_ms),
        pair(c.amplitude_mv, c.reference_lsb),
        pair(c.full_drive_s, c.reference_mn),
        u32::from_le_bytes([c.mode as u8, c.rendering as u8, c.update_rate as u8, 0]),
        c.actuators,
    ]
}

fn traits(actuator: &Actuator) -> [u32; TRAITS] {
    [
        pair(actuator.x_um as u16, actuator.y_um as u16),
        pair(actuator.gain_q15, actuator.phase),
        pair(actuator.resonance_dhz, actuator.damping_percent),
        actuator.inverted.into(),
    ]
}

fn pair(low: u16, high: u16) -> u32 {
    u32::from(low) | u32::from(high) << 16
}

#[cfg(test)]
mod tests {
    use protocol::actuators::DEFAULT_ACTUATORS;
    use protocol::{Mode, Rendering, UpdateRate};

    use super::*;

    const CONFIGURATION: DisplayConfiguration = DisplayConfiguration::DEFAULT;

    /// Ticks until a memory of the default settings notices that the stimulus is made with others.
    fn noticed(
        configuration: &DisplayConfiguration,
        actuators: &[Actuator; ACTUATORS],
    ) -> Option<usize> {
        let mut memory = Memory::of(&CONFIGURATION, &DEFAULT_ACTUATORS);
        let stimulus = Stimulus::new(&CONFIGURATION, actuators);
        (1..1_000).find(|_| !memory.agrees(configuration, &stimulus))
    }

    #[test]
    fn what_did_not_change_agrees() {
        assert_eq!(noticed(&CONFIGURATION, &DEFAULT_ACTUATORS), None);
    }

    #[test]
    fn any_setting_that_changed_is_noticed_in_the_next_tick() {
        let changes: [fn(&mut DisplayConfiguration); 12] = [
            |c| c.mode = Mode::Travelling,
            |c| c.rendering = Rendering::Texture,
            |c| c.update_rate = UpdateRate::Hz4000,
            |c| c.max_age_ms ^= 1,
            |c| c.fade_in_ms ^= 1 << 15,
            |c| c.fade_out_ms ^= 2,
            |c| c.glide_ms ^= 4,
            |c| c.amplitude_mv ^= 8,
            |c| c.reference_lsb ^= 16,
            |c| c.reference_mn ^= 1 << 13,
            |c| c.full_drive_s ^= 32,
            |c| c.actuators ^= 64,
        ];
        for change in changes {
            let mut changed = CONFIGURATION;
            change(&mut changed);
            assert_eq!(noticed(&changed, &DEFAULT_ACTUATORS), Some(1));
        }
    }

    #[test]
    fn any_trait_of_any_actuator_that_changed_is_noticed_within_nine_milliseconds() {
        let changes: [fn(&mut Actuator); 7] = [
            |a| a.x_um ^= 1,
            |a| a.y_um ^= 1 << 14,
            |a| a.gain_q15 ^= 2,
            |a| a.phase ^= 4,
            |a| a.inverted ^= true,
            |a| a.resonance_dhz ^= 1 << 10,
            |a| a.damping_percent ^= 1,
        ];
        for change in changes {
            for index in 0..ACTUATORS {
                let mut actuators = DEFAULT_ACTUATORS;
                change(&mut actuators[index]);
                let ticks = noticed(&CONFIGURATION, &actuators).unwrap();
                assert_eq!(ticks, index / PER_TICK + 1);
                assert!(ticks <= 9 * 2);
            }
        }
    }
}
