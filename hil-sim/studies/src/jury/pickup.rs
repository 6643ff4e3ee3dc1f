//! What strangers' gauges make of what they meet: resonance, gains, force, and every kind of noise.

use std::f64::consts::{PI, TAU};

use firmware_sensor::{MID_RAIL_CODE, SCANS_PER_SAMPLE, Scan};

use super::dice::Dice;
use super::ground::Profile;
use super::hand::{Path, SCANS_PER_S};

/// Gauges of a fingertip.
pub const GAUGES: usize = 5;
const SCAN_S: f64 = 1.0 / SCANS_PER_S as f64;
const HIGHEST_CODE: f32 = 4_095.0;
/// Furthest from mid-rail that amplifiers are set up for, in ADC steps.
const ROOM: f64 = 2_000.0;
/// The band in which the signal-to-noise ratio counts noise, in Hz.
const NOISE_BAND_HZ: f64 = 500.0;
/// Dice of the 1/f noise: octaves from 500 Hz down to 0.25 Hz.
const OCTAVES: usize = 11;

/// One gauge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gauge {
    /// Of the texture; either sign.
    pub gain: f64,
    /// Ahead of the fingertip's middle, in mm.
    pub place_mm: f64,
    /// Of the mains hum, over the trial's.
    pub hum_gain: f64,
    /// Of the friction's step, either sign, over the trial's.
    pub friction_gain: f64,
    /// Its rest, away from mid-rail, in ADC steps.
    pub offset: f64,
    /// Its own resonance over the trial's.
    pub tuning: f64,
    /// Where its drift begins, in rad.
    pub drift_phase: f64,
}

/// A fingertip's gauges, their amplifiers and what they pick up.
///
/// "Signal" is the RMS of the surface's profile, without its random part, at unit gain.
///
/// | what | how often | range |
/// | --- | --- | --- |
/// | signal | always | 20–600 ADC steps, log-uniform; less where it would clip |
/// | gains | always | 0.3–1.5, log-uniform, either sign |
/// | places | always | −3 to 3 mm, each for itself: so the phases come |
/// | white noise | always | −5 to 40 dB below the signal, counted in 0–500 Hz |
/// | its corner, one pole | 0.4 | 200–1 500 Hz, log-uniform; else white to the last |
/// | 1/f noise | 0.5 | 0–0.3 of the signal, 0.25–500 Hz |
/// | mains hum | 0.3 | 50 or 60 Hz, ± 0.5 Hz; RMS 0–2 of the signal; one phase; gains 0.6–1.4 |
/// | resonance | always | 100–400 Hz, ± 5 % from gauge to gauge; damping 0.1–0.7 |
/// | drift | 0.5 | RMS 0–2 of the signal, 0.02–0.2 Hz |
/// | offset | always | ± 300 ADC steps |
/// | swing of force | 0.5 | 0–50 %: part slow (0.1–0.7 Hz), part with the place in the stroke |
/// | friction's step at reversals | 0.5 | 0–2 of the signal, gains −1 to 1 |
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pickup {
    /// The gauges.
    pub gauges: [Gauge; GAUGES],
    /// RMS of the signal at unit gain, in ADC steps, if that doesn't clip.
    pub level: f64,
    /// Of the signal over the white noise in 0–500 Hz, in dB.
    pub snr_db: f64,
    /// Where the white noise falls off, in Hz; 0 where it doesn't.
    pub noise_corner_hz: f64,
    /// RMS of the 1/f noise over the signal's.
    pub pink: f64,
    /// Frequency of the mains, in Hz.
    pub hum_hz: f64,
    /// RMS of the hum over the signal's.
    pub hum: f64,
    /// In Hz.
    pub resonance_hz: f64,
    /// Over the critical.
    pub damping: f64,
    /// RMS of the drift over the signal's.
    pub drift: f64,
    /// In Hz.
    pub drift_hz: f64,
    /// Share of the force that swings slowly.
    pub swing: f64,
    /// How fast, in Hz.
    pub swing_hz: f64,
    /// Share of the force that goes with the place in the stroke.
    pub tilt: f64,
    /// Friction's step over the signal's RMS.
    pub friction: f64,
}

impl Pickup {
    /// Draws a fingertip.
    pub fn draw(dice: &mut Dice) -> Self {
        let gauges = std::array::from_fn(|_| Gauge {
            gain: dice.log_between(0.3, 1.5) * dice.sign(),
            place_mm: dice.between(-3.0, 3.0),
            hum_gain: dice.between(0.6, 1.4),
            friction_gain: dice.between(-1.0, 1.0),
            offset: dice.between(-300.0, 300.0),
            tuning: dice.between(0.95, 1.05),
            drift_phase: dice.angle(),
        });
        let mains_hz = if dice.chance(0.5) { 50.0 } else { 60.0 };
        let force = dice.sometimes(0.5, 0.0, 0.5);
        let slow = dice.uniform();
        Self {
            gauges,
            level: dice.log_between(20.0, 600.0),
            snr_db: dice.between(-5.0, 40.0),
            noise_corner_hz: {
                let hz = dice.log_between(200.0, 1_500.0);
                if dice.chance(0.4) { hz } else { 0.0 }
            },
            pink: dice.sometimes(0.5, 0.0, 0.3),
            hum_hz: mains_hz + dice.between(-0.5, 0.5),
            hum: dice.sometimes(0.3, 0.0, 2.0),
            resonance_hz: dice.log_between(100.0, 400.0),
            damping: dice.between(0.1, 0.7),
            drift: dice.sometimes(0.5, 0.0, 2.0),
            drift_hz: dice.log_between(0.02, 0.2),
            swing: force * slow,
            swing_hz: dice.between(0.1, 0.7),
            tilt: force * (1.0 - slow),
            friction: dice.sometimes(0.5, 0.0, 2.0),
        }
    }

    /// RMS of the white noise in all frequencies over the signal's.
    fn noise(&self) -> f64 {
        let in_band = libm::pow(10.0, -self.snr_db / 20.0);
        in_band / libm::sqrt(self.share_in_band())
    }

    /// Share of the noise's power that lies in 0–500 Hz.
    fn share_in_band(&self) -> f64 {
        const BINS: usize = 256;
        let nyquist_hz = 0.5 * SCANS_PER_S as f64;
        let keep = self.noise_keep();
        let (mut inside, mut all) = (0.0, 0.0);
        for bin in 0..BINS {
            let hz = nyquist_hz * (bin as f64 + 0.5) / BINS as f64;
            let cosine = libm::cos(PI * hz / nyquist_hz);
            let power = 1.0 / (1.0 - 2.0 * keep * cosine + keep * keep);
            all += power;
            if hz < NOISE_BAND_HZ {
                inside += power;
            }
        }
        inside / all
    }

    fn noise_keep(&self) -> f64 {
        if self.noise_corner_hz > 0.0 {
            libm::exp(-TAU * self.noise_corner_hz * SCAN_S)
        } else {
            0.0
        }
    }

    /// The signal's RMS at unit gain in ADC steps: the drawn one, or what the rails leave.
    ///
    /// The furthest from mid-rail is taken to be the profile's peak and 4 σ of each noise, together.
    pub fn signal_rms(&self, profile_peak: f64) -> f64 {
        let furthest = self.gauges.iter().map(|gauge| {
            let felt = profile_peak * (1.0 + self.swing + self.tilt);
            let sines = libm::sqrt(2.0) * (self.hum * gauge.hum_gain + self.drift);
            let chance = libm::sqrt(self.noise() * self.noise() + self.pink * self.pink);
            let reach = (felt * gauge.gain).abs()
                + (self.friction * gauge.friction_gain).abs()
                + sines
                + 4.0 * chance;
            reach / (ROOM - gauge.offset.abs())
        });
        let worst = furthest.fold(0.0, f64::max);
        self.level.min(1.0 / worst.max(1e-9))
    }

    /// The scans of a motion over a profile, and the signal's RMS in them at unit gain.
    pub fn scans(
        &self,
        profile: &Profile,
        path: &Path,
        dice: &mut Dice,
    ) -> (Vec<[Scan; SCANS_PER_SAMPLE]>, f64) {
        let level = self.signal_rms(f64::from(profile.peak()));
        let noise_keep = self.noise_keep();
        let noise_push = (level * self.noise() * libm::sqrt(1.0 - noise_keep * noise_keep)) as f32;
        let noise_keep = noise_keep as f32;
        let mut lanes: [Lane; GAUGES] = std::array::from_fn(|gauge| {
            let this = &self.gauges[gauge];
            Lane {
                ring: Ring::new(self.resonance_hz * this.tuning, self.damping),
                pink: Pink::new(dice),
                white: dice.gaussian() as f32 * (level * self.noise()) as f32,
                drift: Turn::new(self.drift_hz, this.drift_phase, 1_000.0),
                code: (level * this.gain) as f32,
                hum_code: (level * self.hum * this.hum_gain * libm::sqrt(2.0)) as f32,
                drift_code: (level * self.drift * libm::sqrt(2.0)) as f32,
                pink_code: (level * self.pink) as f32,
                friction_code: (level * self.friction * this.friction_gain) as f32,
                rest: f32::from(MID_RAIL_CODE) + this.offset as f32,
            }
        });
        let mut hum = Turn::new(self.hum_hz, dice.angle(), SCANS_PER_S as f64);
        let mut swing = Turn::new(self.swing_hz, dice.angle(), 1_000.0);
        let middle_mm = 0.5 * (least(&path.foot_mm) + greatest(&path.foot_mm));
        let reach_mm = (greatest(&path.foot_mm) - middle_mm).max(1.0);
        let tilt = self.tilt * dice.sign() / reach_mm;
        let scans = path
            .foot_mm
            .chunks_exact(SCANS_PER_SAMPLE)
            .zip(path.drag.chunks_exact(SCANS_PER_SAMPLE))
            .enumerate()
            .map(|(ms, (feet_mm, drags))| {
                let slow = (self.swing * swing.next()) as f32;
                let steady: [f32; GAUGES] = std::array::from_fn(|gauge| {
                    let lane = &mut lanes[gauge];
                    lane.pink.roll(ms, dice);
                    lane.rest
                        + lane.drift_code * lane.drift.next() as f32
                        + lane.pink_code * lane.pink.value()
                });
                std::array::from_fn(|scan| {
                    let foot_mm = feet_mm[scan];
                    let force = 1.0 + slow + (tilt * (foot_mm - middle_mm)) as f32;
                    let mains = hum.next() as f32;
                    let mut codes = [MID_RAIL_CODE; GAUGES + 1];
                    for gauge in 0..GAUGES {
                        let lane = &mut lanes[gauge];
                        let height = profile.height(gauge, foot_mm + self.gauges[gauge].place_mm);
                        let push = lane.code * force * height + lane.friction_code * drags[scan];
                        if noise_push > 0.0 {
                            lane.white =
                                noise_keep * lane.white + noise_push * dice.gaussian() as f32;
                        }
                        let code = steady[gauge]
                            + lane.ring.step(push)
                            + lane.hum_code * mains
                            + lane.white;
                        codes[gauge] = (code.clamp(0.0, HIGHEST_CODE) + 0.5) as u16;
                    }
                    codes
                })
            })
            .collect();
        (scans, level)
    }
}

/// One gauge's state, its parts in ADC steps.
struct Lane {
    ring: Ring,
    pink: Pink,
    white: f32,
    drift: Turn,
    code: f32,
    hum_code: f32,
    drift_code: f32,
    pink_code: f32,
    friction_code: f32,
    rest: f32,
}

/// A resonance with the gain 1 at rest: ω²/(s² + 2ζω s + ω²) by the bilinear transform, bent to be right
/// at the resonance.
struct Ring {
    input: f32,
    old: [f32; 2],
    state: Option<[f32; 2]>,
}

impl Ring {
    fn new(hz: f64, damping: f64) -> Self {
        let bent = libm::tan(PI * hz * SCAN_S);
        let norm = 1.0 / (1.0 + 2.0 * damping * bent + bent * bent);
        Self {
            input: (bent * bent * norm) as f32,
            old: [
                (2.0 * (bent * bent - 1.0) * norm) as f32,
                ((1.0 - 2.0 * damping * bent + bent * bent) * norm) as f32,
            ],
            state: None,
        }
    }

    /// Settled on its first input.
    #[inline]
    fn step(&mut self, x: f32) -> f32 {
        let [first, second] = self.state.unwrap_or_else(|| {
            // At rest y = x: what the states then are.
            let second = x * (self.input - self.old[1]);
            [second + x * (2.0 * self.input - self.old[0]), second]
        });
        let y = self.input * x + first;
        self.state = Some([
            2.0 * self.input * x - self.old[0] * y + second,
            self.input * x - self.old[1] * y,
        ]);
        y
    }
}

/// A sine, a step at a time.
struct Turn {
    sine: f64,
    cosine: f64,
    step: (f64, f64),
}

impl Turn {
    fn new(hz: f64, phase: f64, steps_per_s: f64) -> Self {
        let (sine, cosine) = libm::sincos(phase);
        Self {
            sine,
            cosine,
            step: libm::sincos(TAU * hz / steps_per_s),
        }
    }

    #[inline]
    fn next(&mut self) -> f64 {
        let value = self.sine;
        let (sine, cosine) = self.step;
        (self.sine, self.cosine) = (
            self.sine * cosine + self.cosine * sine,
            self.cosine * cosine - self.sine * sine,
        );
        value
    }
}

/// 1/f noise of variance 1: dice, of which the k-th is rolled every 2ᵏ⁺¹ ms, one a ms (Voss and
/// McCartney, in Gardner 1978 and Whittle 1999).
struct Pink {
    dice: [f32; OCTAVES],
    sum: f32,
}

impl Pink {
    fn new(dice: &mut Dice) -> Self {
        let dice: [f32; OCTAVES] = std::array::from_fn(|_| dice.gaussian() as f32);
        Self {
            dice,
            sum: dice.iter().sum(),
        }
    }

    fn roll(&mut self, ms: usize, dice: &mut Dice) {
        let octave = (ms.trailing_zeros() as usize).min(OCTAVES - 1);
        self.dice[octave] = dice.gaussian() as f32;
        self.sum = self.dice.iter().sum();
    }

    fn value(&self) -> f32 {
        const SCALE: f32 = 0.301_511_34; // 1/√OCTAVES
        self.sum * SCALE
    }
}

fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

fn greatest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}
