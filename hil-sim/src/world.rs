//! Everything outside of the boards: surface, hand, fingertip and sensor of one scene, deterministic
//! from its seed.

use protocol::CHANNELS;

use crate::contact::{Contact, Touch};
use crate::gauges::{ForceChannel, KinematicGauges, RecordedGauges};
use crate::motion::coarse_encoder;
use crate::scene::{ENCODER_COUNT_UM, Gauges, Motion, Scene, SceneError};
use crate::skew::Skew;
use crate::surface::Surface;

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
                    gauges: KinematicGauges::new(kinematic, scene.seed),
                    force: ForceChannel::new(
                        &scene.force,
                        kinematic.snr_db.is_some(),
                        scene.seed,
                    ),
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

    /// How fast it moves, in mm/s.
    pub fn hand_velocity_mm_s(&self, t_s: f64) -> f64 {
        self.motion.velocity_mm_s(t_s)
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
            Source::Recorded(gauges) => return gauges.scan(t_s),
        };
        let arm_mm = self.skew.at_gauges_mm(t_s, arm_position_mm);
        let touch = fingertip.contact.follow(t_s, arm_mm);
        fingertip.touch = Some(touch);
        let [g0, g1, g2, g3, g4] = fingertip
            .gauges
            .scan(&self.surface, t_s, touch.position_mm);
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
