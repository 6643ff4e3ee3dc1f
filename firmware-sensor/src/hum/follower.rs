//! One of the mains' two frequencies, followed in all gauges at once.
//!
//! An oscillator runs at the mains' frequency and, once it has found that, at its offset from nominal. What
//! each gauge holds of it is summed over an estimate's time (a block). Two things come of the blocks:
//!
//! - what is *found* at the frequency, hum or texture: a complex amplitude for each gauge, and the offset
//!   by which they turn together;
//! - what is *known* to be hum. That is what is taken out. It is what is found while the arm rests, or
//!   else what has been steady and common to the gauges. While the arm moves, only what all gauges say
//!   together of its phase, frequency and scale is believed, and little of that.
//!
//! Both are followed with the gains of a straight line's least squares through n blocks' phases, 4/n and
//! 6/n² for long n. A texture Δf away leaks by 4/n · 100 Hz / (2π Δf) into what is followed.

use core::f32::consts::PI;

use protocol::GAUGES;

use super::common::{Amplitudes, conjugate_product, is_common, power, square, sum, unit};
use super::own::Own;
use super::steady::Steady;
use crate::float::{larger, smaller, sqrt};
use crate::phasor::phasor;
use crate::{ESTIMATE_RATE_HZ, SAMPLE_RATE_HZ};

/// Samples that a difference is taken over, half a cycle of 50 Hz: offset, drift and the even harmonics of
/// 50 Hz are not in it.
pub(super) const DIFFERENCE_SAMPLES: usize = 10;
/// How far from nominal the mains are looked for, in Hz: 0.5, and some room to settle from.
const MOST_OFF_HZ: f32 = 0.7;
const BLOCK_S: f32 = 1.0 / ESTIMATE_RATE_HZ as f32;
/// 2⁻³² cycles in a cycle, in a radian, and a sample in a Hz.
const STEPS_PER_CYCLE: f32 = 4_294_967_296.0;
const STEPS_PER_RAD: f32 = STEPS_PER_CYCLE / (2.0 * PI);
const STEPS_PER_HZ: f32 = STEPS_PER_CYCLE / SAMPLE_RATE_HZ as f32;
/// One of the mains' frequencies, and what a block makes of it: for a frequency f, and their slopes for
/// each radian of π Δf / 100 Hz.
#[derive(Debug)]
pub(super) struct Mains {
    hz: u32,
    /// cot(π f / 100 Hz).
    cot: [f32; 2],
    /// sin(10 ω) / (10 sin ω), ω = 2π f / 1 000 Hz.
    image: [f32; 2],
}

/// The world's mains. Both lines are straight to 1e-4 within 0.7 Hz.
pub(super) const MAINS: [Mains; 2] = [
    Mains {
        hz: 50,
        cot: [0.0, -1.0],
        image: [0.0, -0.647_214],
    },
    Mains {
        hz: 60,
        cot: [-0.324_920, -1.105_573],
        image: [-0.159_670, -0.358_878],
    },
];

/// How long what is found is remembered, in blocks.
struct Memory {
    /// A plain mean is taken over so many at first, before the offset is looked for.
    first: f32,
    /// A block more adds so much to n.
    more: f32,
    /// The largest n.
    most: f32,
}

/// At rest there is nothing else. 0.7 Hz turn by 0.2 rad in the first blocks.
const AT_REST: Memory = Memory {
    first: 4.0,
    more: 1.0,
    most: 50.0,
};
/// In motion half of the time since the start is remembered: the first blocks, in which texture has leaked
/// most, are not. 0.7 Hz turn by half a radian in them.
const IN_MOTION: Memory = Memory {
    first: 12.0,
    more: 0.5,
    most: 100.0,
};
/// The largest n of what is known.
const KNOWN_BLOCKS: f32 = 300.0;
/// What is known counts for no more as a rest begins, or as it is found in motion.
const NEWLY_KNOWN_BLOCKS: f32 = 40.0;
/// What a rest has taught is not to be unlearned by fewer blocks in motion, which hold texture.
const AFTER_REST_BLOCKS: f32 = 200.0;
/// Blocks at rest until the texture has rung out, and until what is there is known for hum.
const RINGING_BLOCKS: u16 = 3;
pub(super) const RESTED_ESTIMATES: u16 = 20;
/// Memory of each gauge's amplitude beside known hum, which one's own hum shows in: 0.15 s.
const BESIDE: f32 = 1.0 / 15.0;
/// Memory of the scatter.
const SCATTER_BLOCKS: f32 = 30.0;
/// Power of what is found over that of what a mean of so much scatter would hold anyway.
const SIGNIFICANT: f32 = 3.0;
/// Hum of less power in a gauge is in nobody's way, in ADC steps².
const LEAST_POWER: f32 = 0.25;
/// How much hum may grow while the arm moves, and how little may be left of it until it was none, if
/// nobody has known it from a rest.
const MOST_SCALE: f32 = 1.15;
const LEAST_SCALE: f32 = 0.3;
/// Blocks for which an estimator remembers hum that has been taken out at last.
const REMEMBERED_BLOCKS: u8 = 15;
/// How near to the mains' frequency v/λ or its strong harmonics may come, in Hz, before they may be taken
/// for hum.
const NEAR_HZ: f32 = 2.0;
const HARMONICS: u8 = 3;
/// From this far away on, in Hz, they do no harm to what is known; the nearer they are, the longer is the
/// memory, so that they leak no more.
const CLEAR_HZ: f32 = 15.0;
/// No distance is told better than that: a memory of three hours.
const NEAREST_HZ: f32 = 0.005;

/// What is known of an estimate's time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    /// Bit g set: what is common is taken from gauge g.
    pub usable: u8,
    /// Estimates that the arm has rested for.
    pub resting: u16,
    /// The arm's speed in mm/s.
    pub speed_mm_s: f32,
    /// v/λ̂ in Hz, where λ̂ is stood by.
    pub texture_hz: Option<f32>,
}

/// What is known of one of the mains' frequencies.
#[derive(Clone, Debug)]
pub(super) struct Follower {
    mains: &'static Mains,
    /// Its frequency in 2⁻³² cycles a sample.
    nominal_per_sample: u32,
    off_hz: f32,
    phase: u32,
    phase_per_sample: u32,
    /// The block's sums so far.
    sums: Amplitudes,
    found: Amplitudes,
    /// n: how many blocks what is found, or known, counts for.
    blocks: f32,
    /// Mean of |block − found|², summed over the usable gauges.
    scatter: f32,
    steady: Steady,
    own: Own,
    known: Amplitudes,
    /// Of what is known, how much there is now; none if nothing is.
    scale: Option<f32>,
    /// Known from a rest.
    rested: bool,
    /// Blocks for which those who have felt the hum may still remember it.
    newly: u8,
}

impl Follower {
    /// One that knows nothing.
    pub fn new(mains: &'static Mains) -> Self {
        let nominal_per_sample = ((u64::from(mains.hz) << 32) / u64::from(SAMPLE_RATE_HZ)) as u32;
        Self {
            mains,
            nominal_per_sample,
            off_hz: 0.0,
            phase: 0,
            phase_per_sample: nominal_per_sample,
            sums: [[0.0; 2]; GAUGES],
            found: [[0.0; 2]; GAUGES],
            blocks: 0.0,
            scatter: 0.0,
            steady: Steady::default(),
            own: Own::default(),
            newly: 0,
            known: [[0.0; 2]; GAUGES],
            scale: None,
            rested: false,
        }
    }

    /// Takes a sample's differences over [`DIFFERENCE_SAMPLES`]; gives cos and sin of its phase.
    #[inline(always)]
    pub fn push(&mut self, differences: &[f32; GAUGES]) -> [f32; 2] {
        let [cos, sin] = phasor(self.phase);
        self.phase = self.phase.wrapping_add(self.phase_per_sample);
        for (sum, difference) in self.sums.iter_mut().zip(differences) {
            sum[0] += cos * difference;
            sum[1] -= sin * difference;
        }
        [cos, sin]
    }

    /// Makes of the block of `samples` what there is to be learned. `louder`: there is more at this
    /// frequency than at the other, which is not the mains' then.
    pub fn learn(&mut self, samples: u16, moment: &Moment, louder: bool) {
        if samples == 0 {
            return;
        }
        let block = self.block(samples);
        self.newly = self.newly.saturating_sub(1);
        match moment.resting {
            0 if self.scale.is_some() => self.track(&block, moment),
            0 => self.look(&block, moment, louder),
            // Still rings.
            1..RINGING_BLOCKS => {}
            resting => self.rest(&block, resting, moment.usable, louder),
        }
        let off_hz = moment.texture_hz.map(|hz| hz - self.frequency_hz());
        let near = moment.texture_hz.is_some_and(|hz| self.is_near(hz));
        self.own.learn(off_hz, near);
        self.phase_per_sample = self
            .nominal_per_sample
            .wrapping_add_signed((self.off_hz * STEPS_PER_HZ) as i32);
    }

    /// What is to be taken out of each gauge.
    pub fn hum(&self) -> Option<Amplitudes> {
        self.scale
            .map(|scale| self.known.map(|z| z.map(|part| scale * part)))
    }

    /// What is at the frequency, hum or not.
    pub fn found(&self) -> &Amplitudes {
        &self.found
    }

    /// The mains' frequency as far as it is known, in Hz.
    pub fn frequency_hz(&self) -> f32 {
        self.mains.hz as f32 + self.off_hz
    }

    /// Amplitude, in ADC steps, of what may be hum and is not decided on yet or has just been, and the
    /// time in s that it has been heard for.
    pub fn undecided(&self, usable: u8) -> (f32, f32) {
        let slow = self.steady.slow();
        let open = self.steady.is_open() || self.newly > 0;
        let lsb = if open && is_common(slow, usable) {
            sqrt(square(sum(slow, usable))) / usable.count_ones() as f32
        } else {
            0.0
        };
        (lsb, self.steady.heard_s())
    }

    /// Power of each gauge's own hum in ADC steps², beyond what the `usable` ones have in common.
    pub fn own_powers(&self, usable: u8, rests: bool) -> [f32; GAUGES] {
        self.own.powers(&self.found, usable, rests)
    }

    /// Whether a texture, or a strong harmonic of it, is where it may be taken for hum.
    fn is_near(&self, texture_hz: f32) -> bool {
        (1..=HARMONICS).any(|n| (f32::from(n) * texture_hz - self.frequency_hz()).abs() < NEAR_HZ)
    }

    /// How far from the mains' frequency a texture and its strong harmonics are, in Hz; a harmonic counts
    /// as being as many times further away as it is weaker.
    fn away_hz(&self, texture_hz: f32) -> f32 {
        let mut away_hz = f32::MAX;
        for n in 1..=HARMONICS {
            let n = f32::from(n);
            away_hz = smaller(away_hz, n * (n * texture_hz - self.frequency_hz()).abs());
        }
        away_hz
    }

    /// The gauges' mean amplitudes over the block, which begins anew.
    fn block(&mut self, samples: u16) -> Amplitudes {
        let off_rad = PI * self.off_hz / ESTIMATE_RATE_HZ as f32;
        let [cot, image] =
            [self.mains.cot, self.mains.image].map(|[at, slope]| at + slope * off_rad);
        // The mean of a signal's product with the oscillator over ten samples holds its image, the
        // conjugate turned by twice the phase in the middle.
        let image = if usize::from(samples) == DIFFERENCE_SAMPLES {
            // The middle is 5.5 samples back.
            let twice_back = self.phase_per_sample.wrapping_mul(11);
            let [cos, sin] = phasor(self.phase.wrapping_mul(2).wrapping_sub(twice_back));
            [image * cos, -image * sin]
        } else {
            [0.0; 2]
        };
        let share = 1.0 / (f32::from(samples) * (1.0 - square(image)));
        core::mem::replace(&mut self.sums, [[0.0; 2]; GAUGES]).map(|[re, im]| {
            let re_alone = share * (re - image[0] * re - image[1] * im);
            let im_alone = share * (im - image[1] * re + image[0] * im);
            // A difference over ten samples has 1 − e^(−jψ) of a signal, ψ = 2π f / 100 Hz, and its
            // product with the oscillator half of that: the inverse is 1 − j cot(ψ/2).
            [re_alone + cot * im_alone, im_alone - cot * re_alone]
        })
    }

    /// At rest nothing else than hum is there.
    fn rest(&mut self, block: &Amplitudes, resting: u16, usable: u8, louder: bool) {
        if resting == RINGING_BLOCKS {
            if let Some(hum) = self.hum() {
                self.found = hum;
                self.blocks = self.blocks.min(NEWLY_KNOWN_BLOCKS);
            } else {
                self.blocks = 0.0;
                self.off_hz = 0.0;
            }
        }
        self.find(block, usable, &AT_REST);
        let known = resting >= RESTED_ESTIMATES;
        self.steady.rest(known);
        if known {
            self.known = self.found;
            // What a gauge that is not usable has of its own may be gone when it is usable again.
            let mean =
                sum(&self.found, usable).map(|part| part / usable.count_ones().max(1) as f32);
            for (gauge, z) in self.known.iter_mut().enumerate() {
                if usable >> gauge & 1 == 0 {
                    *z = mean;
                }
            }
            self.scale = (louder && self.is_significant(usable)).then_some(1.0);
            self.rested = true;
        }
    }

    /// Looks for hum that is not known yet, in motion.
    fn look(&mut self, block: &Amplitudes, moment: &Moment, louder: bool) {
        let usable = moment.usable;
        self.find(block, usable, &IN_MOTION);
        let is_hum = self.steady.push(
            block,
            usable,
            least_power(usable),
            louder,
            moment.speed_mm_s,
        );
        if is_hum {
            // Gains stay and are those of a while; the phase is the latest.
            let unit_now = unit(sum(&self.found, usable));
            let before = unit(sum(self.steady.slow(), usable));
            self.known = self.steady.slow().map(|z| {
                let along = larger(conjugate_product(z, before)[0], 0.0);
                unit_now.map(|part| along * part)
            });
            self.scale = Some(1.0);
            self.rested = false;
            self.newly = REMEMBERED_BLOCKS;
            self.blocks = self.blocks.min(NEWLY_KNOWN_BLOCKS);
        }
    }

    /// Follows whatever there is.
    fn find(&mut self, block: &Amplitudes, usable: u8, memory: &Memory) {
        let first = self.blocks < memory.first;
        let more = if first { 1.0 } else { memory.more };
        self.blocks = smaller(self.blocks + more, memory.most);
        let (follow, turn) = if first {
            (1.0 / self.blocks, 0.0)
        } else {
            gains(self.blocks)
        };
        let (mut scatter, mut ahead, mut weight) = (0.0, 0.0, 0.0);
        for (gauge, (z, block)) in self.found.iter_mut().zip(block).enumerate() {
            let error = [block[0] - z[0], block[1] - z[1]];
            if usable >> gauge & 1 == 1 {
                scatter += error[0] * error[0] + error[1] * error[1];
                ahead += conjugate_product(error, *z)[1];
                weight += z[0] * z[0] + z[1] * z[1];
            }
            z[0] += follow * error[0];
            z[1] += follow * error[1];
        }
        self.scatter += (scatter - self.scatter) / smaller(self.blocks, SCATTER_BLOCKS);
        if weight > 0.0 {
            self.turn(turn, (ahead / weight).clamp(-1.0, 1.0));
        }
    }

    /// Follows known hum: its phase, its frequency and its scale, all gauges weighted by their gains.
    fn track(&mut self, block: &Amplitudes, moment: &Moment) {
        for (found, z) in self.found.iter_mut().zip(block) {
            found[0] += BESIDE * (z[0] - found[0]);
            found[1] += BESIDE * (z[1] - found[1]);
        }
        let (mut product, mut weight) = ([0.0; 2], 0.0);
        for (gauge, (z, block)) in self.known.iter().zip(block).enumerate() {
            if moment.usable >> gauge & 1 == 1 {
                let [re, im] = conjugate_product(*block, *z);
                product = [product[0] + re, product[1] + im];
                weight += z[0] * z[0] + z[1] * z[1];
            }
        }
        if weight <= 0.0 {
            return;
        }
        let least = if self.rested { AFTER_REST_BLOCKS } else { 0.0 };
        self.blocks = (self.blocks + IN_MOTION.more).clamp(least, KNOWN_BLOCKS);
        let mut n = self.blocks;
        if let Some(hz) = moment.texture_hz.filter(|_| self.rested) {
            let away_hz = larger(self.away_hz(hz), NEAREST_HZ);
            n = larger(n, KNOWN_BLOCKS * CLEAR_HZ / away_hz);
        }
        let (follow, turn) = gains(n);
        // Texture that passes may be many times the hum: no block counts for more than the hum itself.
        let ahead = (product[1] / weight).clamp(-1.0, 1.0);
        self.phase = self
            .phase
            .wrapping_add_signed((follow * ahead * STEPS_PER_RAD) as i32);
        self.turn(turn, ahead);
        if let Some(scale) = &mut self.scale {
            let more = (product[0] / weight - *scale).clamp(-1.0, 1.0);
            *scale = (*scale + follow * more).clamp(0.0, MOST_SCALE);
            if !self.rested && *scale < LEAST_SCALE {
                self.scale = None;
                self.blocks = self.blocks.min(IN_MOTION.most);
            }
        }
        if !self.rested {
            self.refine(block, moment, 0.25 * follow);
        }
    }

    /// Follows the gauges' gains for hum that was found in motion. They do not change: a mean's gain will
    /// do, a quarter of a line's.
    fn refine(&mut self, block: &Amplitudes, moment: &Moment, follow: f32) {
        let unit = unit(sum(&self.known, moment.usable));
        // A texture as near as that is in phase with the hum, here more and there less. Gains that are
        // all the same do it least harm.
        let near = moment
            .texture_hz
            .is_some_and(|hz| (hz - self.frequency_hz()).abs() < NEAR_HZ);
        let mean = conjugate_product(sum(block, moment.usable), unit)[0]
            / moment.usable.count_ones() as f32;
        for (z, block) in self.known.iter_mut().zip(block) {
            let along = if near {
                mean
            } else {
                conjugate_product(*block, unit)[0]
            };
            z[0] += follow * (along * unit[0] - z[0]);
            z[1] += follow * (along * unit[1] - z[1]);
        }
    }

    /// Takes a share `turn` of a block's being ahead into the frequency.
    fn turn(&mut self, turn: f32, ahead_rad: f32) {
        let ahead_hz = ahead_rad / (2.0 * PI * BLOCK_S);
        let off_hz = (self.off_hz + turn * ahead_hz).clamp(-MOST_OFF_HZ, MOST_OFF_HZ);
        // Block and difference lie half a block back each. What has been followed so far is as much
        // behind as a wrong frequency makes in a block, and the oscillator goes there.
        let forward = (off_hz - self.off_hz) * BLOCK_S;
        self.phase = self
            .phase
            .wrapping_add_signed((forward * STEPS_PER_CYCLE) as i32);
        self.off_hz = off_hz;
    }

    /// Whether what is found stands out of what chance would leave.
    fn is_significant(&self, usable: u8) -> bool {
        let chance = SIGNIFICANT * 4.0 / larger(self.blocks, 1.0) * self.scatter;
        power(&self.found, usable) > larger(chance, least_power(usable))
    }
}

/// The power below which hum is in nobody's way, as a sum of |z|² over the usable gauges.
fn least_power(usable: u8) -> f32 {
    2.0 * LEAST_POWER * usable.count_ones() as f32
}

/// Gains of a block's amplitude (or phase) and of its turn.
fn gains(n: f32) -> (f32, f32) {
    let pairs = n * (n + 1.0);
    ((4.0 * n - 2.0) / pairs, 6.0 / pairs)
}
