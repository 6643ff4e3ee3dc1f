//! What happens in a scene between its scans, and exactly when: borders of specimens, stick and slip,
//! reversals, faults.
//!
//! None of these waits for a scan. Where an instant is found between two scans, the arm goes in a straight
//! line there: a hand that speeds up by a is then off by a·T²/8 in place, 0.003 µm at 0.4 m/s².

use serde::Serialize;

use crate::plant::contact::Contact;
use crate::plant::skew::Skew;
use crate::plant::surface::Surface;
use crate::run::observer::{RunEvent, RunObserver, replay_to};
use crate::run::recording::Recording;
use crate::scene::{Follows, Gauges, Motion, Scene};

/// Something that happened.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Event {
    /// When, in s since the scene's start.
    pub t_s: f64,
    /// What.
    #[serde(flatten)]
    pub kind: Kind,
}

/// What may happen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Kind {
    /// The fingertip's middle passes from one specimen to the next.
    Border {
        /// λ in mm before.
        from_mm: f64,
        /// λ in mm after.
        to_mm: f64,
    },
    /// The skin comes to rest on the surface.
    Stick,
    /// It breaks away.
    Slip,
    /// The hand turns back.
    HandReversal,
    /// The arm does, if it follows the link.
    ArmReversal,
    /// Something breaks on purpose.
    Fault {
        /// What, as scenes call it.
        fault: &'static str,
    },
}

/// Everything that happened in a run of `scene`, in its order.
pub fn events(scene: &Scene, recording: &Recording) -> Vec<Event> {
    let mut events = Events::new(scene);
    replay_to(recording, &mut events);
    events.finish()
}

/// Finds what happens in a run as it goes on: the events are kept, of the scans the last two.
pub struct Events<'a> {
    scene: &'a Scene,
    turns: Option<ArmTurns>,
    touches: Option<Touches>,
    arm_reversals: Vec<Event>,
    touched: Vec<Event>,
}

impl<'a> Events<'a> {
    /// Before the run of `scene`.
    pub fn new(scene: &'a Scene) -> Self {
        Self {
            scene,
            turns: (scene.arm.follows == Follows::Link).then(|| ArmTurns::new(scene)),
            touches: match &scene.gauges {
                Gauges::Kinematic(kinematic) => {
                    Some(Touches::new(scene, Skew::new(kinematic.skew_us)))
                }
                Gauges::Recorded(_) => None,
            },
            arm_reversals: Vec::new(),
            touched: Vec::new(),
        }
    }

    /// Everything that happened, in its order.
    pub fn finish(self) -> Vec<Event> {
        let mut events: Vec<Event> = hand_reversals_s(&self.scene.motion, self.scene.duration_s)
            .into_iter()
            .map(|t_s| Event {
                t_s,
                kind: Kind::HandReversal,
            })
            .collect();
        events.extend(self.arm_reversals);
        events.extend(self.touched);
        events.extend(self.scene.faults.iter().map(|fault| Event {
            t_s: fault.at_s,
            kind: Kind::Fault {
                fault: fault.kind.name(),
            },
        }));
        events.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
        events
    }
}

impl RunObserver for Events<'_> {
    fn see(&mut self, event: RunEvent<'_>) {
        let RunEvent::Scan(scan) = event else { return };
        let t_s = scan.at_ns as f64 * 1e-9;
        if let Some(turns) = &mut self.turns {
            self.arm_reversals.extend(turns.scan(t_s, scan.position_mm));
        }
        if let Some(touches) = &mut self.touches {
            touches.scan(t_s, scan.position_mm, &mut self.touched);
        }
    }
}

/// When a hand turns back within `duration_s`, in s. Of a hand that rests in between, when it turns.
pub fn hand_reversals_s(motion: &Motion, duration_s: f64) -> Vec<f64> {
    match motion {
        Motion::Constant { .. } | Motion::Live(_) => Vec::new(),
        // sin turns its sign each half cycle.
        Motion::Sinusoid {
            amplitude_mm_s,
            frequency_hz,
        } => (1..)
            .map(|half| f64::from(half) / (2.0 * frequency_hz))
            .take_while(|&t_s| t_s < duration_s && *amplitude_mm_s > 0.0)
            .collect(),
        Motion::Recorded(positions) => {
            let mut direction = 0.0;
            let mut reversals_s = Vec::new();
            for row in 0..positions.at.len() - 1 {
                let slope = positions.slope(row, 0, positions.at[row]);
                if slope != 0.0 && slope.signum() == -direction {
                    reversals_s.push(positions.at[row]);
                }
                if slope != 0.0 {
                    direction = slope.signum();
                }
            }
            reversals_s.retain(|t_s| (0.0..duration_s).contains(t_s));
            reversals_s
        }
    }
}

/// Turns of a driven arm: at a scan if its drive has no lag, else where the parabola through the three
/// scans around it turns.
struct ArmTurns {
    lags: bool,
    /// The scan before the last, and the last, in s and mm.
    before: [Option<(f64, f64)>; 2],
    direction: f64,
}

impl ArmTurns {
    fn new(scene: &Scene) -> Self {
        Self {
            lags: scene.arm.lag_ms != 0.0,
            before: [None; 2],
            direction: 0.0,
        }
    }

    /// The turn about the scan before this one.
    fn scan(&mut self, t_s: f64, position_mm: f64) -> Option<Event> {
        let c = (t_s, position_mm);
        let [a, b] = self.before;
        self.before = [b, Some(c)];
        let (a, b) = (a?, b?);
        let before_mm = b.1 - a.1;
        let after_mm = c.1 - b.1;
        if before_mm != 0.0 {
            self.direction = before_mm.signum();
        }
        if after_mm == 0.0 || after_mm.signum() != -self.direction {
            return None;
        }
        let half_s = 0.5 * (c.0 - a.0) / 2.0;
        let t_s = if !self.lags || before_mm == 0.0 {
            b.0
        } else {
            b.0 + half_s * (before_mm + after_mm) / (before_mm - after_mm)
        };
        Some(Event {
            t_s,
            kind: Kind::ArmReversal,
        })
    }
}

/// Borders, sticks and slips: the contact is led once more along the scans of the run.
struct Touches {
    surface: Surface,
    borders_mm: Vec<f64>,
    contact: Contact,
    skew: Skew,
    /// The last scan, in s, and where the skin touched then, in mm.
    before: Option<(f64, f64)>,
}

impl Touches {
    fn new(scene: &Scene, skew: Skew) -> Self {
        Self {
            surface: Surface::new(&scene.surface, 0.0),
            borders_mm: borders_mm(scene),
            contact: Contact::new(scene.contact, scene.force.stiffness_n_per_m),
            skew,
            before: None,
        }
    }

    /// Adds what happened since the scan before.
    fn scan(&mut self, t_s: f64, position_mm: f64, events: &mut Vec<Event>) {
        let arm_mm = self.skew.at_gauges_mm(t_s, position_mm);
        let here_mm = self.contact.follow(t_s, arm_mm).position_mm;
        let turns = self.contact.take_turns().into_iter();
        events.extend(turns.map(|(t_s, rests)| Event {
            t_s,
            kind: if rests { Kind::Stick } else { Kind::Slip },
        }));
        let Some((before_s, before_mm)) = self.before.replace((t_s, here_mm)) else {
            return;
        };
        let (low_mm, high_mm) = (before_mm.min(here_mm), before_mm.max(here_mm));
        // Several in one scan have between them what is between them.
        let crossed = |&border_mm: &f64| low_mm < border_mm && border_mm <= high_mm;
        let mut crossed: Vec<f64> = self.borders_mm.iter().copied().filter(crossed).collect();
        if here_mm < before_mm {
            crossed.reverse();
        }
        let mut from_mm = self.surface.wavelength_mm(before_mm);
        for (number, &border_mm) in crossed.iter().enumerate() {
            let until_mm = match crossed.get(number + 1) {
                Some(next_mm) => f64::midpoint(border_mm, *next_mm),
                None => here_mm,
            };
            let to_mm = self.surface.wavelength_mm(until_mm);
            let share = (border_mm - before_mm) / (here_mm - before_mm);
            events.push(Event {
                t_s: before_s + share * (t_s - before_s),
                kind: Kind::Border { from_mm, to_mm },
            });
            from_mm = to_mm;
        }
    }
}

/// Where one specimen ends and the next begins, in mm.
fn borders_mm(scene: &Scene) -> Vec<f64> {
    let specimens = &scene.surface.specimens;
    specimens[..specimens.len() - 1]
        .iter()
        .scan(scene.surface.start_mm, |at_mm, specimen| {
            *at_mm += specimen.length_mm;
            Some(*at_mm)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::native;
    use crate::plant::contact::NORMAL_N;
    use crate::scene;
    use crate::scene::{ArmDrive, Friction, Integrator, Solver, Specimen};

    fn found(scene: &Scene) -> Vec<Event> {
        events(scene, &native::run(scene).expect("a scene in code runs"))
    }

    fn of(events: &[Event], wanted: impl Fn(Kind) -> bool) -> Vec<f64> {
        events
            .iter()
            .filter(|event| wanted(event.kind))
            .map(|event| event.t_s)
            .collect()
    }

    fn two_specimens(motion: Motion) -> Scene {
        let mut scene = Scene {
            motion,
            duration_s: 1.0,
            ..Scene::constant(1.0, 50.0)
        };
        scene.surface.specimens = vec![
            Specimen {
                wavelength_mm: 1.0,
                length_mm: 7.3,
            },
            Specimen {
                wavelength_mm: 4.0,
                length_mm: f64::INFINITY,
            },
        ];
        scene
    }

    #[test]
    fn a_border_is_passed_when_the_arm_is_there_not_at_the_next_scan() {
        let events = found(&two_specimens(Motion::Constant { speed_mm_s: 50.0 }));
        let borders = of(&events, |kind| matches!(kind, Kind::Border { .. }));
        assert_eq!(borders.len(), 1);
        assert!((borders[0] - 7.3 / 50.0).abs() < 1e-9);
        assert_eq!(
            events[0].kind,
            Kind::Border {
                from_mm: 1.0,
                to_mm: 4.0
            }
        );
    }

    #[test]
    fn two_borders_in_one_scan_have_between_them_what_is_between_them() {
        for speed_mm_s in [50.0, -50.0] {
            let mut scene = two_specimens(Motion::Constant { speed_mm_s });
            let place_mm = 7.3 * f64::signum(speed_mm_s);
            scene.surface.start_mm += place_mm - 14.6;
            scene.surface.specimens.insert(
                1,
                Specimen {
                    wavelength_mm: 2.0,
                    length_mm: 0.004,
                },
            );
            scene.surface.specimens[0].length_mm = 14.6;
            let events = found(&scene);
            let borders: Vec<(f64, f64)> = events
                .iter()
                .filter_map(|event| match event.kind {
                    Kind::Border { from_mm, to_mm } => Some((from_mm, to_mm)),
                    _ => None,
                })
                .collect();
            let due = match speed_mm_s > 0.0 {
                true => [(1.0, 2.0), (2.0, 4.0)],
                false => [(4.0, 2.0), (2.0, 1.0)],
            };
            assert_eq!(borders, due, "{speed_mm_s} mm/s");
        }
    }

    #[test]
    fn a_swinging_hand_passes_a_border_and_turns_at_the_instants_of_the_closed_form() {
        let (amplitude_mm_s, frequency_hz) = (70.0, 1.7);
        let events = found(&two_specimens(Motion::Sinusoid {
            amplitude_mm_s,
            frequency_hz,
        }));
        let omega = std::f64::consts::TAU * frequency_hz;
        // x = A/ω (1 − cos ωt) is 7.3 mm on the way out and on the way back, in each of the cycles.
        let out_s = (1.0 - 7.3 * omega / amplitude_mm_s).acos() / omega;
        let cycle_s = 1.0 / frequency_hz;
        let due = [out_s, cycle_s - out_s, cycle_s + out_s];
        let borders = of(&events, |kind| matches!(kind, Kind::Border { .. }));
        assert_eq!(borders.len(), due.len());
        for (found_s, due_s) in borders.into_iter().zip(due) {
            // A straight line between scans is off by a·T²/8 in place: 750 mm/s² · 8e-9 s² at 60 mm/s.
            assert!((found_s - due_s).abs() < 1e-7, "{found_s} s for {due_s} s");
        }
        let turns = of(&events, |kind| kind == Kind::HandReversal);
        assert_eq!(turns, [0.5 * cycle_s, cycle_s, 1.5 * cycle_s]);
    }

    #[test]
    fn the_first_slip_is_where_spring_and_damper_reach_static_friction() {
        let scene = Scene {
            contact: scene::Contact::stick_slip(Friction::Strong),
            duration_s: 1.0,
            ..Scene::constant(2.0, 30.0)
        };
        let slips = of(&found(&scene), |kind| kind == Kind::Slip);
        // k v t + c v = μs N, with μs = 1.
        let due_s = (NORMAL_N - 0.15 * 0.03) / (400.0 * 0.03);
        assert!((slips[0] - due_s).abs() < 1e-9, "{} s", slips[0]);
    }

    #[test]
    fn stick_and_slip_come_at_the_same_instants_by_any_step() {
        let run = |integrator, step_us: f64| {
            let scene = Scene {
                contact: scene::Contact {
                    solver: Solver::Stepped {
                        integrator,
                        step_s: step_us * 1e-6,
                    },
                    ..scene::Contact::stick_slip(Friction::Strong)
                },
                duration_s: 0.3,
                ..Scene::constant(2.0, 30.0)
            };
            of(&found(&scene), |kind| {
                matches!(kind, Kind::Stick | Kind::Slip)
            })
        };
        let reference = run(Integrator::Rk4, 1.0);
        assert!(reference.len() >= 6, "{reference:?}");
        for (integrator, step_us) in [
            (Integrator::Rk4, 2.0),
            (Integrator::Rk4, 5.0),
            (Integrator::Implicit, 5.0),
            (Integrator::SemiImplicit, 2.0),
            (Integrator::Adaptive, 62.5),
            (Integrator::Radau, 62.5),
        ] {
            let found = run(integrator, step_us);
            assert_eq!(found.len(), reference.len(), "{integrator:?} {step_us} µs");
            for (found_s, due_s) in found.iter().zip(&reference) {
                assert!(
                    (found_s - due_s).abs() < 50e-6,
                    "{integrator:?} {step_us} µs: {found_s} s for {due_s} s"
                );
            }
        }
    }

    #[test]
    fn a_driven_arm_turns_after_the_hand() {
        let scene = Scene {
            arm: ArmDrive {
                follows: Follows::Link,
                lag_ms: 20.0,
                ..ArmDrive::default()
            },
            ..two_specimens(Motion::Sinusoid {
                amplitude_mm_s: 70.0,
                frequency_hz: 1.0,
            })
        };
        let events = found(&scene);
        let hand = of(&events, |kind| kind == Kind::HandReversal);
        let arm = of(&events, |kind| kind == Kind::ArmReversal);
        assert_eq!((hand.len(), arm.len()), (1, 1), "{events:?}");
        // Behind the hand by the link's milliseconds and what the follower does not make up of the lag.
        assert!((0.002..0.03).contains(&(arm[0] - hand[0])), "{events:?}");
    }
}
