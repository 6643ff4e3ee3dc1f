//! A second copy of what only changes on request, with every bit turned over, so that a change that
//! nobody asked for is noticed.

use protocol::actuators::Actuator;
use protocol::{ACTUATORS, DisplayConfiguration};

/// Actuators compared in a tick: all of them within 17 ticks, 8.5 ms at 2 kHz.
const PER_TICK: usize = 3;

/// Words that say all of a configuration, and of an actuator.
const SETTINGS: usize = 5;
const TRAITS: usize = 3;

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

    /// Compares the configuration and the next few actuators with their second copies. False if one of
    /// them has changed.
    pub fn agrees(
        &mut self,
        configuration: &DisplayConfiguration,
        actuators: &[Actuator; ACTUATORS],
    ) -> bool {
        let mut differences = differences(&settings(configuration), &self.settings);
        for _ in 0..PER_TICK {
            let next = self.next;
            self.next = if next + 1 < ACTUATORS { next + 1 } else { 0 };
            differences |= differences_of(actuators, &self.actuators, next);
        }
        differences == 0
    }
}

fn differences_of(
    actuators: &[Actuator; ACTUATORS],
    copies: &[[u32; TRAITS]; ACTUATORS],
    index: usize,
) -> u32 {
    // An index that is none is itself a fault of memory.
    match (actuators.get(index), copies.get(index)) {
        (Some(actuator), Some(copy)) => differences(&traits(actuator), copy),
        _ => u32::MAX,
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
        pair(c.full_drive_s, (c.mode as u16) << 8 | c.update_rate as u16),
        c.actuators,
    ]
}

fn traits(actuator: &Actuator) -> [u32; TRAITS] {
    [
        pair(actuator.x_um as u16, actuator.y_um as u16),
        pair(actuator.gain_q15, actuator.phase),
        actuator.inverted.into(),
    ]
}

fn pair(low: u16, high: u16) -> u32 {
    u32::from(low) | u32::from(high) << 16
}
