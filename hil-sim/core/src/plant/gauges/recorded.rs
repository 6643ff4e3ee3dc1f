//! Recorded voltages, played back.

use std::sync::Arc;

use protocol::{CHANNELS, GAUGES};

use super::{CODES, MID_RAIL_CODE, VOLTS_FULL_SCALE, code};
use crate::scene::Waveform;

/// Voltages at the pins over time.
#[derive(Clone, Debug)]
pub struct RecordedGauges {
    volts: Arc<Waveform>,
    channels: usize,
    row: usize,
}

impl RecordedGauges {
    /// Plays `volts`: five columns, or six with the tangential force, which is left out unless
    /// `tangential`.
    pub fn new(volts: Arc<Waveform>, tangential: bool) -> Self {
        let channels = GAUGES + usize::from(tangential);
        Self {
            channels: channels.min(volts.width()),
            volts,
            row: 0,
        }
    }

    /// One scan at `t_s`, wherever that falls between the rows, within the pins' 0 to 3.3 V. A channel without a
    /// column rests.
    pub fn scan(&mut self, t_s: f64) -> [u16; CHANNELS] {
        let mut volts = [0.0; CHANNELS];
        self.volts
            .read(t_s, &mut self.row, &mut volts[..self.channels]);
        std::array::from_fn(|channel| {
            if channel < self.channels {
                code((volts[channel] / VOLTS_FULL_SCALE * CODES) as f32)
            } else {
                code(MID_RAIL_CODE)
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Series;

    #[test]
    fn a_saturated_gauge_stays_within_the_pins_and_swings_only_as_far_as_stated() {
        // From rail to rail, a second each.
        let at: Vec<f64> = (0..16_000).map(|row| f64::from(row) / 4_000.0).collect();
        let high = |row: usize| row / 4_000 % 2 == 1;
        let levels = (0..at.len()).flat_map(|row| [if high(row) { 3.3 } else { 0.0 }; GAUGES]);
        let rows = Series {
            values: levels.collect(),
            at,
            width: GAUGES,
        };
        let waveform = Waveform::band_limited(rows, 0.0, 4_000.0);
        let mut gauges = RecordedGauges::new(Arc::new(waveform), false);
        // Between the rows, as an emulated board's scans fall.
        for row in 0..15_999 {
            let [code, .., force] = gauges.scan((row as f64 + 0.4) / 4_000.0);
            assert_eq!(force, 2_048);
            let swing = if high(row) { 4_095 - code } else { code };
            let from_step = (row + 1) % 4_000;
            let from_step = from_step.min(4_000 - from_step);
            // 0.15 of the step beside it, 0.02 from seven rows on, 0.01 from thirteen on.
            let most = match from_step {
                0 => continue,
                1..7 => 615,
                7..13 => 82,
                _ => 41,
            };
            assert!(swing <= most, "{code} at {row}");
        }
    }
}
