//! Collects samples into [`Gauges`] messages.

use protocol::{CHANNELS, GAUGE_BLOCK, GaugeSample, Gauges};

use crate::MID_RAIL_CODE;

/// Sixteenths of an ADC step: what a sample is sent in.
const SIXTEENTHS: f32 = 16.0;

/// A block being filled.
#[derive(Clone, Debug)]
pub struct Block {
    gauges: Gauges,
    filled: usize,
}

/// When and where a sample was taken.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Counts samples since the start.
    pub sample: u32,
    /// In µs of the board's clock.
    pub instant_us: u64,
    /// The arm's position in µm.
    pub position_um: i64,
    /// The arm's position at the sample before, in µm.
    pub position_before_um: i64,
}

impl Default for Block {
    fn default() -> Self {
        let gauges = Gauges {
            first_sample: 0,
            instant_us: 0,
            position_um: 0,
            samples: [GaugeSample::default(); GAUGE_BLOCK],
        };
        Self { gauges, filled: 0 }
    }
}

impl Block {
    /// Takes a sample, in ADC steps from mid-rail; returns the block that it completes.
    pub fn push(&mut self, place: Place, sample: &[f32; CHANNELS]) -> Option<Gauges> {
        if self.filled == 0 {
            self.gauges.first_sample = place.sample;
            self.gauges.instant_us = place.instant_us;
            self.gauges.position_um = place.position_um;
        }
        let travel_um = place.position_um - place.position_before_um;
        self.gauges.samples[self.filled] = GaugeSample {
            codes: sample.map(code),
            travel_um: travel_um.clamp(i16::MIN.into(), i16::MAX.into()) as i16,
        };
        self.filled = (self.filled + 1) % GAUGE_BLOCK;
        (self.filled == 0).then_some(self.gauges)
    }

    /// Throws away what has been collected.
    pub fn clear(&mut self) {
        self.filled = 0;
    }
}

/// Rounded, and kept within the range: the anti-aliasing filter overshoots at the rails.
fn code(from_mid_rail: f32) -> u16 {
    ((from_mid_rail + f32::from(MID_RAIL_CODE)) * SIXTEENTHS + 0.5) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sends_eight_samples_with_the_place_of_the_first() {
        let mut block = Block::default();
        for sample in 100..108 {
            let n = i64::from(sample);
            let place = Place {
                sample,
                instant_us: u64::from(sample) * 1_000,
                position_um: n * 50,
                position_before_um: (n - 1) * 50,
            };
            let got = block.push(place, &[0.0, 0.25, -2_048.0, 2_047.0, -3_000.0, 3_000.0]);
            assert_eq!(got.is_some(), sample == 107);
            if let Some(gauges) = got {
                assert_eq!(gauges.first_sample, 100);
                assert_eq!(gauges.instant_us, 100_000);
                assert_eq!(gauges.position_um, 5_000);
                for sample in gauges.samples {
                    assert_eq!(sample.codes, [32_768, 32_772, 0, 65_520, 0, 65_535]);
                    assert_eq!(sample.travel_um, 50);
                }
            }
        }
    }
}
