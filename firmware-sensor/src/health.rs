//! Which gauges can be believed.
//!
//! Every gauge is watched for what only a fault does: codes at the converter's ends, a code that never
//! changes, silence while others speak, noise above what is signal, hum that the others do not have, and
//! a signal that the wave does not explain which explains the others'. A gauge with a fault is left out;
//! it is taken back when it has had none for a while.

use protocol::{GAUGES, GaugeHealth};

use crate::float::{larger, smaller};
use crate::{MID_RAIL_CODE, SCANS_PER_SAMPLE, Scan};

/// Codes so near the converter's ends are at an end: amplifiers do not reach the rails.
const RAIL_CODES: u16 = 8;
const HIGHEST_CODE: u16 = 4_095;
/// Time constant of everything that is averaged, in estimates.
const FOLLOWED_ESTIMATES: f32 = 30.0;
/// Share of scans at an end that makes a gauge saturated; white noise at −6 dB clips less.
const AT_RAILS: f32 = 0.1;
/// Scans at an end between two estimates, of the eight that are looked at, from which on a gauge is off at once if what it
/// feels does not reach there. A contact that bounces is off for a millisecond and longer; spikes, and the crests of a
/// texture that grows, are at an end for less.
const OFF_SCANS: u16 = SCANS_PER_SAMPLE as u16;
/// How far a texture reaches, relative to its RMS: farther than any wave does.
const CREST: f32 = 4.0;
/// Estimates, as bits, in which most gauges are off if what they share is, as a connector or a blow: then all are.
const TOGETHER: u8 = 0b111;
/// Estimates without a change of the code after which a gauge is stuck, if another speaks.
const STILL_ESTIMATES: u32 = 20;
/// Travel without a change of any gauge's code, in mm, from which on nothing is felt: the converter says the same for ever, or
/// what there is is less than one of its steps. A fingertip that sticks where the arm turns is carried along for twice its
/// deflection, 2.5 mm at 0.5 N and 400 N/m, and lets go.
const ALL_STILL_MM: f32 = 4.0;
/// A stuck code this near mid-rail is a gauge that is not connected.
const MID_RAIL: core::ops::RangeInclusive<u16> = 2_048 - 16..=2_048 + 16;
/// Power of a gauge relative to the second strongest below which it says next to nothing. To the second,
/// since one alone may have been pushed or be at fault.
const SILENT: f32 = 1e-4;
/// Power from which on a gauge speaks, in ADC steps², beyond what its noise may be in 10 ms. Where none does, as on a
/// smooth surface or at rest, there is nothing to tell a silent or a stuck gauge by.
const SPEAKING: f32 = 100.0;
/// Ten samples of white noise have more than so many times their variance once in 25 000 times.
const SPEAKING_PER_NOISE: f32 = 4.0;
/// The typical gauge's power is taken for no less, in ADC steps²: noise and hum that are below it do no
/// harm, and a power near 0 is what rounding leaves of its offset.
const LEAST_TYPICAL: f32 = 4.0;
/// Noise, relative to the typical gauge's whole power, above which a gauge is of no use.
const TOO_NOISY: f32 = 3.0;
/// Own hum's power, relative to the typical gauge's, above which a gauge is left out.
const TOO_MUCH_HUM: f32 = 0.5;
/// Estimates in a row that a gauge does not fit before it is called noisy.
const MISFIT_ESTIMATES: u8 = 30;
/// Travel, in mm, for which it must not fit, too: more than a fingertip is long. While it is across a boundary, the gauges
/// in front feel another wave than those behind, and nothing is wrong with either.
const MISFIT_MM: f32 = 10.0;
/// Estimates without a fault before a gauge is taken back.
const SOUND_ESTIMATES: u8 = 50;
/// The same where all were off: a blow, or a supply that failed, is over for all of them.
const SOUND_TOGETHER_ESTIMATES: u8 = 10;

/// The gauges' case histories.
#[derive(Clone, Copy, Debug, Default)]
pub struct Health {
    gauges: [History; GAUGES],
    /// Whose codes are looked at next.
    next: usize,
    /// Since the last judgement.
    samples: u16,
    judgements: u16,
    /// Bit g set: gauge g is left out.
    left_out: u8,
    /// See [`Measure::silent_ones`], of the judgement before.
    silent_ones: u8,
    /// Travel since a gauge's code last changed, in mm.
    still_mm: f32,
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
    /// Bit n set: n estimates ago it was at an end that what it had felt until then does not reach.
    off: u8,
    mean: f32,
    power: f32,
    /// Power over the time since the judgement before, about the mean of the last 0.3 s.
    latest: f32,
    /// The same, about the mean of that time.
    now: f32,
    /// Estimates, and travel in mm, since it last fitted.
    misfits: u8,
    misfit_mm: f32,
    /// Estimates until it is taken back.
    sentence: u8,
    health: GaugeHealth,
}

/// What others know of the gauges.
#[derive(Clone, Copy, Debug, Default)]
pub struct Signs {
    /// Variance of each gauge's noise behind the anti-aliasing filter, in ADC steps².
    pub noise: [f32; GAUGES],
    /// Power of each gauge's own hum, in ADC steps².
    pub hum: [f32; GAUGES],
    /// Bit g set: gauge g does not fit the wave that the others agree on.
    pub misfits: u8,
    /// The others agree on one.
    pub agreed: bool,
    /// Travel since the last judgement, in mm.
    pub travel_mm: f32,
    /// Bit g set: gauge g is allowed to take part. The others are judged too, but not the measure of
    /// anything: they may not be connected.
    pub allowed: u8,
}

impl Signs {
    /// Whether most gauges have noise beside which no code stands still, also at rest. Those of `others` do not count.
    #[cold]
    fn most_are_noisy(&self, others: u8) -> bool {
        let counts = self.allowed & !others;
        let noises = self.noise.iter().enumerate();
        let noisy = noises.filter(|(gauge, noise)| counts >> gauge & 1 == 1 && **noise > SPEAKING);
        2 * noisy.count() > self.allowed.count_ones() as usize
    }
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
            history.ends += u16::from(is_at_end(code));
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
    #[inline(never)]
    pub fn judge(&mut self, signs: &Signs) {
        let samples = core::mem::take(&mut self.samples);
        if samples == 0 {
            return;
        }
        self.judgements = self.judgements.saturating_add(1);
        let follow = 1.0 / smaller(f32::from(self.judgements), FOLLOWED_ESTIMATES);
        // Powers of a few samples are anything.
        let settled = f32::from(self.judgements) >= FOLLOWED_ESTIMATES;
        let mut off = 0;
        for (gauge, history) in self.gauges.iter_mut().enumerate() {
            history.follow(samples, follow);
            if !settled {
                history.off = 0;
            }
            off |= u8::from(history.off & TOGETHER != 0) << gauge;
        }
        let all_off = 2 * (off & signs.allowed).count_ones() > signs.allowed.count_ones();
        let measure = Measure::of(&self.gauges, signs);
        // Where all have stood still, one of them changes first, and one has stood still for an estimate longer.
        let silent_before = core::mem::replace(&mut self.silent_ones, measure.silent_ones);
        let others = core::mem::take(&mut self.left_out) | measure.silent_ones | silent_before;
        self.still_mm += signs.travel_mm;
        for (gauge, history) in self.gauges.iter_mut().enumerate() {
            if history.still == 0 {
                self.still_mm = 0.0;
            }
            let misfit = signs.misfits >> gauge & 1 == 1;
            if signs.agreed && misfit {
                history.misfits = history.misfits.saturating_add(1);
                history.misfit_mm += signs.travel_mm;
            } else if signs.agreed {
                history.misfits = 0;
                history.misfit_mm = 0.0;
            }
            let fault = if history.at_rails > AT_RAILS || history.off & 1 == 1 || all_off {
                GaugeHealth::Saturated
            } else if history.still >= STILL_ESTIMATES
                && (measure.speaks_now
                    || history.still > STILL_ESTIMATES + 1 && signs.most_are_noisy(others))
            {
                if MID_RAIL.contains(&history.last) {
                    GaugeHealth::Dead
                } else {
                    GaugeHealth::Stuck
                }
            } else if history.power < measure.silent {
                GaugeHealth::Dead
            } else if settled && signs.noise[gauge] > TOO_NOISY * measure.typical {
                GaugeHealth::Noisy
            } else if signs.hum[gauge] > TOO_MUCH_HUM * measure.typical {
                GaugeHealth::Hum
            } else if history.misfits >= MISFIT_ESTIMATES && history.misfit_mm > MISFIT_MM {
                // The average has not forgotten yet what was felt before.
                if history.latest < measure.silent {
                    GaugeHealth::Dead
                } else {
                    GaugeHealth::Noisy
                }
            } else {
                GaugeHealth::Good
            };
            if fault != GaugeHealth::Good {
                history.health = fault;
                history.sentence = if all_off && history.at_rails <= AT_RAILS {
                    SOUND_TOGETHER_ESTIMATES
                } else {
                    SOUND_ESTIMATES
                };
            } else if history.sentence > 0 {
                history.sentence -= 1;
            } else {
                history.health = GaugeHealth::Good;
            }
            self.left_out |= u8::from(history.health != GaugeHealth::Good) << gauge;
        }
    }

    /// What is wrong with each gauge.
    pub fn verdicts(&self) -> [GaugeHealth; GAUGES] {
        self.gauges.map(|history| history.health)
    }

    /// Bit g set: nothing is wrong with gauge g.
    pub fn good(&self) -> u8 {
        !self.left_out & ((1 << GAUGES) - 1)
    }

    /// Bit g set: gauge g can be believed. None while no gauge feels anything.
    pub fn believed(&self) -> u8 {
        if self.stands_still() { 0 } else { self.good() }
    }

    /// Whether no gauge feels anything: no code has changed for a while.
    pub fn stands_still(&self) -> bool {
        self.still_mm > ALL_STILL_MM
    }
}

/// Whether a code is at an end of the converter's range.
pub fn is_at_end(code: u16) -> bool {
    // One comparison for both.
    code.wrapping_sub(RAIL_CODES) > HIGHEST_CODE - 2 * RAIL_CODES
}

/// What a gauge is measured by: the allowed ones that are neither at an end of the range nor stuck, and of these the ones
/// that speak. Where none does, as at rest, all of them.
struct Measure {
    /// Their median power, in ADC steps², and no less than [`LEAST_TYPICAL`]; infinite if there are none.
    typical: f32,
    /// Power below which a gauge is silent while others speak; 0 if they do not.
    silent: f32,
    /// One of them at least speaks now: codes stand still at rest, too.
    speaks_now: bool,
    /// Bit g set: gauge g is none of them.
    silent_ones: u8,
}

impl Measure {
    fn of(gauges: &[History; GAUGES], signs: &Signs) -> Self {
        let (mut all, mut speaking) = (Powers::default(), Powers::default());
        let mut speaks_now = false;
        let mut silent_ones = 0;
        for (gauge, history) in gauges.iter().enumerate() {
            let allowed = signs.allowed >> gauge & 1 == 1;
            if allowed && history.at_rails <= AT_RAILS && history.still < STILL_ESTIMATES {
                all.push(history.power);
                // What is noise, or hum of its own, it does not feel.
                let speaks = SPEAKING + SPEAKING_PER_NOISE * signs.noise[gauge] + signs.hum[gauge];
                if history.power > speaks {
                    speaking.push(history.power);
                }
                speaks_now |= history.health == GaugeHealth::Good && history.now > speaks;
            } else {
                silent_ones |= 1 << gauge;
            }
        }
        let others_speak = speaking.count >= 2;
        let mut measure = if speaking.count > 0 { speaking } else { all };
        let powers = measure.sorted();
        // Nothing is too much where there is nothing to measure by: all codes stand still, or are at an end.
        let typical = powers
            .get(powers.len() / 2)
            .copied()
            .unwrap_or(f32::INFINITY);
        let silent = match powers {
            [.., second, _] if others_speak => SILENT * second,
            _ => 0.0,
        };
        Self {
            typical: typical.max(LEAST_TYPICAL),
            silent,
            speaks_now,
            silent_ones,
        }
    }
}

/// Some gauges' powers.
#[derive(Default)]
struct Powers {
    powers: [f32; GAUGES],
    count: usize,
}

impl Powers {
    fn push(&mut self, power: f32) {
        self.powers[self.count] = power;
        self.count += 1;
    }

    fn sorted(&mut self) -> &[f32] {
        let powers = &mut self.powers[..self.count];
        powers.sort_unstable_by(f32::total_cmp);
        powers
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
            let ends = core::mem::take(&mut self.ends);
            let room = larger(f32::from(MID_RAIL_CODE) - self.mean.abs(), 0.0);
            let is_off = ends >= OFF_SCANS && CREST * CREST * self.power < room * room;
            self.off = self.off << 1 | u8::from(is_off);
            let ends = f32::from(ends) / (f32::from(looks) * SCANS_PER_SAMPLE as f32);
            self.at_rails += follow * (ends - self.at_rails);
        }
        let mean = core::mem::take(&mut self.sum) / count;
        let square = core::mem::take(&mut self.squares) / count;
        self.mean += follow * (mean - self.mean);
        // About the mean of the last 0.3 s: a slow texture's swing over 10 ms counts too.
        let power = square - 2.0 * mean * self.mean + self.mean * self.mean;
        self.latest = larger(power, 0.0);
        self.power += follow * (self.latest - self.power);
        self.now = square - mean * mean;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::Noise;
    use protocol::CHANNELS;

    const ALL: u8 = 0b11111;
    const PI: f64 = core::f64::consts::PI;

    /// Gauges that are watched, and what becomes of their signals.
    struct Ward {
        health: Health,
        noise: Noise,
        signs: Signs,
        ms: u32,
        random: u64,
        /// How often a verdict has changed.
        changes: u32,
    }

    impl Ward {
        fn new() -> Self {
            Self {
                health: Health::default(),
                noise: Noise::default(),
                signs: Signs {
                    allowed: ALL,
                    travel_mm: 0.5,
                    ..Signs::default()
                },
                ms: 0,
                random: 1,
                changes: 0,
            }
        }

        /// Evenly over ±1, of variance ⅓.
        fn uniform(&mut self) -> f64 {
            self.random = self
                .random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (self.random >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }

        /// An estimate's time of signals, in steps from mid-rail: of gauge, s and a noise of ±1.
        fn estimate(&mut self, signal: &impl Fn(usize, f64, f64) -> f64) -> [GaugeHealth; GAUGES] {
            for _ in 0..10 {
                let scans = core::array::from_fn(|scan| {
                    let t_s = f64::from(self.ms) * 1e-3 + scan as f64 * 0.25e-3;
                    let mut codes = [2_048; CHANNELS];
                    for (gauge, code) in codes.iter_mut().enumerate().take(GAUGES) {
                        let level = 2_048.0 + signal(gauge, t_s, self.uniform());
                        *code = libm::round(level.clamp(0.0, 4_095.0)) as u16;
                    }
                    codes
                });
                // As much of the noise as the anti-aliasing filter leaves, nearly.
                let sample = core::array::from_fn(|gauge| {
                    scans
                        .iter()
                        .map(|scan: &Scan| f32::from(scan[gauge]) - 2_048.0)
                        .sum::<f32>()
                        / 4.0
                });
                self.noise.push(&sample);
                self.health.push(&scans, &sample);
                self.ms += 1;
            }
            let before = self.health.verdicts();
            self.signs.noise = self.noise.variances();
            self.health.judge(&self.signs);
            self.changes += u32::from(self.health.verdicts() != before);
            self.health.verdicts()
        }

        fn estimates(
            &mut self,
            count: u32,
            signal: impl Fn(usize, f64, f64) -> f64,
        ) -> [GaugeHealth; GAUGES] {
            for _ in 0..count {
                self.estimate(&signal);
            }
            self.health.verdicts()
        }

        /// Estimates until `gauge` is `health`, and the others are as good as before all the while.
        fn until(
            &mut self,
            gauge: usize,
            health: GaugeHealth,
            signal: impl Fn(usize, f64, f64) -> f64,
        ) -> u32 {
            let mut want = self.health.verdicts();
            want[gauge] = health;
            for estimates in 1..1_000 {
                let verdicts = self.estimate(&signal);
                if verdicts == want {
                    return estimates;
                }
                let mut others = verdicts;
                others[gauge] = health;
                assert_eq!(others, want, "after {estimates} estimates");
            }
            panic!("gauge {gauge} is never {health:?}");
        }
    }

    /// A texture at 35 Hz, 20 dB above its noise in the band to 500 Hz, with an offset each.
    fn texture(gauge: usize, t_s: f64, noise: f64) -> f64 {
        let gain = [1.0, 0.8, 1.1, 0.6, 0.9][gauge];
        gain * 185.0 * libm::sin(2.0 * PI * 35.0 * t_s + gauge as f64)
            + 25.0 * noise * libm::sqrt(3.0)
            + 100.0 * (gauge as f64 - 2.0)
    }

    /// The same, but one gauge's is `fault`.
    fn but(gauge: usize, fault: impl Fn(f64, f64) -> f64) -> impl Fn(usize, f64, f64) -> f64 {
        move |at, t_s, noise| {
            if at == gauge {
                fault(t_s, noise)
            } else {
                texture(at, t_s, noise)
            }
        }
    }

    /// A broken gauge's signal, of s and a noise of ±1.
    type Fault = fn(f64, f64) -> f64;

    const GOOD: [GaugeHealth; GAUGES] = [GaugeHealth::Good; GAUGES];

    #[test]
    fn gauges_that_are_well_stay_so() {
        let mut ward = Ward::new();
        assert_eq!(ward.estimates(1_000, texture), GOOD);
        assert_eq!(ward.changes, 0);
        assert_eq!(ward.health.good(), ALL);
    }

    #[test]
    fn each_fault_is_found_in_time_left_out_and_forgiven_in_time() {
        // 20 estimates without a change of code, and the one in which the signal broke off.
        let still = 21;
        // The mean over 0.3 s falls from 0.85 of the scans at the ends, at most, to 0.1.
        let off_the_rails = 30.0 * libm::log(0.85 / 0.1);
        // ±1 900 evenly, of which a quarter of the power is left in the band, is 22 times the median power of the
        // others; the threshold is at 3. The second quietest of eight looks is noisy after seven, and believed at once; quiet
        // after two, and then followed with a time constant of fifty, with swings of a third before.
        let ratio = 22.0 / 3.0;
        let noisy = 7;
        let quiet_again = 2.0 + 50.0 * libm::log(1.5 * ratio);
        let faults: [(usize, GaugeHealth, Fault, u32, f64); 5] = [
            (1, GaugeHealth::Dead, |_, _| 3.0, still, 1.0),
            (2, GaugeHealth::Stuck, |_, _| 700.0, still, 1.0),
            (3, GaugeHealth::Stuck, |_, _| -1_900.0, still, 1.0),
            (
                0,
                GaugeHealth::Saturated,
                |t_s, noise| 20.0 * texture(2, t_s, noise),
                5,
                off_the_rails,
            ),
            (
                4,
                GaugeHealth::Noisy,
                |_, noise| 1_900.0 * noise,
                noisy + 1,
                quiet_again,
            ),
        ];
        for (gauge, health, fault, found, well) in faults {
            let mut ward = Ward::new();
            ward.estimates(200, texture);
            let estimates = ward.until(gauge, health, but(gauge, fault));
            assert!(estimates <= found, "{health:?} after {estimates}");
            assert_eq!(ward.health.good(), ALL & !(1 << gauge));
            ward.estimates(300, but(gauge, fault));
            assert_eq!(ward.health.good(), ALL & !(1 << gauge));
            let estimates = ward.until(gauge, GaugeHealth::Good, texture);
            let forgiven = well as u32 + 1 + u32::from(SOUND_ESTIMATES) + 1;
            assert!(estimates <= forgiven, "{health:?} until {estimates}");
            assert!(estimates > u32::from(SOUND_ESTIMATES), "{estimates}");
            assert_eq!(ward.health.verdicts(), GOOD);
        }
    }

    #[test]
    fn a_gauge_that_others_speak_beside_is_dead_even_if_its_code_flickers() {
        let mut ward = Ward::new();
        ward.estimates(200, texture);
        // The power falls to 1e-4 of the second strongest's, all but 1e-5 in noise: 30 ln(1e4) estimates.
        let estimates = ward.until(1, GaugeHealth::Dead, but(1, |_, noise| noise));
        assert!(estimates <= 290, "{estimates}");
    }

    #[test]
    fn a_code_that_stands_still_beside_others_noise_is_dead_however_slow_the_wave() {
        for gauge in 0..GAUGES {
            let mut ward = Ward::new();
            let wave = |at: usize, t_s: f64, noise: f64| {
                150.0 * libm::sin(2.0 * PI * 3.0 * t_s + at as f64) + 120.0 * noise
            };
            assert_eq!(ward.estimates(200, wave), GOOD);
            let one_is_still = |at, t_s, noise| {
                if at == gauge {
                    0.0
                } else {
                    wave(at, t_s, noise)
                }
            };
            let estimates = ward.until(gauge, GaugeHealth::Dead, one_is_still);
            assert!(estimates <= 30, "{estimates}");
        }
    }

    #[test]
    fn where_all_codes_stood_still_together_none_is_blamed_when_they_go_on() {
        for (from_ms, still_ms) in (0..10).flat_map(|from| (190..240).map(move |for_| (from, for_)))
        {
            let mut ward = Ward::new();
            let from_s = 1.0 + f64::from(from_ms) * 1e-3;
            let goes_on_s = from_s + f64::from(still_ms) * 1e-3;
            let signal = |at: usize, t_s: f64, noise: f64| {
                if (from_s..goes_on_s).contains(&t_s) {
                    0.0
                } else {
                    15.0 * libm::sin(2.0 * PI * 3.0 * t_s + at as f64) + 120.0 * noise
                }
            };
            assert_eq!(ward.estimates(150, signal), GOOD, "{still_ms}");
            assert_eq!(ward.changes, 0, "{from_ms} {still_ms}");
        }
    }

    #[test]
    fn a_smooth_surface_makes_none_dead() {
        for level in [0.1, 0.6, 3.0] {
            let mut ward = Ward::new();
            let verdicts = ward.estimates(1_000, |gauge, t_s, noise| {
                level * (noise + libm::sin(2.0 * PI * 20.0 * t_s + gauge as f64))
                    + 700.3 * (gauge as f64 - 2.0)
            });
            assert_eq!(verdicts, GOOD, "at {level}");
            assert_eq!(ward.changes, 0, "at {level}");
        }
    }

    #[test]
    fn codes_that_do_not_change_at_rest_are_no_fault() {
        // The codes of one gauge lie at an edge and flicker, the others' do not.
        let mut ward = Ward::new();
        let rest = |gauge: usize, _: f64, noise: f64| {
            700.0 * (gauge as f64 - 2.0) + if gauge == 2 { 0.5 } else { 0.0 } + 0.3 * noise
        };
        assert_eq!(ward.estimates(500, rest), GOOD);
        // Rubbing and rest in turn.
        for _ in 0..5 {
            assert_eq!(ward.estimates(100, texture), GOOD);
            assert_eq!(ward.estimates(100, rest), GOOD);
        }
        assert_eq!(ward.changes, 0);
    }

    #[test]
    fn a_noisy_gauge_at_rest_does_not_make_the_quiet_ones_dead() {
        // Codes that flicker are a measure; where none does, there is nothing to call it noisy by.
        for (quiet, noisy) in [(0.7, GaugeHealth::Noisy), (0.1, GaugeHealth::Good)] {
            let mut ward = Ward::new();
            let verdicts = ward.estimates(500, |gauge, _, noise| {
                noise * if gauge == 3 { 1_000.0 } else { quiet }
            });
            let mut want = GOOD;
            want[3] = noisy;
            assert_eq!(verdicts, want);
        }
    }

    #[test]
    fn a_push_on_one_gauge_does_not_make_small_ones_dead() {
        // A step of 1 500 is in the power for a while, 2.2e6; 1e-4 of it is more than 10²/2.
        let mut ward = Ward::new();
        ward.estimates(200, |gauge, t_s, noise| 0.05 * texture(gauge, t_s, noise));
        ward.estimates(200, |gauge, t_s, noise| {
            0.05 * texture(gauge, t_s, noise) + if gauge == 1 { 1_500.0 } else { 0.0 }
        });
        assert_eq!(ward.changes, 0);
    }

    #[test]
    fn whatever_number_of_gauges_is_left_is_judged_by_its_own_measure() {
        for alive in 0..=ALL {
            for allowed in [ALL, alive] {
                // Those that are not alive have no amplifier: a code that is not at mid-rail.
                let mut ward = Ward::new();
                ward.signs.allowed = allowed;
                ward.estimates(300, |gauge, t_s, noise| {
                    if alive >> gauge & 1 == 1 {
                        texture(gauge, t_s, noise)
                    } else {
                        -500.0
                    }
                });
                let want = if alive == 0 { ALL } else { alive };
                // Nobody is there to tell a dead gauge by if all are.
                assert_eq!(ward.health.good(), want, "{alive:05b} of {allowed:05b}");
            }
        }
    }

    #[test]
    fn gauges_that_are_not_allowed_are_no_measure() {
        let mut ward = Ward::new();
        ward.signs.allowed = 0b00101;
        // The others are inputs that hang in the air and hum.
        ward.estimates(300, |gauge, t_s, noise| match gauge {
            0 => 0.02 * texture(gauge, t_s, noise),
            2 => 0.03 * texture(gauge, t_s, noise),
            _ => 1_900.0 * libm::sin(2.0 * PI * 50.0 * t_s),
        });
        assert_eq!(ward.health.good() & 0b00101, 0b00101);
        assert_eq!(ward.changes, 0);
    }

    #[test]
    fn a_gauge_that_comes_and_goes_stays_out() {
        let mut ward = Ward::new();
        ward.estimates(100, texture);
        ward.changes = 0;
        // At the ends for 50 ms in every 200 ms.
        for _ in 0..50 {
            ward.estimates(5, but(2, |_, _| 2_040.0));
            ward.estimates(15, texture);
        }
        assert_eq!(ward.health.verdicts()[2], GaugeHealth::Saturated);
        assert_eq!(ward.changes, 1);
    }

    #[test]
    fn a_gauge_that_does_not_fit_is_blamed_after_three_tenths_of_a_second_as_long_as_that_lasts() {
        let mut ward = Ward::new();
        ward.signs.agreed = true;
        ward.estimates(100, texture);
        // One that fits now and then is not.
        for _ in 0..10 {
            ward.signs.misfits = 0b01000;
            ward.estimates(29, texture);
            ward.signs.misfits = 0;
            ward.estimates(1, texture);
        }
        assert_eq!(ward.changes, 0);
        ward.signs.misfits = 0b01000;
        assert_eq!(ward.until(3, GaugeHealth::Noisy, texture), 30);
        // Nothing is learned while nothing is agreed on.
        ward.signs.agreed = false;
        ward.signs.misfits = 0;
        ward.estimates(200, texture);
        assert_eq!(ward.health.good(), 0b10111);
        ward.signs.agreed = true;
        assert_eq!(ward.until(3, GaugeHealth::Good, texture), 51);
    }

    #[test]
    fn silent_gauges_are_no_measure_of_what_noise_is_too_much_for_the_others() {
        // All but two, and all but one, fall silent but for a step of their amplifier's noise.
        for last in [1, 2] {
            let mut ward = Ward::new();
            ward.estimates(200, texture);
            for _ in 0..1_000 {
                let verdicts = ward.estimate(&|gauge, t_s, noise| {
                    if gauge < GAUGES - last {
                        noise * libm::sqrt(3.0)
                    } else {
                        texture(gauge, t_s, noise)
                    }
                });
                assert_eq!(verdicts[GAUGES - last..], GOOD[..last]);
            }
        }
    }

    #[test]
    fn gauges_that_feel_nothing_for_noise_are_told_by_those_that_do_even_if_these_are_fewer() {
        let mut ward = Ward::new();
        let verdicts = ward.estimates(500, |gauge, t_s, noise| {
            if gauge < 3 {
                1_900.0 * noise
            } else {
                texture(gauge, t_s, noise)
            }
        });
        let [noisy, good] = [GaugeHealth::Noisy, GaugeHealth::Good];
        assert_eq!(verdicts, [noisy, noisy, noisy, good, good]);
    }

    #[test]
    fn a_gauge_that_does_not_fit_because_it_is_silent_is_called_dead() {
        let mut ward = Ward::new();
        ward.signs.agreed = true;
        ward.estimates(200, texture);
        ward.signs.misfits = 0b00100;
        // Its mean over 0.3 s is at mid-rail before it does not fit for 0.3 s.
        let dead = but(2, |_, noise| noise * libm::sqrt(3.0));
        assert_eq!(ward.until(2, GaugeHealth::Dead, dead), 30);
    }

    #[test]
    fn a_texture_whose_crests_come_to_touch_the_ends_is_not_taken_for_a_contact_that_bounces() {
        let pressed = |by: f64| {
            move |gauge: usize, t_s: f64, noise: f64| {
                let offset = 100.0 * (gauge as f64 - 2.0);
                by * (texture(gauge, t_s, noise) - offset) + offset
            }
        };
        let mut touched = false;
        let mut ward = Ward::new();
        for _ in 0..5 {
            assert_eq!(ward.estimates(100, pressed(1.0)), GOOD);
            assert_eq!(ward.estimates(100, pressed(9.0)), GOOD);
            touched |= ward.health.gauges[2].at_rails > 0.01;
        }
        assert!(touched);
        assert_eq!(ward.changes, 0);
    }

    #[test]
    fn where_most_gauges_jump_to_an_end_all_are_off_until_a_tenth_of_a_second_after_it() {
        let mut ward = Ward::new();
        ward.estimates(200, texture);
        ward.estimates(1, |gauge, t_s, noise| {
            if gauge < 3 {
                2_040.0
            } else {
                texture(gauge, t_s, noise)
            }
        });
        assert_eq!(ward.health.believed(), 0);
        ward.estimates(13, texture);
        assert_eq!(ward.health.believed(), ALL);
        // A minority is off alone, and for longer.
        ward.estimates(100, texture);
        ward.estimates(1, but(2, |_, _| 2_040.0));
        assert_eq!(ward.health.believed(), 0b11011);
        ward.estimates(50, texture);
        assert_eq!(ward.health.believed(), 0b11011);
        ward.estimates(1, texture);
        assert_eq!(ward.health.believed(), ALL);
    }

    #[test]
    fn a_gauge_on_another_surface_is_not_blamed_until_a_fingertip_has_passed() {
        let mut ward = Ward::new();
        ward.signs.agreed = true;
        ward.estimates(100, texture);
        // At 2 mm/s a fingertip of 6 mm is across a boundary for 3 s.
        ward.signs.travel_mm = 0.02;
        ward.signs.misfits = 0b11000;
        ward.estimates(300, texture);
        ward.signs.misfits = 0;
        ward.estimates(1, texture);
        ward.signs.misfits = 0b11000;
        ward.estimates(300, texture);
        assert_eq!(ward.changes, 0);
        // At rest it is not known any better.
        ward.signs.travel_mm = 0.0;
        ward.estimates(1_000, texture);
        assert_eq!(ward.changes, 0);
        ward.signs.travel_mm = 0.02;
        ward.estimates(210, texture);
        assert_eq!(ward.health.good(), 0b00111);
    }

    #[test]
    fn hum_of_its_own_is_a_fault_from_half_the_typical_power_on() {
        let mut ward = Ward::new();
        ward.estimates(200, texture);
        // The median of the gauges' powers: gain 0.9 of 185, and noise.
        let typical = 166.5 * 166.5 / 2.0 + 25.0 * 25.0 / 4.0;
        ward.signs.hum[1] = 0.45 * typical;
        assert_eq!(ward.estimates(100, texture), GOOD);
        ward.signs.hum[1] = 0.55 * typical;
        assert_eq!(ward.until(1, GaugeHealth::Hum, texture), 1);
    }
}
