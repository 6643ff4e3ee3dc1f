//! Samples of the gauges: a block a row, as the board sends them, for a message a sample would make a
//! recording's index alone larger than all that it holds.

use postcard_schema::Schema;
use protocol::{CHANNELS, GAUGE_BLOCK, GAUGES, GaugeSample, Gauges};
use serde::{Deserialize, Serialize};

/// A step of [`GaugeSample::codes`], in V.
pub const VOLTS_PER_CODE: f64 = 3.3 / 65_536.0;
/// Volts are written to 10 µV, a fifth of a step, so that the codes can be told from them.
const PER_VOLT: f64 = 1e5;
/// From a sample to the next, in µs.
pub const SAMPLE_US: u64 = 1_000;

/// Eight samples of the gauges at 1 kHz, 1 ms apart, after the sensor's anti-aliasing filter.
///
/// Volts at the ADC's pin are code · 3.3 V / 65 536.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct GaugesRow {
    /// [`Gauges::first_sample`]
    pub first_sample: u32,
    /// [`Gauges::instant_us`]
    pub instant_us: u64,
    /// [`Gauges::position_um`]
    pub position_um: i64,
    /// Travel of the arm in µm up to each sample from the one before.
    pub travel_um: [i16; GAUGE_BLOCK],
    /// Gauge 0 in steps of 3.3 V / 65 536.
    pub g0: [u16; GAUGE_BLOCK],
    /// Gauge 1 in steps of 3.3 V / 65 536.
    pub g1: [u16; GAUGE_BLOCK],
    /// Gauge 2 in steps of 3.3 V / 65 536.
    pub g2: [u16; GAUGE_BLOCK],
    /// Gauge 3 in steps of 3.3 V / 65 536.
    pub g3: [u16; GAUGE_BLOCK],
    /// Gauge 4 in steps of 3.3 V / 65 536.
    pub g4: [u16; GAUGE_BLOCK],
    /// The tangential force channel in steps of 3.3 V / 65 536.
    pub tangential: [u16; GAUGE_BLOCK],
}

/// A sample, at 1 kHz, after the sensor's anti-aliasing filter: a line of CSV, and a row of recordings of
/// format 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct GaugeRow {
    /// Its index since the sensor's start.
    pub sample: u32,
    /// The index of the first sample of the message that it came in.
    pub block: u32,
    /// When it was taken, in µs of the sensor's clock.
    pub instant_us: u64,
    /// Where the arm was then, in µm since the sensor's start.
    pub position_um: i64,
    /// Travel of the arm since the sample before, in µm.
    pub travel_um: i16,
    /// Gauge 0 in V, to 10 µV.
    pub g0_v: f64,
    /// Gauge 1 in V, to 10 µV.
    pub g1_v: f64,
    /// Gauge 2 in V, to 10 µV.
    pub g2_v: f64,
    /// Gauge 3 in V, to 10 µV.
    pub g3_v: f64,
    /// Gauge 4 in V, to 10 µV.
    pub g4_v: f64,
    /// The tangential force channel in V, to 10 µV.
    pub tangential_v: f64,
}

impl From<&Gauges> for GaugesRow {
    fn from(gauges: &Gauges) -> Self {
        let channel = |at: usize| gauges.samples.map(|sample| sample.codes[at]);
        Self {
            first_sample: gauges.first_sample,
            instant_us: gauges.instant_us,
            position_um: gauges.position_um,
            travel_um: gauges.samples.map(|sample| sample.travel_um),
            g0: channel(0),
            g1: channel(1),
            g2: channel(2),
            g3: channel(3),
            g4: channel(4),
            tangential: channel(5),
        }
    }
}

impl From<&GaugesRow> for Gauges {
    fn from(row: &GaugesRow) -> Self {
        let channels = [row.g0, row.g1, row.g2, row.g3, row.g4, row.tangential];
        Self {
            first_sample: row.first_sample,
            instant_us: row.instant_us,
            position_um: row.position_um,
            samples: std::array::from_fn(|at| GaugeSample {
                codes: channels.map(|codes| codes[at]),
                travel_um: row.travel_um[at],
            }),
        }
    }
}

impl GaugeRow {
    /// The samples of a message, in order.
    pub fn all(gauges: &Gauges) -> [Self; GAUGE_BLOCK] {
        let mut position_um = gauges.position_um;
        let mut at = 0;
        gauges.samples.map(|sample| {
            let index = at;
            at += 1;
            if index > 0 {
                position_um = position_um.saturating_add(sample.travel_um.into());
            }
            let [g0_v, g1_v, g2_v, g3_v, g4_v, tangential_v] = sample.codes.map(volts);
            Self {
                sample: gauges.first_sample.wrapping_add(index),
                block: gauges.first_sample,
                instant_us: gauges
                    .instant_us
                    .saturating_add(u64::from(index) * SAMPLE_US),
                position_um,
                travel_um: sample.travel_um,
                g0_v,
                g1_v,
                g2_v,
                g3_v,
                g4_v,
                tangential_v,
            }
        })
    }

    /// All channels in V, the tangential force last.
    pub const fn volts(&self) -> [f64; CHANNELS] {
        [
            self.g0_v,
            self.g1_v,
            self.g2_v,
            self.g3_v,
            self.g4_v,
            self.tangential_v,
        ]
    }

    /// All channels as the board sent them.
    pub fn codes(&self) -> [u16; CHANNELS] {
        // Saturates where no board could have said it.
        self.volts()
            .map(|volts| (volts / VOLTS_PER_CODE).round() as u16)
    }
}

const _: () = assert!(CHANNELS == GAUGES + 1);

fn volts(code: u16) -> f64 {
    (f64::from(code) * VOLTS_PER_CODE * PER_VOLT).round() / PER_VOLT
}

/// The message that rows came in; none if they are not the whole of one.
pub fn block(rows: &[GaugeRow]) -> Option<Gauges> {
    let first = rows.first()?;
    let whole = rows.len() == GAUGE_BLOCK
        && rows.iter().zip(0..).all(|(row, index)| {
            row.block == first.block && row.sample == first.block.wrapping_add(index)
        });
    let mut samples = [GaugeSample::default(); GAUGE_BLOCK];
    for (sample, row) in samples.iter_mut().zip(rows) {
        *sample = GaugeSample {
            codes: row.codes(),
            travel_um: row.travel_um,
        };
    }
    whole.then_some(Gauges {
        first_sample: first.block,
        instant_us: first.instant_us,
        position_um: first.position_um,
        samples,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_of_a_clock_at_its_end_are_rows() {
        let rows = GaugeRow::all(&Gauges {
            first_sample: u32::MAX,
            instant_us: u64::MAX,
            position_um: i64::MAX,
            samples: [GaugeSample {
                codes: [0; CHANNELS],
                travel_um: i16::MAX,
            }; GAUGE_BLOCK],
        });
        assert!(rows.iter().all(|row| row.instant_us == u64::MAX));
    }
}
