//! Every kind of fault at random instants, on the two ELFs, counted.
//!
//! Many faults share a run, for its translation takes seconds: each has a window of its own. After one
//! that stops the display for good, the display and its converters lose their power and all that they
//! hold; after any other, a second passes in which the boards recover and tell their counters.
//!
//! ```text
//! boots, drives ── fault ── looked on ─┬─ power ── boots, drives ──┬─ fault ── …
//!                                      └─ recovers, tells counters ┘
//! ```

mod tally;

pub use tally::{Tally, unmet};

use protocol::{DisplayConfiguration, Message, Mode, Rendering};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use hil_sim_boards;
use hil_sim_boards::{ElfError, Firmwares};
use hil_sim_core::judge::fault::{Finding, finding};
use hil_sim_core::run::decoder::TimedMessage;
use hil_sim_core::scene::fault::catalogue::{Class, Lasts};
use hil_sim_core::scene::fault::{Fault, Kind, nanoseconds};
use hil_sim_core::scene::{Display, Irregularity, Motion, Scene, Specimen, Surface};

/// From power on until the stimulus can be driving, in s: of both boards, and of the display alone. A sensor that starts again
/// within its first third of a second is taken for late.
const STARTS_S: f64 = 0.4;
const RESTARTS_S: f64 = 0.15;
/// The boards tell their counters once a second; what has just been tried is not to be in those that tell
/// of the next.
const TELLS_S: f64 = 1.05;
/// An instant is drawn from so long: room for a hand that swings to be in motion.
const DRAWN_S: f64 = 0.6;
/// How long a hand that swings has been fast when a fault comes, in s, and how fast, of 1.
const IN_MOTION_S: f64 = 0.25;
const IN_MOTION: f64 = 0.5;
/// Runs are about so long, in s: the translation of the firmware at their start is then a small part.
const RUN_S: f64 = 60.0;
/// In turn along the surface, in mm: one wavelength, or two, so that an estimate that is out of date is wrong.
const PLAIN: [f64; 2] = [2.0; 2];
const VARIED: [f64; 2] = [2.0, 3.0];
/// The first piece of a surface, in the middle of what a swinging hand goes over, and all others, in mm.
const FIRST_MM: f64 = 13.0;
const PIECE_MM: f64 = 40.0;
/// The paper's hand (section V): 70 mm/s at most, 0.83 Hz.
const SWINGING: Motion = Motion::Sinusoid {
    amplitude_mm_s: 70.0,
    frequency_hz: 0.83,
};
const STEADY: Motion = Motion::Constant { speed_mm_s: 50.0 };

/// From here on a λ is another one.
const OFF: f64 = 0.1;

/// What is to be tried.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Which kinds.
    pub kinds: Vec<Kind>,
    /// How many times each.
    pub instants: usize,
    /// Decides the instants, and what the kinds leave to chance.
    pub seed: u64,
    /// How much of the surface the display plays.
    pub rendering: Rendering,
}

/// A run of many windows.
#[derive(Clone, Debug)]
pub struct Shift {
    /// What is run.
    pub scene: Scene,
    /// Which of the scene's faults are tried, and until when, in s; the others are the power between.
    pub tried: Vec<(usize, f64)>,
}

/// A fault that was tried.
#[derive(Clone, Debug)]
pub struct Trial {
    /// How the hand moved.
    pub motion: &'static str,
    /// How the actuators shared the stimulus.
    pub mode: &'static str,
    /// The run's name.
    pub scene: String,
    /// What became of it.
    pub finding: Finding,
    /// The first λ that the sensor stood by and no specimen has, if there is one.
    pub stray: Option<Stray>,
}

/// A λ that no specimen has. The campaign's scenes have no noise and no friction: without a fault there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stray {
    /// After the fault began, in ms.
    pub after_ms: f64,
    /// λ̂.
    pub wavelength_mm: f64,
}

impl Trial {
    /// What was not as it should be.
    pub fn unmet(&self) -> Vec<String> {
        let stray = self.stray.map(|stray| {
            format!(
                "stands by {:.2} mm, which no specimen has, at {:.2} ms",
                stray.wavelength_mm, stray.after_ms
            )
        });
        self.finding.unmet().into_iter().chain(stray).collect()
    }
}

/// The first one that is told from a fault on until `until_ns`, 10 % off all specimens or more.
fn stray(scene: &Scene, fault: &Fault, until_ns: u64, said: &[TimedMessage]) -> Option<Stray> {
    let from_ns = fault.begins_ns();
    let at_hand = said
        .iter()
        .filter(|said| (from_ns..until_ns).contains(&said.at_ns));
    let stood_by = at_hand.filter_map(|said| match said.message {
        Message::Estimate(estimate) if estimate.valid => {
            Some((said.at_ns, f64::from(estimate.wavelength_mm?)))
        }
        _ => None,
    });
    let specimens = &scene.surface.specimens;
    let is_stray = |mm: f64| {
        let is_its = |specimen: &Specimen| (mm / specimen.wavelength_mm - 1.0).abs() < OFF;
        !specimens.iter().any(is_its)
    };
    stood_by
        .map(|(at_ns, wavelength_mm)| Stray {
            after_ms: (at_ns - from_ns) as f64 * 1e-6,
            wavelength_mm,
        })
        .find(|stray| is_stray(stray.wavelength_mm))
}

impl Plan {
    /// The runs that try everything, a kind's instants spread evenly over moving and swinging hands,
    /// uniform and travelling.
    pub fn shifts(&self) -> Vec<Shift> {
        let variants = [
            (STEADY, Mode::Uniform, PLAIN),
            (SWINGING, Mode::Travelling, PLAIN),
            (STEADY, Mode::Travelling, VARIED),
            (SWINGING, Mode::Uniform, VARIED),
        ];
        let mut draws = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let mut shifts = Vec::new();
        for (variant, (motion, mode, wavelengths_mm)) in variants.into_iter().enumerate() {
            let mut open: Option<Shift> = None;
            for (place, &kind) in self.kinds.iter().enumerate() {
                let turns = (0..self.instants).filter(|turn| (turn + place) % 4 == variant);
                for _ in turns {
                    let shift = open.get_or_insert_with(|| {
                        self.shift(shifts.len(), motion.clone(), mode, wavelengths_mm)
                    });
                    shift.add(kind, &mut draws);
                    if shift.scene.duration_s >= RUN_S {
                        shifts.extend(open.take());
                    }
                }
            }
            shifts.extend(open);
        }
        shifts
    }

    fn shift(&self, number: usize, motion: Motion, mode: Mode, wavelengths_mm: [f64; 2]) -> Shift {
        let configuration = DisplayConfiguration {
            mode,
            rendering: self.rendering,
            ..DisplayConfiguration::DEFAULT
        };
        Shift {
            scene: Scene {
                name: format!("campaign-{number}"),
                seed: self.seed.wrapping_add(number as u64),
                duration_s: 0.0,
                motion,
                display: Display {
                    configuration,
                    ..Display::default()
                },
                surface: surface(wavelengths_mm, configuration.rendering),
                ..Scene::constant(wavelengths_mm[0], 50.0)
            },
            tried: Vec::new(),
        }
    }
}

/// Two wavelengths in turn, further than a run goes; for a rendering that plays more than the fundamental one, with all that
/// there is to play.
fn surface(wavelengths_mm: [f64; 2], rendering: Rendering) -> Surface {
    const PIECES: usize = 100;
    let piece = |number: usize| Specimen {
        wavelength_mm: wavelengths_mm[number % 2],
        length_mm: match number {
            0 => FIRST_MM,
            PIECES => f64::INFINITY,
            _ => PIECE_MM,
        },
    };
    let plain = Surface {
        irregularity: Irregularity::rich(rendering),
        ..Scene::constant(wavelengths_mm[0], 50.0).surface
    };
    // Short fits of a rich wave may be off for a moment beyond a boundary: then a λ that no specimen has is no fault's doing.
    if wavelengths_mm[0] == wavelengths_mm[1] || rendering != Rendering::Fundamental {
        return plain;
    }
    Surface {
        specimens: (0..=PIECES).map(piece).collect(),
        ..plain
    }
}

impl Shift {
    /// A window for a fault of `kind` at the end.
    fn add(&mut self, kind: Kind, draws: &mut Xoshiro256PlusPlus) {
        let scene = &mut self.scene;
        let before = self
            .tried
            .last()
            .map(|&(index, _)| scene.faults[index].kind);
        let from_s = scene.duration_s
            + match before {
                None => STARTS_S,
                // The encoder of an arm that was stopped before is not missed.
                Some(_) if kind.is_of_arm() => {
                    scene
                        .faults
                        .push(Fault::new(Kind::PowerCycle, scene.duration_s));
                    STARTS_S
                }
                Some(before) if before.row().class == Class::Stops => {
                    let mut power = Fault::new(Kind::PowerCycle, scene.duration_s);
                    power.values[0] = 0.0;
                    scene.faults.push(power);
                    RESTARTS_S
                }
                Some(_) => TELLS_S,
            };
        let mut at_s;
        loop {
            // Whole microseconds, that a scene's file can say it as it is.
            let after_s: f64 = draws.random_range(0.0..DRAWN_S);
            at_s = ((from_s + after_s) * 1e6).round() * 1e-6;
            let is_fast = |t_s| match scene.motion {
                Motion::Sinusoid { amplitude_mm_s, .. } => {
                    scene.motion.velocity_mm_s(t_s).abs() > IN_MOTION * amplitude_mm_s
                }
                _ => true,
            };
            if is_fast(at_s) && is_fast(at_s - IN_MOTION_S) {
                break;
            }
        }
        let mut fault = Fault::new(kind, at_s);
        for (value, key) in fault.values.iter_mut().zip(kind.row().keys) {
            if let Some((low, high)) = key.drawn {
                let drawn: f64 = draws.random_range(low..=high);
                *value = if key.whole { drawn.round() } else { drawn };
            }
        }
        let row = kind.row();
        scene.duration_s = ((at_s + row.watch_s) * 1e3).ceil() * 1e-3;
        // What a restart of its board ends is to be followed by driving again: counted from its beginning, as for good.
        let ends_itself = row.again_within_ms.is_some();
        if row.lasts == Lasts::ForGood && row.class != Class::Stops && !ends_itself {
            fault.for_s = Some(row.watch_s);
        }
        self.tried.push((scene.faults.len(), scene.duration_s));
        scene.faults.push(fault);
    }

    /// Runs it.
    pub fn run(&self, firmwares: &Firmwares) -> Result<Vec<Trial>, ElfError> {
        let (recording, _) = hil_sim_boards::run(&self.scene, firmwares)?;
        let tried = self.tried.iter().map(|&(index, until_s)| {
            let until_ns = nanoseconds(until_s);
            let fault = &self.scene.faults[index];
            (
                finding(&self.scene, index, until_ns, &recording),
                stray(&self.scene, fault, until_ns, &recording.signs.sensor),
            )
        });
        Ok(tried
            .map(|(finding, stray)| Trial {
                motion: match self.scene.motion {
                    Motion::Constant { .. } => "constant",
                    _ => "sinusoid",
                },
                mode: self.scene.display.configuration.mode.name(),
                scene: self.scene.name.clone(),
                finding,
                stray,
            })
            .collect())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use hil_sim_core::native;
    use protocol::Estimate;

    use super::*;

    fn plan() -> Plan {
        Plan {
            kinds: Kind::all().collect(),
            instants: 6,
            seed: 3,
            rendering: Rendering::Fundamental,
        }
    }

    #[test]
    fn every_kind_is_tried_so_many_times_in_a_window_of_its_own() {
        let mut tried: HashMap<Kind, usize> = HashMap::new();
        for shift in plan().shifts() {
            let faults = &shift.scene.faults;
            for &(index, until_s) in &shift.tried {
                let fault = &faults[index];
                *tried.entry(fault.kind).or_default() += 1;
                assert!(until_s >= fault.at_s + fault.kind.row().watch_s - 1e-9);
                let next = faults.get(index + 1);
                assert!(next.map_or(shift.scene.duration_s, |next| next.at_s) >= until_s);
                // What stops for good is ended by nothing but power.
                if fault.kind.row().class == Class::Stops {
                    assert!(next.is_none_or(|next| next.kind == Kind::PowerCycle));
                }
            }
        }
        assert_eq!(tried.len(), Kind::all().count());
        assert!(tried.values().all(|&times| times == 6));
    }

    #[test]
    fn what_is_to_drive_again_is_looked_on_until_it_has_to() {
        for shift in plan().shifts() {
            for &(index, until_s) in &shift.tried {
                let fault = &shift.scene.faults[index];
                let again_ms = fault.kind.row().again_within_ms.unwrap_or(0.0);
                let ends_s = fault.at_s + fault.for_s.unwrap_or(0.0);
                let due_s = ends_s + again_ms * 1e-3;
                assert!(due_s <= until_s + 1e-9, "{}", fault.kind.name());
            }
        }
    }

    #[test]
    fn the_first_wave_that_no_specimen_has_is_told() {
        let scene = Scene {
            surface: surface(VARIED, Rendering::Fundamental),
            ..Scene::constant(2.0, 50.0)
        };
        let plain = native::run(&Scene::constant(2.0, 50.0)).unwrap().estimates[0];
        let stood_by = |wavelengths_mm: &[f32], valid| {
            let said = wavelengths_mm.iter().zip(0..).map(|(&mm, number)| {
                let mut estimate: Estimate = plain.estimate;
                estimate.wavelength_mm = Some(mm);
                estimate.valid = valid;
                TimedMessage {
                    at_ns: 900_000_000 + 100_000_000 * number,
                    message: Message::Estimate(estimate),
                }
            });
            let said: Vec<_> = said.collect();
            stray(
                &scene,
                &Fault::new(Kind::AdcStuck, 1.0),
                1_200_000_000,
                &said,
            )
        };
        // Before the fault, and behind its window.
        assert_eq!(stood_by(&[1.5, 2.1, 2.8, 1.5], true), None);
        let told = stood_by(&[2.0, 2.1, 2.5, 1.5], true);
        assert_eq!(
            told,
            Some(Stray {
                after_ms: 100.0,
                wavelength_mm: 2.5
            })
        );
        assert_eq!(stood_by(&[2.0, 2.1, 2.5, 1.5], false), None);
    }

    #[test]
    fn the_seed_decides_the_instants() {
        let faults = |plan: Plan| -> Vec<Fault> {
            let shifts = plan.shifts().into_iter();
            shifts.flat_map(|shift| shift.scene.faults).collect()
        };
        assert_eq!(faults(plan()), faults(plan()));
        assert_ne!(faults(plan()), faults(Plan { seed: 4, ..plan() }));
    }
}
