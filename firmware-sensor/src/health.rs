//! Which gauges can be believed.
//!
//! Every gauge is watched for what only a fault does: codes at the converter's ends, a code that never
//! changes, silence while others speak, noise above what is signal, hum that the others do not have, and
//! a signal that the wave does not explain which explains the others'. A gauge with a fault is left out;
//! it is taken back when it has had none for a while.

use protocol::{GAUGES, GaugeHealth};

use crate::{SCANS_PER_SAMPLE, Scan};

/// Codes so near the converter's ends are at an end: amplifiers do not reach the rails.
const RAIL_CODES: u16 = 8;
const HIGHEST_CODE: u16 = 4_095;
/// Time constant of everything that is averaged, in samples.
const FOLLOWED_SAMPLES: f32 = 300.0;
/// Share of scans at an end that makes a gauge saturated.
const AT_RAILS: f32 = 0.02;
/// Samples without a change of the code after which a gauge is stuck, if the others change.
const STILL_SAMPLES: u32 = 200;
/// A stuck code this near mid-rail is a gauge that is not connected.
const MID_RAIL: core::ops::RangeInclusive<u16> = 2_048 - 16..=2_048 + 16;
/// Power of a gauge relative to the strongest below which it says next to nothing.
const SILENT: f32 = 1e-4;
/// The strongest gauge must have this power, in ADC steps², before any is called silent.
const SPEAKING: f32 = 100.0;
/// White noise, relative to the typical gauge's whole power, above which a gauge is of no use.
const TOO_NOISY: f32 = 3.0;
/// Own hum's power, relative to the typical gauge's, above which a gauge is left out.
const TOO_MUCH_HUM: f32 = 0.5;
/// Estimates in a row that a gauge does not fit before it is called noisy.
const MISFIT_ESTIMATES: u8 = 30;
/// Estimates without a fault before a gauge is taken back.
const SOUND_ESTIMATES: u8 = 50;

/// The gauges' case histories.
#[derive(Clone, Copy, Debug, Default)]
pub struct Health {
    gauges: [History; GAUGES],
    samples: u32,
}

#[derive(Clone, Copy, Debug, Default)]
struct History {
    last: u16,
    still: u32,
    at_rails: f32,
    mean: f32,
    power: f32,
    misfits: u8,
    /// Estimates until it is taken back.
    sentence: u8,
    health: GaugeHealth,
}

/// What others know of the gauges.
#[derive(Clone, Copy, Debug, Default)]
pub struct Signs {
    /// Variance of each gauge's white noise, in ADC steps².
    pub noise: [f32; GAUGES],
    /// Amplitude of each gauge's own hum, in ADC steps.
    pub hum_lsb: [f32; GAUGES],
    /// Bit g set: gauge g does not fit the wave that the others agree on.
    pub misfits: u8,
    /// The others agree on one.
    pub agreed: bool,
}

impl Health {
    /// Takes a millisecond's scans and what the anti-aliasing filter makes of them.
    pub fn push(&mut self, scans: &[Scan; SCANS_PER_SAMPLE], sample: &[f32; GAUGES]) {
        if self.samples == 0 {
            for (history, x) in self.gauges.iter_mut().zip(sample) {
                history.mean = *x;
            }
        }
        self.samples = self.samples.saturating_add(1);
        let follow = 1.0 / (self.samples as f32).min(FOLLOWED_SAMPLES);
        for (gauge, history) in self.gauges.iter_mut().enumerate() {
            let mut changed = false;
            let mut at_rails = 0.0;
            for scan in scans {
                let code = scan[gauge];
                changed |= code != history.last;
                history.last = code;
                if !(RAIL_CODES..=HIGHEST_CODE - RAIL_CODES).contains(&code) {
                    at_rails += 1.0 / SCANS_PER_SAMPLE as f32;
                }
            }
            history.still = if changed { 0 } else { history.still.saturating_add(1) };
            history.at_rails += follow * (at_rails - history.at_rails);
            let away = sample[gauge] - history.mean;
            history.mean += follow * away;
            history.power += follow * (away * away - history.power);
        }
    }

    /// Judges every gauge anew, once an estimate.
    pub fn judge(&mut self, signs: &Signs) {
        let mut powers = self.gauges.map(|history| history.power);
        powers.sort_unstable_by(f32::total_cmp);
        let (typical, strongest) = (powers[GAUGES / 2], powers[GAUGES - 1]);
        let changing = self.gauges.iter().any(|history| history.still == 0);
        for (gauge, history) in self.gauges.iter_mut().enumerate() {
            let misfit = signs.misfits >> gauge & 1 == 1;
            if signs.agreed {
                history.misfits = if misfit { history.misfits.saturating_add(1) } else { 0 };
            }
            let hum = signs.hum_lsb[gauge] * signs.hum_lsb[gauge] / 2.0;
            let fault = if history.at_rails > AT_RAILS {
                GaugeHealth::Saturated
            } else if history.still >= STILL_SAMPLES && changing {
                if MID_RAIL.contains(&history.last) {
                    GaugeHealth::Dead
                } else {
                    GaugeHealth::Stuck
                }
            } else if strongest > SPEAKING && history.power < SILENT * strongest {
                GaugeHealth::Dead
            } else if signs.noise[gauge] > TOO_NOISY * typical {
                GaugeHealth::Noisy
            } else if hum > TOO_MUCH_HUM * typical {
                GaugeHealth::Hum
            } else if history.misfits >= MISFIT_ESTIMATES {
                GaugeHealth::Noisy
            } else {
                GaugeHealth::Good
            };
            if fault != GaugeHealth::Good {
                history.health = fault;
                history.sentence = SOUND_ESTIMATES;
            } else if history.sentence > 0 {
                history.sentence -= 1;
            } else {
                history.health = GaugeHealth::Good;
            }
        }
    }

    /// What is wrong with each gauge.
    pub fn verdicts(&self) -> [GaugeHealth; GAUGES] {
        self.gauges.map(|history| history.health)
    }

    /// Bit g set: nothing is wrong with gauge g.
    pub fn good(&self) -> u8 {
        let mut good = 0;
        for (gauge, history) in self.gauges.iter().enumerate() {
            good |= u8::from(history.health == GaugeHealth::Good) << gauge;
        }
        good
    }
}
