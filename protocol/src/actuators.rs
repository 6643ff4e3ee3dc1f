//! The fifty actuators as a host describes them: where each sits on the fingertip, how strongly, which
//! way round and how much ahead it is driven.
//!
//! A description is sent in blocks of ten ([`Actuators`]), which change nothing by themselves, and comes
//! into force as a whole with the [`crate::Message::Configure`] that names its [`hash`].

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::checksum::CRC_32;
use crate::refusal::{Refusal, Setting};

/// Actuators on the fingertip (Okamoto et al. 2009, section IV).
pub const ACTUATORS: usize = 50;
/// Actuators that one [`Actuators`] carries.
pub const ACTUATOR_BLOCK: usize = 10;
/// A gain of 1, in Q15.
pub const UNITY_GAIN: u16 = 1 << 15;
/// The furthest that an actuator may be from the fingertip's middle along either axis, in µm.
pub const FURTHEST_UM: i16 = 20_000;
/// The lowest natural frequency of an actuator that can be made up for, in 0.1 Hz.
pub const LOWEST_RESONANCE_DHZ: u16 = 200;
/// The highest natural frequency that is told from an infinite one, in 0.1 Hz.
pub const HIGHEST_RESONANCE_DHZ: u16 = 20_000;
/// The least and the largest damping, in percent.
pub const DAMPING_PERCENT: (u16, u16) = (20, 1_000);
/// Distance between neighbours of the default grid, in µm: a guess, the paper gives none.
pub const DEFAULT_PITCH_UM: u16 = 1_500;

/// Rows of the default grid, across the scan, and columns, along it.
const ROWS: usize = 5;
const COLUMNS: usize = 10;
const _: () = assert!(ROWS * COLUMNS == ACTUATORS && ACTUATORS.is_multiple_of(ACTUATOR_BLOCK));

/// One actuator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Actuator {
    /// Place along the scan, in µm from the fingertip's middle, within ± [`FURTHEST_UM`].
    pub x_um: i16,
    /// Place across the scan, in µm from the fingertip's middle, within ± [`FURTHEST_UM`].
    pub y_um: i16,
    /// Gain in Q15, 0 to [`UNITY_GAIN`].
    pub gain_q15: u16,
    /// How much its phase is ahead of what its place asks for, in turns / 2¹⁶.
    pub phase: u16,
    /// Whether a positive voltage bends it away from the skin: it then gets the opposite voltage.
    pub inverted: bool,
    /// Natural frequency f₀ in 0.1 Hz of the actuator on the skin, as a second-order system
    /// H(s) = ω₀²/(s² + 2ζω₀s + ω₀²) from voltage to displacement, [`LOWEST_RESONANCE_DHZ`] to
    /// [`HIGHEST_RESONANCE_DHZ`]: the voltage is then such that the displacement is in step. 0: not known, the voltage
    /// itself is in step.
    pub resonance_dhz: u16,
    /// Its damping ζ in percent, 20 to 1 000; without meaning where `resonance_dhz` is 0.
    pub damping_percent: u16,
}

impl Actuator {
    /// At full gain, with no phase of its own, the right way round.
    pub const fn at(x_um: i16, y_um: i16) -> Self {
        Self {
            x_um,
            y_um,
            gain_q15: UNITY_GAIN,
            phase: 0,
            inverted: false,
            resonance_dhz: 0,
            damping_percent: 100,
        }
    }
}

/// A block of a description, to be put together with the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Actuators {
    /// Index of the first one: a multiple of [`ACTUATOR_BLOCK`] below [`ACTUATORS`].
    pub first: u8,
    /// The actuators from `first` on.
    pub actuators: [Actuator; ACTUATOR_BLOCK],
}

/// Five rows of ten, `pitch_um` apart and centred: counted along x first, from the lowest x and y.
/// `pitch_um` is at most 4 000, so that all places are within ± [`FURTHEST_UM`].
pub const fn grid(pitch_um: u16) -> [Actuator; ACTUATORS] {
    let mut actuators = [Actuator::at(0, 0); ACTUATORS];
    let mut index = 0;
    while index < ACTUATORS {
        // Half pitches from the middle.
        let x = 2 * (index % COLUMNS) as i32 - (COLUMNS as i32 - 1);
        let y = 2 * (index / COLUMNS) as i32 - (ROWS as i32 - 1);
        actuators[index] = Actuator::at(
            (x * pitch_um as i32 / 2) as i16,
            (y * pitch_um as i32 / 2) as i16,
        );
        index += 1;
    }
    actuators
}

/// What a display board starts with.
pub const DEFAULT_ACTUATORS: [Actuator; ACTUATORS] = grid(DEFAULT_PITCH_UM);

/// Names a description: the CRC-32 over each actuator's x, y, gain, phase, resonance, damping
/// (little-endian) and 1 if it is inverted, else 0.
pub const fn hash(actuators: &[Actuator; ACTUATORS]) -> u32 {
    const LENGTH: usize = 13;
    let mut bytes = [0; LENGTH * ACTUATORS];
    let mut index = 0;
    while index < ACTUATORS {
        let actuator = actuators[index];
        let words = [
            actuator.x_um as u16,
            actuator.y_um as u16,
            actuator.gain_q15,
            actuator.phase,
            actuator.resonance_dhz,
            actuator.damping_percent,
        ];
        let mut word = 0;
        while word < words.len() {
            let [low, high] = words[word].to_le_bytes();
            bytes[LENGTH * index + 2 * word] = low;
            bytes[LENGTH * index + 2 * word + 1] = high;
            word += 1;
        }
        bytes[LENGTH * index + LENGTH - 1] = actuator.inverted as u8;
        index += 1;
    }
    CRC_32.checksum(&bytes)
}

/// Checks every range; the first setting outside of its own is the error.
pub fn check(actuators: &[Actuator; ACTUATORS]) -> Result<(), Refusal> {
    let furthest = i32::from(FURTHEST_UM);
    for (actuator, index) in actuators.iter().zip(0..) {
        let within = |value: i32, low: i32, high: i32, setting: Setting| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(Refusal {
                    setting,
                    index,
                    low: low.into(),
                    high: high.into(),
                })
            }
        };
        within(
            actuator.x_um.into(),
            -furthest,
            furthest,
            Setting::ActuatorX,
        )?;
        within(
            actuator.y_um.into(),
            -furthest,
            furthest,
            Setting::ActuatorY,
        )?;
        within(
            actuator.gain_q15.into(),
            0,
            UNITY_GAIN.into(),
            Setting::ActuatorGain,
        )?;
        if actuator.resonance_dhz != 0 {
            within(
                actuator.resonance_dhz.into(),
                LOWEST_RESONANCE_DHZ.into(),
                HIGHEST_RESONANCE_DHZ.into(),
                Setting::ActuatorResonance,
            )?;
            within(
                actuator.damping_percent.into(),
                DAMPING_PERCENT.0.into(),
                DAMPING_PERCENT.1.into(),
                Setting::ActuatorDamping,
            )?;
        }
    }
    Ok(())
}
