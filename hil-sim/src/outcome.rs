//! A scene that was run, judged.

use crate::analysis::{self, Verdict};
use crate::event::events;
use crate::expectation;
use crate::fault::judge::{Finding, judge};
use crate::json::{ContactResult, Fault, SceneResult};
use crate::recording::Recording;
use crate::report::Chapter;
use crate::scene::Scene;
use crate::surface::Surface;
use crate::truth::Truth;

/// A run and what came of it.
pub struct Outcome {
    /// What was run.
    pub scene: Scene,
    /// What the run left behind.
    pub recording: Recording,
    /// The recording, judged.
    pub verdict: Verdict,
    /// A line for each expectation of the scene that was not met.
    pub unmet: Vec<String>,
    /// What became of the scene's faults, in their order.
    pub findings: Vec<Finding>,
    wavelength_mm: Box<dyn Fn(f64) -> f64 + Send>,
}

impl Outcome {
    /// Judges the recording of a scene.
    pub fn new(scene: Scene, recording: Recording) -> Self {
        let surface = Surface::new(&scene.surface, 0.0);
        let wavelength_mm = Box::new(move |x_mm| surface.wavelength_mm(x_mm));
        let verdict = analysis::judge(&truth(&scene, &*wavelength_mm), &recording);
        let unmet = expectation::unmet(&scene.expect, &verdict);
        let findings = judge(&scene.faults, &recording);
        Self {
            scene,
            recording,
            verdict,
            unmet,
            findings,
            wavelength_mm,
        }
    }

    /// What the scene knows.
    pub fn truth(&self) -> Truth<'_> {
        truth(&self.scene, &*self.wavelength_mm)
    }

    /// The outcome's object in the JSON.
    pub fn result(&self) -> SceneResult<'_> {
        SceneResult {
            contact: ContactResult::of(&self.scene),
            events: events(&self.scene, &self.recording),
            faults: self.findings.iter().map(Fault::from).collect(),
            ..SceneResult::new(&self.truth(), &self.recording, &self.verdict)
        }
    }

    /// The outcome's part of the report.
    pub fn chapter(&self) -> Chapter<'_> {
        Chapter {
            truth: self.truth(),
            recording: &self.recording,
            verdict: &self.verdict,
            unmet: &self.unmet,
            findings: &self.findings,
            contact: ContactResult::of(&self.scene).map(|contact| contact.sentence()),
        }
    }
}

fn truth<'a>(scene: &'a Scene, wavelength_mm: &'a dyn Fn(f64) -> f64) -> Truth<'a> {
    Truth {
        sensor: scene.sensor_configuration(),
        display: scene.display_configuration(),
        actuators: *scene.display.actuators,
        ..Truth::new(&scene.name, scene.estimator.method_name(), wavelength_mm)
    }
}
