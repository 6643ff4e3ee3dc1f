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
/// Time constant of everything that is averaged, in estimates.
const FOLLOWED_ESTIMATES: f32 = 30.0;
/// Share of scans at an end that makes a gauge saturated; white noise at −6 dB clips less.
const AT_RAILS: f32 = 0.1;
/// Estimates without a change of the code after which a gauge is stuck, if others change.
const STILL_ESTIMATES: u32 = 20;
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
    /// Whose codes are looked at next.
    next: usize,
    /// Since the last judgement.
    samples: u16,
    judgements: u16,
}

#[derive(Clone, Copy, Debug, Default)]
struct History {
    last: u16,
    /// The code has changed since the last judgement.
    changed: bool,
    /// Looks at its codes since then, four scans each, and how many of them were at an end of the range.
    looks: u16,
    ends: u16,
    /// Sums of the samples and their squares since then.
    sum: f32,
    squares: f32,
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
    /// Power of each gauge's own hum, in ADC steps².
    pub hum: [f32; GAUGES],
    /// Bit g set: gauge g does not fit the wave that the others agree on.
    pub misfits: u8,
    /// The others agree on one.
    pub agreed: bool,
}

impl Health {
    /// Takes a millisecond's scans and what the anti-aliasing filter makes of them.
    pub fn push(&mut self, scans: &[Scan; SCANS_PER_SAMPLE], sample: &[f32; GAUGES]) {
        // The codes of one gauge a millisecond: what is looked for lasts longer than that.
        let history = &mut self.gauges[self.next];
        for scan in scans {
            let code = scan[self.next];
            history.changed |= code != history.last;
            history.last = code;
            // One comparison for both ends.
            let from_low = code.wrapping_sub(RAIL_CODES);
            history.ends += u16::from(from_low > HIGHEST_CODE - 2 * RAIL_CODES);
        }
        history.looks += 1;
        self.next = if self.next + 1 == GAUGES {
            0
        } else {
            self.next + 1
        };
        self.samples += 1;
        for (history, x) in self.gauges.iter_mut().zip(sample) {
            history.sum += x;
            history.squares += x * x;
        }
    }

    /// Judges every gauge anew, once an estimate.
    pub fn judge(&mut self, signs: &Signs) {
        let samples = core::mem::take(&mut self.samples);
        if samples == 0 {
            return;
        }
        self.judgements = self.judgements.saturating_add(1);
        let follow = 1.0 / f32::from(self.judgements).min(FOLLOWED_ESTIMATES);
        for history in &mut self.gauges {
            history.follow(samples, follow);
        }
        let mut powers = self.gauges.map(|history| history.power);
        powers.sort_unstable_by(f32::total_cmp);
        let (typical, strongest) = (powers[GAUGES / 2], powers[GAUGES - 1]);
        let changing = self.gauges.iter().any(|history| history.still == 0);
        for (gauge, history) in self.gauges.iter_mut().enumerate() {
            let misfit = signs.misfits >> gauge & 1 == 1;
            if signs.agreed {
                history.misfits = if misfit {
                    history.misfits.saturating_add(1)
                } else {
                    0
                };
            }
            let fault = if history.at_rails > AT_RAILS {
                GaugeHealth::Saturated
            } else if history.still >= STILL_ESTIMATES && changing {
                if MID_RAIL.contains(&history.last) {
                    GaugeHealth::Dead
                } else {
                    GaugeHealth::Stuck
                }
            } else if strongest > SPEAKING && history.power < SILENT * strongest {
                GaugeHealth::Dead
            } else if signs.noise[gauge] > TOO_NOISY * typical {
                GaugeHealth::Noisy
            } else if signs.hum[gauge] > TOO_MUCH_HUM * typical {
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

impl History {
    /// Takes what has been summed over `samples` into the averages.
    fn follow(&mut self, samples: u16, follow: f32) {
        let count = f32::from(samples);
        let looks = core::mem::take(&mut self.looks);
        if looks > 0 {
            self.still = if core::mem::take(&mut self.changed) {
                0
            } else {
                self.still.saturating_add(1)
            };
            let ends = f32::from(core::mem::take(&mut self.ends));
            let ends = ends / (f32::from(looks) * SCANS_PER_SAMPLE as f32);
            self.at_rails += follow * (ends - self.at_rails);
        }
        let mean = core::mem::take(&mut self.sum) / count;
        let square = core::mem::take(&mut self.squares) / count;
        self.mean += follow * (mean - self.mean);
        // About the mean of the last 0.3 s: a slow texture's swing over 10 ms counts too.
        let power = square - 2.0 * mean * self.mean + self.mean * self.mean;
        self.power += follow * (power.max(0.0) - self.power);
    }
}
