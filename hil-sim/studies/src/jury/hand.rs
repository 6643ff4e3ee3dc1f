//! How a stranger's arm moves: rest, then strokes, and what its encoder says of them.

use std::f64::consts::{PI, TAU};

use super::dice::Dice;

/// Scans per second, as the board's ADC has them.
pub const SCANS_PER_S: usize = 4_000;
const SCAN_S: f64 = 1.0 / SCANS_PER_S as f64;
/// Nobody rubs faster, in mm/s.
const FASTEST_MM_S: f64 = 150.0;
/// A stroke goes over this many waves at least: who rubs less does not feel a period either.
const WAVES_PER_STROKE: f64 = 4.0;
const MICROMETRES_PER_COUNT: f64 = 5.0;
/// Travel in which friction turns when the fingertip itself does not give way, in mm.
const STIFF_MM: f64 = 0.02;

/// How strokes follow one another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stroke {
    /// One long stroke: up to speed in `rise_s`, and on.
    Constant {
        /// In mm/s.
        speed_mm_s: f64,
        /// Time up to speed, in s.
        rise_s: f64,
    },
    /// Back and forth, each way half a sine of speed.
    Sinusoid {
        /// Strokes back and forth per second.
        hz: f64,
        /// From one turn to the other, in mm.
        length_mm: f64,
    },
    /// Back and forth by minimum-jerk reaches (Flash and Hogan 1985), with pauses at the turns.
    Reaches {
        /// From one turn to the other, in mm.
        length_mm: f64,
        /// Of one reach, in s.
        reach_s: f64,
        /// At a turn, in s.
        pause_s: f64,
    },
}

/// What the encoder adds to the truth. Its scale is right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder {
    /// Amplitude of an error that comes again with every turn of the pinion, in µm.
    pub eccentricity_um: f64,
    /// Travel of that turn, in mm.
    pub turn_mm: f64,
    /// RMS of noise ahead of the rounding to counts, in µm.
    pub dither_um: f64,
    /// Probability that a count is missed.
    pub missed: f64,
}

/// An arm's motion, and the fingertip that it drags along.
///
/// | what | how often | range |
/// | --- | --- | --- |
/// | duration | | 4–10 s |
/// | rest in front | | 0.3–0.6 s |
/// | constant speed | 0.3 | 10–80 mm/s, up to speed in 0.1–0.3 s |
/// | sinusoid | 0.35 | 0.3–2 Hz, 10–60 mm |
/// | reaches | 0.35 | 20–80 mm in 0.4–1.6 s each, pauses of 0–0.5 s |
/// | scatter of turns and times | always, in strokes | σ 0–5 % |
/// | tremor of speed | 0.5 | 0–15 % at 8–12 Hz |
/// | hysteresis | 0.5 | 0.05–0.5 mm |
/// | stick and slip | 0.15 | see [`Slider`]; takes the place of the hysteresis |
/// | eccentricity | 0.4 | 1–6 µm in 0.5–20 mm |
/// | dither | 0.4 | 0.5–3 µm |
/// | missed counts | 0.2 | 1 in 20 000 to 1 in 1 000 |
///
/// Strokes are lengthened to 4 λ where they are shorter, and slowed where they would be faster than
/// 150 mm/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// Of the whole trial, in s.
    pub duration_s: f64,
    /// Before the first motion, in s.
    pub rest_s: f64,
    /// How it strokes.
    pub stroke: Stroke,
    /// Standard deviation of turns, over the stroke's length, and of times, over themselves.
    pub scatter: f64,
    /// Amplitude of the tremor over the speed.
    pub tremor: f64,
    /// Of the tremor.
    pub tremor_hz: f64,
    /// How far the fingertip stays behind the arm once it slips, in mm; it turns with the direction.
    pub hysteresis_mm: f64,
    /// A fingertip that may stick and slip, if it is one.
    pub slider: Option<Slider>,
    /// What it is measured by.
    pub encoder: Encoder,
}

/// A mass on a spring that the arm pulls over the surface; its rest is a dead band of velocity (Karnopp
/// 1985), its friction falls with speed (Stribeck).
///
/// | what | range |
/// | --- | --- |
/// | mass | 3–8 g |
/// | stiffness | 250–600 N/m |
/// | damping | 0.1–0.4 N s/m |
/// | normal force | 0.3–0.8 N |
/// | kinetic friction | 0.4–0.7 |
/// | static over kinetic | 1.1–2 |
/// | Stribeck's speed | 10–30 mm/s |
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slider {
    /// In kg.
    pub mass_kg: f64,
    /// In N/m.
    pub stiffness_n_per_m: f64,
    /// In N s/m.
    pub damping_n_s_per_m: f64,
    /// In N.
    pub normal_n: f64,
    /// Kinetic friction's coefficient.
    pub kinetic: f64,
    /// Static friction's coefficient.
    pub rest: f64,
    /// In m/s.
    pub stribeck_m_s: f64,
}

impl Slider {
    /// Slower than this is rest, in m/s.
    const REST_M_S: f64 = 2e-4;
    /// Steps in a scan.
    const STEPS: usize = 5;

    fn draw(dice: &mut Dice) -> Self {
        let kinetic = dice.between(0.4, 0.7);
        Self {
            mass_kg: dice.between(0.003, 0.008),
            stiffness_n_per_m: dice.between(250.0, 600.0),
            damping_n_s_per_m: dice.between(0.1, 0.4),
            normal_n: dice.between(0.3, 0.8),
            kinetic,
            rest: kinetic * dice.between(1.1, 2.0),
            stribeck_m_s: dice.between(0.01, 0.03),
        }
    }

    /// Follows an arm that moves from `from_m` to `to_m` in a scan; place and velocity go on.
    fn follow(&self, from_m: f64, to_m: f64, place_m: &mut f64, velocity_m_s: &mut f64) {
        let step_s = SCAN_S / Self::STEPS as f64;
        let arm_m_s = (to_m - from_m) / SCAN_S;
        for step in 1..=Self::STEPS {
            let arm_m = from_m + arm_m_s * step_s * step as f64;
            let pull_n = self.stiffness_n_per_m * (arm_m - *place_m)
                + self.damping_n_s_per_m * (arm_m_s - *velocity_m_s);
            let speed_m_s = velocity_m_s.abs();
            if speed_m_s < Self::REST_M_S && pull_n.abs() <= self.rest * self.normal_n {
                *velocity_m_s = 0.0;
                continue;
            }
            let direction = if speed_m_s < Self::REST_M_S {
                pull_n.signum()
            } else {
                velocity_m_s.signum()
            };
            let share = libm::exp(-speed_m_s / self.stribeck_m_s);
            let friction_n = self.normal_n * (self.kinetic + (self.rest - self.kinetic) * share);
            *velocity_m_s += step_s * (pull_n - direction * friction_n) / self.mass_kg;
            *place_m += step_s * *velocity_m_s;
        }
    }
}

/// A motion, a scan at a time.
pub struct Path {
    /// Where the arm is, in mm; 0 at first.
    pub arm_mm: Vec<f64>,
    /// Where the fingertip is, in mm.
    pub foot_mm: Vec<f64>,
    /// Friction over its greatest: from −1 to 1, against the motion.
    pub drag: Vec<f32>,
}

impl Hand {
    /// Draws a hand for a surface whose longest wave is `wavelength_mm`; 0 where it has none.
    pub fn draw(dice: &mut Dice, wavelength_mm: f64) -> Self {
        let duration_s = dice.between(4.0, 10.0);
        let rest_s = dice.between(0.3, 0.6);
        let kind = dice.uniform();
        let constant = Stroke::Constant {
            speed_mm_s: dice.between(10.0, 80.0),
            rise_s: dice.between(0.1, 0.3),
        };
        let hz = dice.log_between(0.3, 2.0);
        let sine_mm = dice.between(10.0, 60.0);
        let reach_mm = dice.between(20.0, 80.0);
        let reach_s = dice.between(0.4, 1.6);
        let pause_s = dice.between(0.0, 0.5);
        let shortest_mm = WAVES_PER_STROKE * wavelength_mm;
        let stroke = if kind < 0.3 {
            constant
        } else if kind < 0.65 {
            let length_mm = sine_mm.max(shortest_mm);
            // Its peak is π · hz · length.
            Stroke::Sinusoid {
                hz: hz.min(FASTEST_MM_S / (PI * length_mm)),
                length_mm,
            }
        } else {
            let length_mm = reach_mm.max(shortest_mm);
            // Its peak is 15/8 of its mean.
            Stroke::Reaches {
                length_mm,
                reach_s: reach_s.max(1.875 * length_mm / FASTEST_MM_S),
                pause_s,
            }
        };
        Self {
            duration_s,
            rest_s,
            stroke,
            scatter: dice.between(0.0, 0.05),
            tremor: dice.sometimes(0.5, 0.0, 0.15),
            tremor_hz: dice.between(8.0, 12.0),
            hysteresis_mm: dice.sometimes(0.5, 0.05, 0.5),
            slider: {
                let slider = Slider::draw(dice);
                dice.chance(0.15).then_some(slider)
            },
            encoder: Encoder::draw(dice),
        }
    }

    /// The motion, from 0 on, for as many whole ms as the trial has.
    pub fn path(&self, dice: &mut Dice) -> Path {
        let scans = self.milliseconds() * (SCANS_PER_S / 1_000);
        let mut speed_mm_s = vec![0.0; scans];
        self.strokes(&mut speed_mm_s, dice);
        if self.tremor > 0.0 {
            let phase = dice.angle();
            for (scan, speed) in speed_mm_s.iter_mut().enumerate() {
                let turn = TAU * self.tremor_hz * SCAN_S * scan as f64 + phase;
                *speed *= 1.0 + self.tremor * libm::sin(turn);
            }
        }
        let mut path = Path {
            arm_mm: Vec::with_capacity(scans),
            foot_mm: Vec::with_capacity(scans),
            drag: Vec::with_capacity(scans),
        };
        let (mut arm_mm, mut drag) = (0.0, 0.0);
        let (mut place_m, mut velocity_m_s) = (0.0, 0.0);
        let soft_mm = self.hysteresis_mm.max(STIFF_MM);
        for speed in speed_mm_s {
            let step_mm = speed * SCAN_S;
            let before_mm: f64 = arm_mm;
            arm_mm += step_mm;
            // Dahl (1968): friction goes to its greatest with travel, not with time.
            let share = (step_mm.abs() / soft_mm).min(1.0);
            drag += share * (step_mm.signum() - drag);
            path.arm_mm.push(arm_mm);
            path.foot_mm.push(match &self.slider {
                Some(slider) => {
                    slider.follow(
                        before_mm * 1e-3,
                        arm_mm * 1e-3,
                        &mut place_m,
                        &mut velocity_m_s,
                    );
                    place_m * 1e3
                }
                None => arm_mm - self.hysteresis_mm * drag,
            });
            path.drag.push(drag as f32);
        }
        path
    }

    /// The fastest that it goes on purpose, in mm/s: tremor and scatter come on top.
    pub fn fastest_mm_s(&self) -> f64 {
        match self.stroke {
            Stroke::Constant { speed_mm_s, .. } => speed_mm_s,
            Stroke::Sinusoid { hz, length_mm } => PI * hz * length_mm,
            Stroke::Reaches {
                length_mm, reach_s, ..
            } => 1.875 * length_mm / reach_s,
        }
    }

    /// Whole ms of the trial.
    pub fn milliseconds(&self) -> usize {
        (self.duration_s * 1e3) as usize
    }

    fn strokes(&self, speed_mm_s: &mut [f64], dice: &mut Dice) {
        let mut at_s = self.rest_s;
        let end_s = self.duration_s;
        match self.stroke {
            Stroke::Constant {
                speed_mm_s: level,
                rise_s,
            } => {
                for (scan, speed) in speed_mm_s.iter_mut().enumerate() {
                    let share = ((scan as f64 * SCAN_S - at_s) / rise_s).clamp(0.0, 1.0);
                    *speed = level * share * share * (3.0 - 2.0 * share);
                }
            }
            Stroke::Sinusoid { hz, length_mm } => {
                let mut turns = Turns::new(length_mm, self.scatter, dice);
                while at_s < end_s {
                    let lasts_s = scattered(0.5 / hz, self.scatter, dice);
                    let mean = turns.next_mm(dice) / lasts_s;
                    let half_sine = |share: f64| mean * 0.5 * PI * libm::sin(PI * share);
                    lay(speed_mm_s, at_s, lasts_s, half_sine);
                    at_s += lasts_s;
                }
            }
            Stroke::Reaches {
                length_mm,
                reach_s,
                pause_s,
            } => {
                let mut turns = Turns::new(length_mm, self.scatter, dice);
                while at_s < end_s {
                    let lasts_s = scattered(reach_s, self.scatter, dice);
                    let mean = turns.next_mm(dice) / lasts_s;
                    let least_jerk = |share: f64| {
                        let rest = share * (1.0 - share);
                        mean * 30.0 * rest * rest
                    };
                    lay(speed_mm_s, at_s, lasts_s, least_jerk);
                    at_s += lasts_s + scattered(pause_s, self.scatter, dice);
                }
            }
        }
    }
}

impl Encoder {
    fn draw(dice: &mut Dice) -> Self {
        Self {
            eccentricity_um: dice.sometimes(0.4, 1.0, 6.0),
            turn_mm: dice.log_between(0.5, 20.0),
            dither_um: dice.sometimes(0.4, 0.5, 3.0),
            missed: dice.sometimes(0.2, 5e-5, 1e-3),
        }
    }

    /// The counter at the end of each ms of a motion, wrapping.
    pub fn counts(&self, arm_mm: &[f64], dice: &mut Dice) -> Vec<u16> {
        let start: u16 = (dice.uniform() * 65_536.0) as u16;
        let phase = dice.angle();
        let (mut seen, mut told) = (0_i64, 0_i64);
        arm_mm
            .chunks_exact(SCANS_PER_S / 1_000)
            .map(|scans| {
                let mm = scans[scans.len() - 1];
                let mut um = mm * 1e3;
                if self.eccentricity_um > 0.0 {
                    um += self.eccentricity_um * libm::sin(TAU * mm / self.turn_mm + phase);
                }
                if self.dither_um > 0.0 {
                    um += self.dither_um * dice.gaussian();
                }
                let now = libm::floor(um / MICROMETRES_PER_COUNT) as i64;
                let mut moved = now - seen;
                seen = now;
                if self.missed > 0.0 && dice.chance(self.missed * moved.unsigned_abs() as f64) {
                    moved -= moved.signum();
                }
                told += moved;
                start.wrapping_add(told as u16)
            })
            .collect()
    }
}

/// The places at which strokes turn: near the two ends, in turn.
struct Turns {
    length_mm: f64,
    scatter: f64,
    at_mm: f64,
    forth: bool,
    direction: f64,
}

impl Turns {
    fn new(length_mm: f64, scatter: f64, dice: &mut Dice) -> Self {
        Self {
            length_mm,
            scatter,
            at_mm: 0.0,
            forth: true,
            direction: dice.sign(),
        }
    }

    /// The next stroke, in mm, with its sign.
    fn next_mm(&mut self, dice: &mut Dice) -> f64 {
        let end_mm = if self.forth { self.length_mm } else { 0.0 };
        let to_mm = end_mm + self.length_mm * self.scatter * dice.gaussian();
        let stroke_mm = to_mm - self.at_mm;
        self.at_mm = to_mm;
        self.forth = !self.forth;
        self.direction * stroke_mm
    }
}

/// A time that scatters, but not to less than half.
fn scattered(s: f64, scatter: f64, dice: &mut Dice) -> f64 {
    s * (1.0 + scatter * dice.gaussian()).max(0.5)
}

/// Puts a stroke's speed, a function of its share done, where it belongs.
fn lay(speed_mm_s: &mut [f64], at_s: f64, lasts_s: f64, shape: impl Fn(f64) -> f64) {
    let first = libm::ceil(at_s / SCAN_S) as usize;
    let past = (libm::ceil((at_s + lasts_s) / SCAN_S) as usize).min(speed_mm_s.len());
    for (scan, speed) in speed_mm_s.iter_mut().enumerate().take(past).skip(first) {
        *speed = shape((scan as f64 * SCAN_S - at_s) / lasts_s);
    }
}
