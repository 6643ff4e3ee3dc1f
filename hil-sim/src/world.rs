//! Everything outside of the boards: surface, hand and gauges of one scene, deterministic from its seed.

use protocol::CHANNELS;

use crate::gauges::{KinematicGauges, RecordedGauges};
use crate::scene::{Gauges, Motion, Scene, SceneError};
use crate::surface::Surface;

/// The world of a scene.
#[derive(Clone, Debug)]
pub struct World {
    motion: Motion,
    surface: Surface,
    source: Source,
}

#[derive(Clone, Debug)]
enum Source {
    Kinematic(KinematicGauges),
    Recorded(RecordedGauges),
}

impl World {
    /// Builds the world of a checked scene. No scene that loaded fails today; an engine has to be ready
    /// for one that does.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        let (source, second_harmonic) = match &scene.gauges {
            Gauges::Kinematic(kinematic) => (
                Source::Kinematic(KinematicGauges::new(kinematic, scene.seed)),
                kinematic.second_harmonic,
            ),
            Gauges::Recorded(volts) => (Source::Recorded(RecordedGauges::new(volts.clone())), 0.0),
        };
        let surface = Surface::new(&scene.surface, second_harmonic);
        Ok(Self {
            motion: scene.motion.clone(),
            surface,
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

    /// The true wavelength at `x_mm`, in mm: under the fingertip's middle if x is the arm's position.
    pub fn wavelength_mm(&self, x_mm: f64) -> f64 {
        self.surface.wavelength_mm(x_mm)
    }

    /// One ADC scan at `t_s` with the arm at `arm_position_mm`. Scans are to be asked for in order, each
    /// once: the noise is drawn here.
    #[inline]
    pub fn codes(&mut self, t_s: f64, arm_position_mm: f64) -> [u16; CHANNELS] {
        match &mut self.source {
            Source::Kinematic(gauges) => gauges.scan(&self.surface, t_s, arm_position_mm),
            Source::Recorded(gauges) => gauges.scan(t_s),
        }
    }
}
