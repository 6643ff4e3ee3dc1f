//! Hum of a gauge's own: what it holds at a mains frequency beyond what is common to the gauges.

use protocol::GAUGES;

use super::common::{Amplitudes, conjugate_product, square, sum};
use crate::ESTIMATE_RATE_HZ;
use crate::float::{larger, smaller};

/// Estimates in a row without a texture that is known to be at the frequency, before what a gauge holds
/// there may be blamed on it: three of the followers' time constants of 0.25 s.
const SURE_ESTIMATES: u16 = (3 * ESTIMATE_RATE_HZ / 4) as u16;
/// Estimates from the start on before anything can be blamed on a gauge: what is found is too much texture.
const FIRST_ESTIMATES: u16 = 40;
/// Power relative to the median of three gauges or more, from which on it is hum of the gauge's own whatever
/// the texture does: that would be in all of them.
const OUTSTANDING: f32 = 16.0;
/// Hum is steady: in motion a gauge is blamed for no more than twice what it has had for so many estimates, or up to twice as
/// many. A shorter blow, as where one gauge lands before the others, is none.
const STEADY_ESTIMATES: u8 = 3;
/// A gauge's gain for common hum, relative to the others' mean, above which it is its own: amplifiers
/// differ from 0.3 to 1.5.
const MOST_GAIN: f32 = 5.0;

/// Whether a texture may be what a gauge holds.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Own {
    /// How far the texture was from the frequency last, in Hz; 0 if it was not known.
    off_hz: f32,
    /// It is known to be elsewhere now.
    elsewhere: bool,
    /// Estimates since the start.
    heard: u16,
    /// Estimates since it was known to be here.
    clean: u16,
}

impl Own {
    /// Takes how far the texture is from the frequency in Hz, if that is known, and whether that or
    /// a harmonic is near.
    pub fn learn(&mut self, off_hz: Option<f32>, near: bool) {
        self.heard = self.heard.saturating_add(1);
        let now_hz = off_hz.unwrap_or(0.0);
        // A stroke may pass the frequency between two estimates.
        let near = near || now_hz * self.off_hz < 0.0;
        self.off_hz = now_hz;
        self.elsewhere = off_hz.is_some() && !near;
        self.clean = if near {
            0
        } else {
            self.clean.saturating_add(1)
        };
    }

    /// Power of each gauge's own hum in ADC steps², of what is `found` at the frequency while the arm rests
    /// or moves; 0 as long as it may be texture.
    pub fn powers(&self, found: &Amplitudes, usable: u8, rests: bool) -> [f32; GAUGES] {
        if self.heard < FIRST_ESTIMATES {
            [0.0; GAUGES]
        } else if rests || (self.elsewhere && self.clean >= SURE_ESTIMATES) {
            not_common(found, usable)
        } else {
            outstanding(found, usable)
        }
    }
}

/// Powers that have been there for a while.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SteadyPowers {
    /// The least in so many estimates, and in the [`STEADY_ESTIMATES`] before.
    now: [f32; GAUGES],
    before: [f32; GAUGES],
    estimates: u8,
}

impl SteadyPowers {
    /// Takes an estimate's powers; gives what of them is steady.
    pub fn update(&mut self, powers: [f32; GAUGES]) -> [f32; GAUGES] {
        if self.estimates == STEADY_ESTIMATES {
            self.estimates = 0;
            self.before = core::mem::replace(&mut self.now, powers);
        }
        self.estimates += 1;
        core::array::from_fn(|gauge| {
            self.now[gauge] = smaller(self.now[gauge], powers[gauge]);
            let least = smaller(self.now[gauge], self.before[gauge]);
            smaller(powers[gauge], 2.0 * least)
        })
    }
}

/// Power beyond what the other usable gauges have in common.
fn not_common(found: &Amplitudes, usable: u8) -> [f32; GAUGES] {
    let sum = sum(found, usable);
    core::array::from_fn(|gauge| {
        let z = found[gauge];
        let take = f32::from(usable >> gauge & 1);
        let others = [sum[0] - take * z[0], sum[1] - take * z[1]];
        let count = (usable & !(1 << gauge)).count_ones().max(1) as f32;
        let [along, _] = conjugate_product(z, others);
        // What is common to them is this one's too: no more than an amplifier may make of their mean,
        // nor against it.
        let most = MOST_GAIN / count;
        let common = if along <= 0.0 {
            0.0
        } else if along <= most * square(others) {
            along * along / square(others)
        } else {
            most * (2.0 * along - most * square(others))
        };
        0.5 * larger(square(z) - common, 0.0)
    })
}

/// Power of those gauges that have far more of it than the usable ones.
fn outstanding(found: &Amplitudes, usable: u8) -> [f32; GAUGES] {
    let powers = found.map(|z| 0.5 * square(z));
    let mut sorted = [0.0; GAUGES];
    let (mut count, mut least, mut most) = (0, f32::MAX, 0.0);
    for (gauge, &power) in powers.iter().enumerate() {
        most = larger(most, power);
        if usable >> gauge & 1 == 1 {
            least = smaller(least, power);
            sorted[count] = power;
            count += 1;
        }
    }
    // None stands out of the median that does not stand out of the least: no need to sort.
    if count < 3 || most <= OUTSTANDING * least {
        return [0.0; GAUGES];
    }
    let sorted = &mut sorted[..count];
    sorted.sort_unstable_by(f32::total_cmp);
    let most = OUTSTANDING * sorted[count / 2];
    powers.map(|power| if power > most { power } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: u8 = 0b1_1111;

    fn powers(found: Amplitudes, usable: u8) -> [f32; GAUGES] {
        let mut own = Own::default();
        for _ in 0..FIRST_ESTIMATES {
            own.learn(None, false);
        }
        own.powers(&found, usable, true)
    }

    fn assert_near(got: [f32; GAUGES], want: [f32; GAUGES]) {
        for (got, want) in got.into_iter().zip(want) {
            assert!(
                (got - want).abs() < 1e-3 * want.abs() + 1e-3,
                "{got}, not {want}"
            );
        }
    }

    #[test]
    fn what_all_gauges_have_in_common_is_nobodys_own() {
        assert_near(powers([[10.0, 5.0]; GAUGES], ALL), [0.0; GAUGES]);
        // Nor is what an amplifier makes more or less of.
        let mut found = [[10.0, 5.0]; GAUGES];
        found[3] = [40.0, 20.0];
        assert_near(powers(found, ALL), [0.0; GAUGES]);
    }

    #[test]
    fn what_lies_across_what_is_common_or_against_it_is_its_own() {
        // Half of |z|² is the power. Without gauge 2 the others have 10 in common.
        let mut found = [[10.0, 0.0]; GAUGES];
        found[2] = [10.0, 8.0];
        assert!((powers(found, ALL)[2] - 32.0).abs() < 0.1);
        found[2] = [-8.0, 0.0];
        assert!((powers(found, ALL)[2] - 32.0).abs() < 0.1);
        // More than five times the others' mean is no amplifier's doing: of 80 some 30.
        found[2] = [80.0, 0.0];
        assert!((powers(found, ALL)[2] - 0.5 * 30.0 * 30.0).abs() < 0.1);
        // Whether it is usable or not.
        assert!((powers(found, 0b1_1011)[2] - 0.5 * 30.0 * 30.0).abs() < 0.1);
    }

    #[test]
    fn beside_a_texture_that_may_be_there_only_what_stands_out_is_its_own() {
        let mut own = Own::default();
        let mut found = [[4.0, 0.0]; GAUGES];
        found[1] = [0.0, 17.0];
        let at_once = |own: &Own, usable| own.powers(&found, usable, false);
        assert_eq!(at_once(&own, ALL), [0.0; GAUGES], "too early");
        for _ in 0..FIRST_ESTIMATES {
            own.learn(Some(0.5), true);
        }
        // Sixteen times the median's power of 8 is 128.
        assert_eq!(at_once(&own, ALL), [0.0, 144.5, 0.0, 0.0, 0.0]);
        assert_eq!(at_once(&own, 0b0_0011), [0.0; GAUGES], "two know no median");
        // Elsewhere for long enough, what is not common counts. A stroke that passes it begins anew.
        for _ in 0..SURE_ESTIMATES {
            own.learn(Some(5.0), false);
        }
        assert!(at_once(&own, ALL)[0] > 0.0);
        own.learn(Some(-5.0), false);
        assert_eq!(at_once(&own, ALL)[0], 0.0);
    }
}
