//! A fingertip that is not the simulator's: volts at the ADC pins from a synthesis of its own.
//!
//! Nothing here is shared with the simulator's surface, gauges or slider, and most is different: ridges
//! narrower than their grooves, other gains (one negative), places and phases, another level of the
//! signal, a resonance integrated step by step, 1/f noise from dice (Voss and McCartney), and a slider
//! with other mass, spring and friction, whose rest is a dead band of velocity (Karnopp 1985).

use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use hil_sim_core::scene::Scene;

const GAUGES: usize = 5;
const GAINS: [f64; GAUGES] = [0.7, -1.2, 0.5, 1.0, 0.85];
const PLACES_MM: [f64; GAUGES] = [-2.4, -0.8, 0.3, 1.7, 2.9];
const PHASES_RAD: [f64; GAUGES] = [1.9, -2.3, 0.2, 2.8, -1.1];
/// Rest of each gauge away from mid-rail, relative to the fundamental at unit gain.
const OFFSETS: [f64; GAUGES] = [5.0, -3.0, 0.5, -5.0, 2.0];
/// With an offset of 5 and noise at 0 dB a gauge comes to 1.65 ± 1.6 V: nothing clips.
const VOLTS_PER_UNIT: f64 = 0.12;
const MID_RAIL_V: f64 = 1.65;
/// Rows per second that recordings have: the least that a scene may, and a row for every scan.
pub const RECORDED_HZ: [usize; 2] = [1_000, 4_000];
const STEPS_PER_S: usize = 20_000;
const STEP_S: f64 = 1.0 / STEPS_PER_S as f64;
const RESONANCE_HZ: f64 = 180.0;
const RESONANCE_DAMPING: f64 = 0.15;
const PINK: f64 = 0.1;
const DRIFT: f64 = 0.2;
const DRIFT_HZ: f64 = 0.11;

/// The slider's stiffness, in N/m.
pub const STIFFNESS_N_PER_M: f64 = 320.0;
const MASS_KG: f64 = 0.006;
const DAMPING_N_S_PER_M: f64 = 0.25;
const NORMAL_N: f64 = 0.5;
const KINETIC: f64 = 0.5;
const STRIBECK_M_S: f64 = 0.015;
/// Slower than this is rest, in m/s.
const REST_M_S: f64 = 2e-4;
/// Steps of the slider in a step.
const SLIDES: usize = 5;
const NEWTON_PER_V: f64 = 0.5;
/// In 0–500 Hz, in N.
const FORCE_NOISE_N: f64 = 0.003;

/// A fingertip that rubs, and how it is recorded.
pub struct Stranger {
    /// λ in mm, and from which place on, in mm, in rising order.
    pub surface: Vec<(f64, f64)>,
    /// Where the arm is, in mm; 0 at t = 0.
    pub arm_mm: fn(f64) -> f64,
    /// Static friction; none for a fingertip that goes with the arm.
    pub friction: Option<f64>,
    /// Whether the force is recorded, too.
    pub force: bool,
    /// The fundamental at unit gain over the white noise in 0–500 Hz, in dB.
    pub snr_db: f64,
    /// Rows per second in the file.
    pub rows_per_s: usize,
    /// How many rows earlier than at the scene's instants the rows lie, 0 to 1: the scans then fall between them.
    pub rows_early: f64,
    /// What follows in the scene.
    pub rest_of_scene: &'static str,
    /// In s.
    pub duration_s: f64,
    /// Where the dice begin.
    pub seed: u64,
}

impl Default for Stranger {
    fn default() -> Self {
        Self {
            surface: vec![(2.0, 0.0)],
            arm_mm: |t_s| 50.0 * t_s,
            friction: None,
            force: false,
            snr_db: 20.0,
            rows_per_s: RECORDED_HZ[1],
            rows_early: 0.0,
            rest_of_scene: "",
            duration_s: 8.0,
            seed: 1,
        }
    }
}

impl Stranger {
    /// Writes gauges, motion and scene into a folder of that name, which is emptied, and loads it.
    pub fn scene(&self, name: &str) -> Scene {
        Scene::load(&self.write(name)).unwrap()
    }

    fn write(&self, name: &str) -> PathBuf {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
            .join("stranger")
            .join(name);
        fs::remove_dir_all(&folder).ok();
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("gauges.csv"), self.gauges_csv()).unwrap();
        fs::write(folder.join("motion.csv"), self.motion_csv()).unwrap();
        let path = folder.join(format!("{name}.toml"));
        fs::write(&path, self.toml()).unwrap();
        path
    }

    fn toml(&self) -> String {
        let mut specimens = String::new();
        for (index, (wavelength_mm, from_mm)) in self.surface.iter().enumerate() {
            write!(specimens, "{{ wavelength_mm = {wavelength_mm:?}").unwrap();
            if let Some((_, to_mm)) = self.surface.get(index + 1) {
                write!(specimens, ", length_mm = {:?}", to_mm - from_mm).unwrap();
            }
            specimens.push_str(" }, ");
        }
        let force = if self.force {
            format!(
                "tangential_n_per_v = {NEWTON_PER_V:?}\nstiffness_n_per_m = {STIFFNESS_N_PER_M:?}\n"
            )
        } else {
            String::new()
        };
        format!(
            "duration_s = {:?}\n\n[surface]\nspecimens = [{specimens}]\n\n[motion]\nkind = \"recorded\"\n\
             file = \"motion.csv\"\n\n[gauges]\nkind = \"recorded\"\nfile = \"gauges.csv\"\n{force}\n{}",
            self.duration_s, self.rest_of_scene
        )
    }

    fn motion_csv(&self) -> String {
        let mut csv = "t_s,x_mm\n".to_owned();
        // Straight lines of 1 ms, from the encoder as from the gauges.
        for ms in 0..=(self.duration_s * 1e3) as usize + 1 {
            let t_s = ms as f64 * 1e-3;
            writeln!(csv, "{t_s:.3},{:.6}", (self.arm_mm)(t_s)).unwrap();
        }
        csv
    }

    fn gauges_csv(&self) -> String {
        let mut dice = Dice(self.seed);
        let mut pink: [Pink; GAUGES] = std::array::from_fn(|_| Pink::new(&mut dice));
        let mut rings = [Ring::default(); GAUGES];
        let mut slider = Slider::default();
        let fundamental = fundamental();
        let in_band = 0.5 * 10f64.powf(-self.snr_db / 10.0);
        let widening = self.rows_per_s as f64 / 1_000.0;
        let noise = (in_band * widening).sqrt();
        let force_noise_n = FORCE_NOISE_N * widening.sqrt();
        let mut csv = "t_s,g0,g1,g2,g3,g4".to_owned();
        csv.push_str(if self.force { ",tangential\n" } else { "\n" });
        let steps_per_row = STEPS_PER_S / self.rows_per_s;
        let early_s = self.rows_early / self.rows_per_s as f64;
        for step in 0..=(self.duration_s * STEPS_PER_S as f64) as usize + steps_per_row {
            let t_s = step as f64 * STEP_S;
            let arm_mm = (self.arm_mm)(t_s);
            let stretch_mm = match self.friction {
                Some(friction) => slider.follow(arm_mm, friction),
                None => 0.0,
            };
            let row = step.is_multiple_of(steps_per_row);
            if row {
                write!(csv, "{:.6}", t_s - early_s).unwrap();
            }
            if step.is_multiple_of(STEPS_PER_S / 1_000) {
                for pink in &mut pink {
                    pink.roll(step / (STEPS_PER_S / 1_000), &mut dice);
                }
            }
            for gauge in 0..GAUGES {
                let phase = self.phase(arm_mm - stretch_mm + PLACES_MM[gauge]);
                let texture = GAINS[gauge] * ridges(phase + PHASES_RAD[gauge]) / fundamental;
                let rung = rings[gauge].step(texture);
                if row {
                    let drift = DRIFT * (TAU * DRIFT_HZ * t_s + 1.3 * gauge as f64).sin();
                    let felt = rung + OFFSETS[gauge] + drift + PINK * pink[gauge].value();
                    let volts = MID_RAIL_V + VOLTS_PER_UNIT * (felt + noise * dice.gaussian());
                    assert!(
                        (0.0..3.3).contains(&volts),
                        "{volts} V: the synthesis clips"
                    );
                    write!(csv, ",{volts:.6}").unwrap();
                }
            }
            if row && self.force {
                let newton =
                    STIFFNESS_N_PER_M * stretch_mm * 1e-3 + force_noise_n * dice.gaussian();
                write!(csv, ",{:.6}", MID_RAIL_V + newton / NEWTON_PER_V).unwrap();
            }
            if row {
                csv.push('\n');
            }
        }
        csv
    }

    /// The surface's phase at a place, in rad; it goes on where one specimen meets the next.
    fn phase(&self, x_mm: f64) -> f64 {
        let mut phase = 0.0;
        let mut specimens = self.surface.iter().peekable();
        while let Some(&(wavelength_mm, from_mm)) = specimens.next() {
            let end_mm = specimens.peek().map_or(f64::INFINITY, |next| next.1);
            let here_mm = x_mm.min(end_mm);
            phase += TAU * (here_mm - from_mm) / wavelength_mm;
            if x_mm < end_mm {
                break;
            }
        }
        phase
    }
}

/// Rounded ridges, narrower than the grooves between them.
fn ridges(phase: f64) -> f64 {
    (1.8 * phase.sin() - 0.5).tanh()
}

/// Amplitude of the ridges' fundamental.
fn fundamental() -> f64 {
    let count = 1_000;
    let sum: f64 = (0..count)
        .map(|i| TAU * f64::from(i) / f64::from(count))
        .map(|phase| ridges(phase) * phase.sin())
        .sum();
    2.0 * sum / f64::from(count)
}

/// The sensor's resonance: velocity first, then place.
#[derive(Clone, Copy, Default)]
struct Ring {
    place: f64,
    velocity: f64,
}

impl Ring {
    fn step(&mut self, push: f64) -> f64 {
        let omega = TAU * RESONANCE_HZ;
        let pull = omega * omega * (push - self.place);
        self.velocity += STEP_S * (pull - 2.0 * RESONANCE_DAMPING * omega * self.velocity);
        self.place += STEP_S * self.velocity;
        self.place
    }
}

/// A mass on a spring that an arm pulls over something sticky.
#[derive(Clone, Copy, Default)]
struct Slider {
    place_m: f64,
    velocity_m_s: f64,
    arm_m: f64,
}

impl Slider {
    /// How far the mass is behind the arm, in mm, a step later.
    fn follow(&mut self, arm_mm: f64, friction: f64) -> f64 {
        let slide_s = STEP_S / SLIDES as f64;
        let from_m = self.arm_m;
        self.arm_m = arm_mm * 1e-3;
        let arm_m_s = (self.arm_m - from_m) / STEP_S;
        for slide in 1..=SLIDES {
            let arm_m = from_m + arm_m_s * slide_s * slide as f64;
            let pull_n = STIFFNESS_N_PER_M * (arm_m - self.place_m)
                + DAMPING_N_S_PER_M * (arm_m_s - self.velocity_m_s);
            let speed_m_s = self.velocity_m_s.abs();
            if speed_m_s < REST_M_S && pull_n.abs() <= friction * NORMAL_N {
                self.velocity_m_s = 0.0;
                continue;
            }
            let direction = if speed_m_s < REST_M_S {
                pull_n.signum()
            } else {
                self.velocity_m_s.signum()
            };
            let share = (-speed_m_s / STRIBECK_M_S).exp();
            let resistance_n = NORMAL_N * (KINETIC + (friction - KINETIC) * share);
            self.velocity_m_s += slide_s * (pull_n - direction * resistance_n) / MASS_KG;
            self.place_m += slide_s * self.velocity_m_s;
        }
        (self.arm_m - self.place_m) * 1e3
    }
}

/// 1/f noise: twelve dice, the k-th of which is rolled every 2ᵏ ms, and their sum.
struct Pink([f64; Pink::DICE]);

impl Pink {
    const DICE: usize = 12;

    fn new(dice: &mut Dice) -> Self {
        Self(std::array::from_fn(|_| dice.gaussian()))
    }

    fn roll(&mut self, ms: usize, dice: &mut Dice) {
        for (octave, value) in self.0.iter_mut().enumerate() {
            if ms.is_multiple_of(1 << octave) {
                *value = dice.gaussian();
            }
        }
    }

    /// With variance 1.
    fn value(&self) -> f64 {
        self.0.iter().sum::<f64>() / (Self::DICE as f64).sqrt()
    }
}

/// SplitMix64 (Steele, Lea and Flood 2014).
struct Dice(u64);

impl Dice {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Box and Muller's.
    fn gaussian(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }
}
