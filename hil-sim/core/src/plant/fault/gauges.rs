//! Faults between the gauges and the ADC's codes.

use protocol::CHANNELS;

use crate::scene::fault::{Fault, Kind};

/// The highest code, and the one of mid-rail.
const RAIL: u16 = 4_095;
const MID_RAIL: u16 = 2_048;

/// The wires of the sensor board's six analog pins.
#[derive(Clone, Debug, Default)]
pub struct GaugeFaults {
    faults: Vec<Fault>,
    /// The last codes of sound pins.
    last: [u16; CHANNELS],
}

impl GaugeFaults {
    /// The wires under a scene's `faults`.
    pub fn new(faults: &[Fault]) -> Self {
        let of_gauges = |fault: &&Fault| {
            matches!(
                fault.kind,
                Kind::GaugeOpen | Kind::GaugeShort | Kind::AdcStuck
            )
        };
        Self {
            faults: faults.iter().filter(of_gauges).copied().collect(),
            last: [MID_RAIL; CHANNELS],
        }
    }

    /// What the pins carry at `at_ns` of what the gauges give.
    pub fn apply(&mut self, at_ns: u64, codes: [u16; CHANNELS]) -> [u16; CHANNELS] {
        let mut carried = codes;
        let mut is_sound = true;
        for fault in self.faults.iter().filter(|fault| fault.is_on(at_ns)) {
            is_sound = false;
            let gauge = fault.values[0] as usize;
            match fault.kind {
                Kind::GaugeOpen => carried[gauge] = RAIL,
                Kind::GaugeShort => carried[gauge] = MID_RAIL,
                _ => carried = self.last,
            }
        }
        if is_sound {
            self.last = codes;
        }
        carried
    }
}
