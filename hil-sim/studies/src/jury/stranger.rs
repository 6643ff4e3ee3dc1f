//! Surfaces that the simulator has not made: drawn at random, from distributions that are stated here.
//!
//! Nothing of the simulator's plant is used: texture, friction, motion, gauges and noise are written anew
//! in the files beside this one. The distributions are what tactile sensing meets, not what an estimator
//! likes; each quantity is drawn for itself, so that a few trials have all troubles at once.
//!
//! A trial has a period with a probability of 0.7.
//!
//! | class | what |
//! | --- | --- |
//! | sine | |
//! | trapezoid | duty 0.15–0.85, flanks 0.03–0.15 λ |
//! | smooth ridges | exp(κ cos φ), κ 0.5–6, log-uniform |
//! | harmonics | second and third, 0–1.2 of the fundamental each, phases at random |
//! | two waves | the weaker 0.3–0.7 of the stronger, 1.25–2.9 times as long or as short; λ is the stronger's |
//! | weave | second harmonic 0–0.6; heights vary by σ 5–30 %; a random part of 0.2–0.8 always |
//!
//! | of surfaces with a period | how often | range |
//! | --- | --- | --- |
//! | λ | always | 0.7–7 mm, log-uniform |
//! | worn ridges | 0.35 | 2–30 % of them, left with 0 (one in two) or 0–0.7 of their height |
//! | jitter of places | 0.5 | σ 0–4 % of λ; in half of them a shift moves all that follow |
//! | gradient of λ | 0.35 | 0–1 %/mm at the steepest, up and down in 40–200 mm; the truth is the local λ |
//! | second specimen | 0.15 | another λ, at least 1.25 times longer or shorter; level 0.6–1.6, step ± 2 |
//! | curved track | 0.2 | 5–30° at most, in 80–250 mm; the truth is λ/cos |
//!
//! λ with gradient and curve stays within 0.6–8 mm.
//!
//! | of all | how often | range |
//! | --- | --- | --- |
//! | random part | 0.5 | RMS 0–1.5 of the signal; falls below 0.2–4 mm; 0–1 of it common to the gauges |
//! | form | 0.3 | RMS 0–3 of the signal; falls steeply below 12–40 mm; 0.7–1 of it common to the gauges |
//! | contact | always | a Gaussian 0.1–0.3 mm wide at half height |
//!
//! | without a period | what |
//! | --- | --- |
//! | flat | noise only |
//! | slope | a parabola of 2–6 signal levels over the way |
//! | random surface | 1/k in power, 0.1–50 mm |
//! | narrow band | a band of 15–60 % of its centre, 0.7–7 mm: looks periodic for a few waves |
//! | bumps | at random, 4–20 mm apart as a mean, σ 0.15–1.5 mm |
//! | steps | at random, 2–15 mm apart as a mean |
//! | hum only | flat, hum of 0.3–2 of the level |
//!
//! Flat surfaces have neither random part nor form.
//!
//! The hand's distributions are [`Hand`]'s, the gauges' are [`Pickup`]'s, those of a force channel [`Force`]'s.

use firmware_sensor::{SCANS_PER_SAMPLE, Scan};

use super::counts::Partials;
use super::dice::Dice;
use super::force::Force;
use super::ground::{
    Bend, Ground, POLES, Plain, Ridges, Second, Specimen, Texture, Waveform, greatest_angle,
};
use super::hand::{Hand, Path, Stroke};
use super::pickup::{GAUGES, Pickup};

/// Share of trials whose surface has a period.
const WITH_A_PERIOD: f64 = 0.7;
/// A ground reaches this far beyond the outermost gauge, in mm.
const MARGIN_MM: f64 = 1.0;
const STREAM_OF_DRAWS: u64 = 1;
const STREAM_OF_MOTION: u64 = 2;
const STREAM_OF_GROUND: u64 = 3;
const STREAM_OF_GAUGES: u64 = 4;
const STREAM_OF_FORM: u64 = 5;
const STREAM_OF_FORCE: u64 = 6;
const STREAM_OF_FORCE_NOISE: u64 = 7;

/// What kind of surface a trial has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// [`Waveform::Sine`]
    Sine,
    /// [`Waveform::Trapezoid`]
    Trapezoid,
    /// [`Waveform::Smooth`]
    Smooth,
    /// [`Waveform::Harmonics`]
    Harmonics,
    /// [`Waveform::TwoWaves`]
    TwoWaves,
    /// [`Waveform::Weave`]
    Weave,
    /// [`Plain::Flat`]
    Flat,
    /// [`Plain::Slope`]
    Slope,
    /// [`Plain::Random`]
    Random,
    /// [`Plain::NarrowBand`]
    NarrowBand,
    /// [`Plain::Bumps`]
    Bumps,
    /// [`Plain::Steps`]
    Steps,
    /// [`Plain::Flat`] with mains hum.
    HumOnly,
}

impl Class {
    /// Those with a period.
    pub const PERIODIC: [Self; 6] = [
        Self::Sine,
        Self::Trapezoid,
        Self::Smooth,
        Self::Harmonics,
        Self::TwoWaves,
        Self::Weave,
    ];
    /// Those without.
    pub const PLAIN: [Self; 7] = [
        Self::Flat,
        Self::Slope,
        Self::Random,
        Self::NarrowBand,
        Self::Bumps,
        Self::Steps,
        Self::HumOnly,
    ];

    /// For tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sine => "sine",
            Self::Trapezoid => "trapezoid",
            Self::Smooth => "smooth ridges",
            Self::Harmonics => "harmonics",
            Self::TwoWaves => "two waves",
            Self::Weave => "weave",
            Self::Flat => "flat",
            Self::Slope => "slope",
            Self::Random => "random surface",
            Self::NarrowBand => "narrow band",
            Self::Bumps => "bumps",
            Self::Steps => "steps",
            Self::HumOnly => "hum only",
        }
    }

    /// Whether its surfaces have a period.
    pub fn has_a_period(self) -> bool {
        Self::PERIODIC.contains(&self)
    }
}

/// A surface, a hand and a fingertip, as one seed has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    /// Of the surface.
    pub class: Class,
    /// Of everything.
    pub seed: u64,
    /// What is rubbed.
    pub ground: Ground,
    /// How it is rubbed.
    pub hand: Hand,
    /// What is felt of it.
    pub pickup: Pickup,
    /// Its force channel, if it has one.
    pub force: Option<Force>,
}

/// What a sensor board is given in a trial, and the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// ADC codes of each ms, 4 kHz; without a force channel it rests at mid-rail.
    pub scans: Vec<[Scan; SCANS_PER_SAMPLE]>,
    /// Counts of 5 µm at the end of each ms, wrapping.
    pub encoder: Vec<u16>,
    /// λ under the fingertip's middle at the end of each ms; 0 where the surface has no period.
    pub truth_mm: Vec<f32>,
    /// The arm's speed in each ms, with its sign.
    pub speed_mm_s: Vec<f32>,
    /// Travel since the first motion, or since the last gauge passed a boundary between specimens, if that
    /// was later; 0 while one is under the gauges.
    pub travelled_mm: Vec<f32>,
    /// RMS of the surface's signal at unit gain, in ADC steps.
    pub signal_rms: f64,
    /// The partials of its wave, if there is one and no other.
    pub partials: Option<Partials>,
}

impl Trial {
    /// What this seed means.
    pub fn draw(seed: u64) -> Self {
        let dice = &mut Dice::new(seed, STREAM_OF_DRAWS);
        let class = if dice.chance(WITH_A_PERIOD) {
            Class::PERIODIC[dice.below(Class::PERIODIC.len())]
        } else {
            Class::PLAIN[dice.below(Class::PLAIN.len())]
        };
        let first = specimen(class, dice);
        let second = second(&first, dice);
        let texture = texture(class, dice);
        let contact_mm = dice.between(0.1, 0.3);
        let mut ground = Ground {
            first,
            second,
            texture,
            form: form(class, &mut Dice::new(seed, STREAM_OF_FORM)),
            bend: None,
            contact_mm,
        };
        ground.bend = bend(&ground, dice);
        let hand = Hand::draw(dice, ground.longest_mm());
        let mut pickup = Pickup::draw(dice);
        if class == Class::HumOnly {
            pickup.hum = dice.between(0.3, 2.0);
        }
        if let Specimen::Ridged(Ridges {
            waveform: Waveform::TwoWaves { ratio, .. },
            wavelength_mm,
            ..
        }) = ground.first
        {
            // A resonance that made the weaker wave the stronger one would change the truth. From twice
            // its frequency on, the resonance adds a third.
            let shorter_mm = wavelength_mm * ratio.min(1.0);
            let highest_hz = hand.fastest_mm_s() / shorter_mm;
            pickup.resonance_hz = pickup.resonance_hz.max(2.0 * highest_hz);
        }
        Self {
            class,
            seed,
            ground,
            hand,
            pickup,
            force: None,
        }
    }

    /// The same with a force channel.
    pub fn with_force_channel(self) -> Self {
        let dice = &mut Dice::new(self.seed, STREAM_OF_FORCE);
        Self {
            force: Some(Force::draw(self.hand.slider.as_ref(), dice)),
            ..self
        }
    }

    /// Plays it.
    pub fn record(&self) -> Record {
        let motion = &mut Dice::new(self.seed, STREAM_OF_MOTION);
        let path = self.hand.path(motion);
        let encoder = self.hand.encoder.counts(&path.arm_mm, motion);
        let profile = self.profile(&path);
        let gauges = &mut Dice::new(self.seed, STREAM_OF_GAUGES);
        let (mut scans, signal_rms) = self.pickup.scans(&profile, &path, gauges);
        if let Some(force) = &self.force {
            let dice = &mut Dice::new(self.seed, STREAM_OF_FORCE_NOISE);
            force.read(&mut scans, &path, &profile, dice);
        }
        let ends = || (SCANS_PER_SAMPLE - 1..path.foot_mm.len()).step_by(SCANS_PER_SAMPLE);
        let places = self.pickup.gauges.map(|gauge| gauge.place_mm);
        let (rear_mm, front_mm) = (
            places.iter().copied().fold(0.0, f64::min),
            places.iter().copied().fold(0.0, f64::max),
        );
        let (mut travelled_mm, mut before_mm) = (0.0, 0.0);
        let (mut truth_mm, mut speed_mm_s, mut travels_mm) = (vec![], vec![], vec![]);
        for end in ends() {
            let (foot_mm, arm_mm) = (path.foot_mm[end], path.arm_mm[end]);
            let moved_mm = arm_mm - before_mm;
            before_mm = arm_mm;
            travelled_mm += moved_mm.abs();
            if profile.boundary_mm.is_some_and(|boundary_mm| {
                (foot_mm + rear_mm..=foot_mm + front_mm).contains(&boundary_mm)
            }) {
                travelled_mm = 0.0;
            }
            truth_mm.push(profile.wavelength_mm(foot_mm));
            speed_mm_s.push((moved_mm * 1e3) as f32);
            travels_mm.push(travelled_mm as f32);
        }
        Record {
            scans,
            encoder,
            truth_mm,
            speed_mm_s,
            travelled_mm: travels_mm,
            signal_rms,
            partials: self.ground.partials(),
        }
    }

    /// Whatever makes this trial hard, and how it is rubbed: for tables.
    pub fn traits(&self) -> Vec<&'static str> {
        let mut traits = vec![match self.hand.stroke {
            Stroke::Constant { .. } => "constant speed",
            Stroke::Sinusoid { .. } => "sinusoid",
            Stroke::Reaches { .. } => "reaches",
        }];
        traits.push(match self.pickup.snr_db {
            snr_db if snr_db < 0.0 => "SNR below 0 dB",
            snr_db if snr_db < 10.0 => "SNR 0–10 dB",
            snr_db if snr_db < 20.0 => "SNR 10–20 dB",
            _ => "SNR above 20 dB",
        });
        if let Specimen::Ridged(ridges) = &self.ground.first {
            traits.push(match ridges.wavelength_mm {
                mm if mm < 1.5 => "λ below 1.5 mm",
                mm if mm < 3.0 => "λ 1.5–3 mm",
                _ => "λ above 3 mm",
            });
            let drawn = [
                (ridges.worn > 0.0, "worn"),
                (
                    ridges.jitter > 0.0 && ridges.accumulates,
                    "jitter, accumulating",
                ),
                (ridges.jitter > 0.0 && !ridges.accumulates, "jitter"),
                (ridges.gradient > 0.0, "gradient"),
            ];
            traits.extend(drawn.iter().filter(|drawn| drawn.0).map(|drawn| drawn.1));
        }
        let random = self.ground.texture.map_or(0.0, |texture| texture.share);
        let drawn = [
            (self.ground.second.is_some(), "two specimens"),
            (self.ground.bend.is_some(), "curved track"),
            (random > 0.0 && random <= 0.5, "random part to 0.5"),
            (random > 0.5 && random <= 1.0, "random part 0.5–1"),
            (random > 1.0, "random part above 1"),
            (self.ground.form.is_some(), "form"),
            (self.pickup.noise_corner_hz > 0.0, "noise with a corner"),
            (self.pickup.pink > 0.0, "1/f noise"),
            (self.pickup.hum > 0.0, "hum"),
            (self.pickup.drift > 0.0, "drift"),
            (self.pickup.swing + self.pickup.tilt > 0.0, "force swings"),
            (self.pickup.friction > 0.0, "friction's step"),
            (self.hand.hysteresis_mm > 0.0, "hysteresis"),
            (self.hand.slider.is_some(), "stick and slip"),
            (self.hand.tremor > 0.0, "tremor"),
            (self.hand.encoder.missed > 0.0, "missed counts"),
        ];
        traits.extend(drawn.iter().filter(|drawn| drawn.0).map(|drawn| drawn.1));
        if let Some(force) = &self.force {
            let drawn = [
                (force.told_n_per_m == 0, "stiffness not told"),
                (force.told_n_per_m > 0, "stiffness told"),
                (force.noise_n > 0.004, "force's noise above 4 mN"),
                (force.crosstalk_n > 0.0, "force's cross-talk"),
            ];
            traits.extend(drawn.iter().filter(|drawn| drawn.0).map(|drawn| drawn.1));
        }
        traits
    }

    fn profile(&self, path: &Path) -> super::ground::Profile {
        let places = self.pickup.gauges.map(|gauge| gauge.place_mm);
        let feet = &path.foot_mm;
        let least = |values: &[f64]| values.iter().copied().fold(f64::INFINITY, f64::min);
        let greatest = |values: &[f64]| values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let from_mm = least(feet) + least(&places).min(0.0) - MARGIN_MM;
        let to_mm = greatest(feet) + greatest(&places).max(0.0) + MARGIN_MM;
        let dice = &mut Dice::new(self.seed, STREAM_OF_GROUND);
        self.ground.lay(from_mm, to_mm, GAUGES, dice)
    }
}

fn specimen(class: Class, dice: &mut Dice) -> Specimen {
    match class {
        Class::Flat | Class::HumOnly => Specimen::Plain(Plain::Flat),
        Class::Slope => Specimen::Plain(Plain::Slope {
            rise: dice.between(2.0, 6.0) * dice.sign(),
            bend: dice.between(-2.0, 2.0),
        }),
        Class::Random => Specimen::Plain(Plain::Random),
        Class::NarrowBand => Specimen::Plain(Plain::NarrowBand {
            wavelength_mm: dice.log_between(0.7, 7.0),
            bandwidth: dice.between(0.15, 0.6),
        }),
        Class::Bumps => Specimen::Plain(Plain::Bumps {
            spacing_mm: dice.between(4.0, 20.0),
            width_mm: dice.log_between(0.15, 1.5),
        }),
        Class::Steps => Specimen::Plain(Plain::Steps {
            spacing_mm: dice.between(2.0, 15.0),
        }),
        periodic => {
            let waveform = waveform(periodic, dice);
            Specimen::Ridged(Ridges::draw(dice, waveform))
        }
    }
}

fn waveform(class: Class, dice: &mut Dice) -> Waveform {
    match class {
        Class::Trapezoid => Waveform::Trapezoid {
            duty: dice.between(0.15, 0.85),
            flank: dice.between(0.03, 0.15),
        },
        Class::Smooth => Waveform::Smooth {
            sharpness: dice.log_between(0.5, 6.0),
        },
        Class::Harmonics => Waveform::Harmonics {
            shares: [dice.between(0.0, 1.2), dice.between(0.0, 1.2)],
            phases: [dice.angle(), dice.angle()],
        },
        Class::TwoWaves => Waveform::two_waves(dice),
        Class::Weave => Waveform::Weave {
            second: dice.between(0.0, 0.6),
            phase: dice.angle(),
            uneven: dice.between(0.05, 0.3),
        },
        _ => Waveform::Sine,
    }
}

/// Beside ridges of any class but two waves, whose truth is doubtful enough, more ridges.
fn second(first: &Specimen, dice: &mut Dice) -> Option<Second> {
    /// The second λ over the first, or the other way round, at least.
    const APART: f64 = 1.25;
    let there = dice.chance(0.15);
    let Specimen::Ridged(first) = first else {
        return None;
    };
    if !there || matches!(first.waveform, Waveform::TwoWaves { .. }) {
        return None;
    }
    let kinds = [
        Class::Sine,
        Class::Trapezoid,
        Class::Smooth,
        Class::Harmonics,
    ];
    let waveform = waveform(kinds[dice.below(kinds.len())], dice);
    let ridges = loop {
        let ridges = Ridges::draw(dice, waveform);
        let ratio = ridges.wavelength_mm / first.wavelength_mm;
        if ratio.max(1.0 / ratio) >= APART {
            break ridges;
        }
    };
    Some(Second {
        ridges,
        place: dice.between(0.3, 0.7),
        level: dice.log_between(0.6, 1.6),
        step: dice.between(-2.0, 2.0),
    })
}

fn texture(class: Class, dice: &mut Dice) -> Option<Texture> {
    let share = dice.sometimes(0.5, 0.0, 1.5);
    let woven = dice.between(0.2, 0.8);
    let share = match class {
        Class::Weave => woven,
        // Their names say that there is nothing else.
        Class::Flat | Class::HumOnly => 0.0,
        _ => share,
    };
    let texture = Texture {
        share,
        common: dice.uniform(),
        corner_mm: dice.log_between(0.2, 4.0),
        poles: 1,
        longest_mm: 30.0,
    };
    (share > 0.0).then_some(texture)
}

fn form(class: Class, dice: &mut Dice) -> Option<Texture> {
    let form = Texture {
        share: dice.sometimes(0.3, 0.0, 3.0),
        common: dice.between(0.7, 1.0),
        corner_mm: dice.log_between(12.0, 40.0),
        poles: POLES,
        longest_mm: 200.0,
    };
    let flat = matches!(class, Class::Flat | Class::HumOnly);
    (form.share > 0.0 && !flat).then_some(form)
}

fn bend(ground: &Ground, dice: &mut Dice) -> Option<Bend> {
    let there = dice.chance(0.2);
    let longest_mm = ground.longest_mm();
    let bend = Bend {
        angle: dice
            .between(5.0, 30.0)
            .to_radians()
            .min(greatest_angle(longest_mm)),
        period_mm: dice.between(80.0, 250.0),
        phase: dice.angle(),
    };
    (there && longest_mm > 0.0).then_some(bend)
}
