//! Runs that are judged while they go on: the same as recorded and judged, in a bounded room.

use hil_sim_core::judge::event::Kind as EventKind;
use hil_sim_core::judge::outcome::{Judgement, Outcome};
use hil_sim_core::judge::truth::Truth;
use hil_sim_core::judge::{Held, Judge};
use hil_sim_core::native;
use hil_sim_core::run::observer::{RunEvent, RunObserver};
use hil_sim_core::scene::fault::{Fault, Kind};
use hil_sim_core::scene::{
    ArmDrive, Contact, Display, Follows, Friction, Gauges, Kinematic, Link, Motion, Scene, Specimen,
};
use protocol::{DisplayConfiguration, Mode, UpdateRate};

const SWING: Motion = Motion::Sinusoid {
    amplitude_mm_s: 70.0,
    frequency_hz: 0.83,
};
const BAD: Link = Link {
    delay_ms: 20.0,
    jitter_ms: 5.0,
    loss: 0.05,
    reorder: 0.02,
    corrupt: 0.0002,
};

/// A hand that swings over 2 mm, with noise.
fn swinging() -> Scene {
    Scene {
        motion: SWING,
        gauges: Gauges::Kinematic(Kinematic {
            snr_db: Some(20.0),
            ..Kinematic::default()
        }),
        duration_s: 4.0,
        ..Scene::constant(2.0, 50.0)
    }
}

fn shown(mode: Mode, update_rate: UpdateRate, amplitude_mv: u16) -> Display {
    Display {
        configuration: DisplayConfiguration {
            mode,
            update_rate,
            amplitude_mv,
            ..DisplayConfiguration::DEFAULT
        },
        ..Display::default()
    }
}

/// Both ways to judge a run; they agree to the last bit.
fn judged(scene: &Scene) -> Judgement {
    let on_the_fly = Judgement::of(scene, true).unwrap();
    let recording = native::run(scene).unwrap();
    let recorded = Outcome::new(scene.clone(), recording).judgement(true);
    let mut ran = recorded.ran;
    ran.wall_s = on_the_fly.ran.wall_s;
    assert_eq!(on_the_fly, Judgement { ran, ..recorded });
    on_the_fly
}

#[test]
fn a_bad_link_is_judged_alike_and_so_are_4_khz_and_travelling_waves() {
    let scene = Scene {
        link: BAD,
        ..swinging()
    };
    assert!(judged(&scene).verdict.actuators.mean_v.is_some());
    let travelling = Scene {
        display: shown(Mode::Travelling, UpdateRate::Hz4000, 5_000),
        ..scene
    };
    let judgement = judged(&travelling);
    assert!(judgement.verdict.actuators.frequency_hz.is_some());
    assert!(judgement.verdict.summary.latency_ms.is_some());
}

#[test]
fn weak_and_slow_stimuli_are_judged_alike() {
    let scene = Scene {
        motion: Motion::Sinusoid {
            amplitude_mm_s: 8.0,
            frequency_hz: 0.1,
        },
        display: shown(Mode::Uniform, UpdateRate::Hz2000, 700),
        duration_s: 12.0,
        ..swinging()
    };
    assert!(judged(&scene).verdict.actuators.hand_to_output.is_some());
}

#[test]
fn friction_and_a_driven_arm_are_judged_alike_with_their_events() {
    let scene = Scene {
        contact: Contact::stick_slip(Friction::Strong),
        ..swinging()
    };
    let events = judged(&scene).events;
    assert!(events.iter().any(|event| event.kind == EventKind::Slip));
    let scene = Scene {
        arm: ArmDrive {
            follows: Follows::Link,
            lag_ms: 20.0,
            ..ArmDrive::default()
        },
        ..swinging()
    };
    let events = judged(&scene).events;
    assert!(
        events
            .iter()
            .any(|event| event.kind == EventKind::ArmReversal)
    );
}

#[test]
fn two_specimens_are_judged_alike() {
    let mut scene = swinging();
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
    let judgement = judged(&scene);
    assert!(judgement.verdict.summary.settling_ms.is_some());
}

#[test]
fn faults_are_judged_alike() {
    for kind in [
        Kind::LinkDown,
        Kind::LinkReplay,
        Kind::LinkLate,
        Kind::LinkFlood,
        Kind::EstimateJumping,
        Kind::StopFromPeer,
        Kind::GaugeOpen,
        Kind::ArmEncoderDead,
    ] {
        let scene = Scene {
            faults: vec![Fault::new(kind, 1.113), Fault::new(Kind::LinkDown, 2.9)],
            ..swinging()
        };
        let findings = judged(&scene).findings;
        assert_eq!(findings.len(), 2);
        assert!(findings[0].was_driving, "{kind:?}");
    }
}

/// Judges a run, and notes how much the judge held at most.
struct Weighing<'a> {
    judge: Judge<'a>,
    most: Held,
}

impl RunObserver for Weighing<'_> {
    fn see(&mut self, event: RunEvent<'_>) {
        self.judge.see(event);
        if let RunEvent::Tick(_) = event {
            let held = self.judge.held();
            self.most.points = self.most.points.max(held.points);
            self.most.cycles = self.most.cycles.max(held.cycles);
        }
    }
}

fn most_held(scene: &Scene, duration_s: f64) -> Held {
    let wavelength_mm = |_| 2.0;
    let mut truth = Truth::new("", "", &wavelength_mm);
    truth.display = scene.display_configuration();
    let mut weighing = Weighing {
        judge: Judge::new(&truth),
        most: Held::default(),
    };
    let scene = Scene {
        duration_s,
        ..scene.clone()
    };
    native::run_before(&scene, &mut weighing).unwrap();
    weighing.most
}

#[test]
fn a_judge_holds_no_more_points_the_longer_a_run_lasts_and_few_numbers_a_cycle() {
    // The mean of |sin| is 2/π.
    let cycles_hz = 70.0 * std::f64::consts::FRAC_2_PI / 2.0;
    for update_rate in [UpdateRate::Hz2000, UpdateRate::Hz4000] {
        let scene = Scene {
            link: BAD,
            display: shown(Mode::Travelling, update_rate, 5_000),
            ..swinging()
        };
        // The slowest cycle is the one about a turning point: over 2 mm at 365 mm/s² of acceleration it takes
        // 2 √(2 · 1 mm / 365 mm/s²) = 0.15 s, and a point has one more on either side. 256 sums of cycles are
        // kept beside.
        let ticks = 3.0 * 0.15 * f64::from(update_rate.hz());
        for duration_s in [10.0, 40.0] {
            let held = most_held(&scene, duration_s);
            assert!(held.points as f64 <= ticks + 256.0 + 10.0, "{held:?}");
            // A crossing, a window, and two ticks over crests.
            assert!(
                held.cycles as f64 <= 4.0 * cycles_hz * duration_s,
                "{held:?}"
            );
        }
    }
}
