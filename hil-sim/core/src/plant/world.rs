//! Everything outside of the boards: surface, hand, fingertip and sensor of one scene, deterministic
//! from its seed.

use protocol::CHANNELS;

use crate::plant::contact::{Contact, Touch};
use crate::plant::gauges::{ForceChannel, KinematicGauges, RecordedGauges};
use crate::plant::motion::coarse_encoder;
use crate::plant::patch::Patch;
use crate::plant::skew::Skew;
use crate::plant::surface::Surface;
use crate::scene;
use crate::scene::{ENCODER_COUNT_UM, Gauges, Motion, Profile, Scene, SceneError};

/// The world of a scene.
#[derive(Clone, Debug)]
pub struct World {
    motion: Motion,
    surface: Surface,
    encoder_step_counts: u16,
    skew: Skew,
    source: Source,
}

#[derive(Clone, Debug)]
enum Source {
    Computed(Box<Fingertip>),
    Recorded(RecordedGauges),
}

/// The fingertip on the surface, and what it is measured with.
#[derive(Clone, Debug)]
struct Fingertip {
    contact: Contact,
    /// None where a gauge feels a point.
    patch: Option<Box<Patch>>,
    gauges: KinematicGauges,
    force: ForceChannel,
    touch: Option<Touch>,
}

impl World {
    /// Builds the world of a checked scene. No scene that loaded fails today; an engine has to be ready
    /// for one that does.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        let (source, second_harmonic, skew_us) = match &scene.gauges {
            Gauges::Kinematic(kinematic) => {
                let fingertip = Fingertip {
                    contact: Contact::new(scene.contact, scene.force.stiffness_n_per_m),
                    patch: (scene.contact.rung.has_patch() && !is_felt(&scene.surface))
                        .then(|| Box::new(Patch::new(&scene.surface, kinematic.second_harmonic))),
                    gauges: KinematicGauges::new(kinematic, scene.seed),
                    force: ForceChannel::new(&scene.force, kinematic.snr_db.is_some(), scene.seed),
                    touch: None,
                };
                (
                    Source::Computed(Box::new(fingertip)),
                    kinematic.second_harmonic,
                    kinematic.skew_us,
                )
            }
            Gauges::Recorded(volts) => {
                let gauges = RecordedGauges::new(volts.clone(), scene.force.present);
                (Source::Recorded(gauges), 0.0, 0.0)
            }
        };
        Ok(Self {
            motion: scene.motion.clone(),
            surface: Surface::new(&scene.surface, second_harmonic),
            encoder_step_counts: scene.arm.encoder_um / ENCODER_COUNT_UM,
            skew: Skew::new(skew_us),
            source,
        })
    }

    /// Where the operator's hand is at `t_s`, in mm.
    pub fn hand_position_mm(&self, t_s: f64) -> f64 {
        self.motion.position_mm(t_s)
    }

    /// The true wavelength at `x_mm`, in mm: under the fingertip's middle if x is where it touches.
    pub fn wavelength_mm(&self, x_mm: f64) -> f64 {
        self.surface.wavelength_mm(x_mm)
    }

    /// One ADC scan at `t_s` with the arm at `arm_position_mm`. Scans are to be asked for in order, each
    /// once: the fingertip moves and the noise is drawn here.
    #[inline]
    pub fn codes(&mut self, t_s: f64, arm_position_mm: f64) -> [u16; CHANNELS] {
        let fingertip = match &mut self.source {
            Source::Computed(fingertip) => fingertip,
            Source::Recorded(gauges) => return gauges.scan(self.motion.played_s(t_s)),
        };
        let arm_mm = self.skew.at_gauges_mm(t_s, arm_position_mm);
        let touch = fingertip.contact.follow(t_s, arm_mm);
        fingertip.touch = Some(touch);
        let gauges = &mut fingertip.gauges;
        let [g0, g1, g2, g3, g4] = match &fingertip.patch {
            None => gauges.scan(&self.surface, t_s, touch.position_mm),
            Some(patch) => gauges.scan(&**patch, t_s, touch.position_mm),
        };
        [g0, g1, g2, g3, g4, fingertip.force.scan(touch.force_n)]
    }

    /// The arm encoder's counter at `t_s` with the arm at `arm_position_mm`. As [`World::codes`], once a
    /// scan, in order.
    #[inline]
    pub fn arm_encoder(&mut self, t_s: f64, arm_position_mm: f64) -> u16 {
        let arm_mm = self.skew.at_encoder_mm(t_s, arm_position_mm);
        coarse_encoder(arm_mm, self.encoder_step_counts)
    }

    /// The fingertip at the last scan; none before the first, or if the gauges are recorded.
    pub fn touch(&self) -> Option<Touch> {
        match &self.source {
            Source::Computed(fingertip) => fingertip.touch,
            Source::Recorded(_) => None,
        }
    }
}

/// Whether the surface says what a gauge feels: nothing is averaged over the contact once more.
const fn is_felt(surface: &scene::Surface) -> bool {
    matches!(surface.profile, Profile::Felt(_))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ArmDrive, Force, Friction, Kinematic};

    const SCAN_S: f64 = 250e-6;

    fn sliding(friction: Friction) -> Scene {
        Scene {
            contact: scene::Contact::stick_slip(friction),
            force: Force {
                present: true,
                ..Force::default()
            },
            ..Scene::constant(2.0, 50.0)
        }
    }

    /// The codes and encoder counts of `scans` scans of a constant 50 mm/s.
    fn run(scene: &Scene, scans: u32) -> Vec<([u16; CHANNELS], u16)> {
        let mut world = World::new(scene).unwrap();
        (0..scans)
            .map(|scan| {
                let t_s = f64::from(scan) * SCAN_S;
                let codes = world.codes(t_s, 50.0 * t_s);
                (codes, world.arm_encoder(t_s, 50.0 * t_s))
            })
            .collect()
    }

    #[test]
    fn the_gauges_feel_what_lies_under_the_slider_and_the_force_is_the_spring_s() {
        let scene = sliding(Friction::Strong);
        let mut world = World::new(&scene).unwrap();
        let mut gauges = KinematicGauges::new(&Kinematic::default(), 1);
        let surface = Surface::new(&scene.surface, 0.0);
        assert_eq!(world.touch(), None);
        let (mut stuck, mut slipped) = (0, 0);
        for scan in 0..4_000 {
            let t_s = f64::from(scan) * SCAN_S;
            let arm_mm = 50.0 * t_s;
            let codes = world.codes(t_s, arm_mm);
            let touch = world.touch().unwrap();
            assert_eq!(
                codes[..5],
                gauges.scan(&surface, t_s, touch.position_mm)[..]
            );
            let force_n = 400.0 * (arm_mm - touch.position_mm) * 1e-3;
            assert!((touch.force_n - force_n).abs() < 1e-9);
            // 1 N/V, floor.
            let volts = f64::from(codes[5]) * 3.3 / 4096.0 - 1.65;
            assert!((force_n - volts - 0.0004).abs() < 0.0005, "{volts} V");
            *(if touch.sticks {
                &mut stuck
            } else {
                &mut slipped
            }) += 1;
        }
        assert!(stuck > 400 && slipped > 400, "{stuck}, {slipped}");
    }

    #[test]
    fn a_kinematic_fingertip_drags_nothing_and_goes_with_the_arm() {
        let mut scene = Scene::constant(2.0, 50.0);
        let unwired = run(&scene, 400);
        scene.force.present = true;
        assert_eq!(run(&scene, 400), unwired);
        assert!(unwired.iter().all(|(codes, _)| codes[5] == 2048));
    }

    #[test]
    fn the_force_channel_s_noise_changes_no_gauge() {
        let mut scene = sliding(Friction::Mild);
        scene.gauges = Gauges::Kinematic(Kinematic {
            snr_db: Some(20.0),
            ..Kinematic::default()
        });
        let wired = run(&scene, 4_000);
        scene.force.present = false;
        for (wired, unwired) in wired.iter().zip(run(&scene, 4_000)) {
            assert_eq!(wired.0[..5], unwired.0[..5]);
            assert_eq!(unwired.0[5], 2048);
        }
    }

    #[test]
    fn skewed_gauges_are_the_unskewed_ones_of_so_many_scans_ago() {
        for scene in [Scene::constant(2.0, 50.0), sliding(Friction::Strong)] {
            let skewed = |skew_us: f64| {
                run(
                    &Scene {
                        gauges: Gauges::Kinematic(Kinematic {
                            skew_us,
                            ..Kinematic::default()
                        }),
                        ..scene.clone()
                    },
                    4_000,
                )
            };
            let (even, late, early) = (skewed(0.0), skewed(1000.0), skewed(-1000.0));
            let mut off = 0;
            for scan in 4..4_000 {
                // A code may be rounded the other way: the place is interpolated, and so is rounded.
                off += u32::from(late[scan].0 != even[scan - 4].0);
                assert_eq!(late[scan].1, even[scan].1);
                assert_eq!(early[scan].0, even[scan].0);
                assert!(early[scan].1.abs_diff(even[scan - 4].1) <= 1);
            }
            assert!(off < 40, "{off} scans differ");
        }
    }

    #[test]
    fn a_coarse_encoder_hides_the_small_steps() {
        let scene = Scene {
            arm: ArmDrive {
                encoder_um: 100,
                ..ArmDrive::default()
            },
            ..Scene::constant(2.0, 50.0)
        };
        let fine = run(&Scene::constant(2.0, 50.0), 400);
        for (coarse, fine) in run(&scene, 400).into_iter().zip(fine) {
            assert_eq!(coarse.0, fine.0);
            assert!(coarse.1.is_multiple_of(20) && (coarse.1..coarse.1 + 20).contains(&fine.1));
        }
    }
}
