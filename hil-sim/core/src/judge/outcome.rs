//! A scene that was run, judged.

use crate::judge;
use crate::judge::Verdict;
use crate::judge::event::{Event, Events, events};
use crate::judge::expectation;
use crate::judge::fault;
use crate::judge::fault::{Finding, judge};
use crate::judge::truth::Truth;
use crate::native;
use crate::plant::surface::Surface;
use crate::run::recording::{Ran, Recording};
use crate::scene::{Scene, SceneError};

/// A run and what came of it.
pub struct Outcome {
    /// What was run.
    pub scene: Scene,
    /// What the run left behind.
    pub recording: Recording,
    /// The recording, judged.
    pub verdict: Verdict,
    /// A line for each expectation that was not met: the scene's, and of its faults what the table of kinds says.
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
        let verdict = judge::judge(&truth(&scene, &*wavelength_mm), &recording);
        let findings = judge(&scene, &recording);
        let unmet = unmet(&scene, &verdict, &findings);
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

    /// The same without the recording; events on demand.
    pub fn judgement(&self, with_events: bool) -> Judgement {
        Judgement {
            ran: self.recording.ran(),
            verdict: self.verdict.clone(),
            unmet: self.unmet.clone(),
            findings: self.findings.clone(),
            events: if with_events {
                events(&self.scene, &self.recording)
            } else {
                Vec::new()
            },
        }
    }
}

/// What came of a run, of which nothing else need be left.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// What is known of the run.
    pub ran: Ran,
    /// The run, judged.
    pub verdict: Verdict,
    /// A line for each expectation that was not met: the scene's, and of its faults what the table of kinds says.
    pub unmet: Vec<String>,
    /// What became of the scene's faults, in their order.
    pub findings: Vec<Finding>,
    /// What happened, and when, if it was asked for.
    pub events: Vec<Event>,
}

impl Judgement {
    /// Runs a scene on the native engine and judges it meanwhile, to the same ends as [`Outcome::new`]. Events
    /// take the contact model to be led through the scene once more.
    ///
    /// # Errors
    /// If the scene cannot be run.
    pub fn of(scene: &Scene, with_events: bool) -> Result<Self, SceneError> {
        let surface = Surface::new(&scene.surface, 0.0);
        let wavelength_mm = |x_mm| surface.wavelength_mm(x_mm);
        let mut judges = (
            judge::Judge::new(&truth(scene, &wavelength_mm)),
            fault::Judge::new(scene),
            with_events.then(|| Events::new(scene)),
        );
        let ran = native::run_before(scene, &mut judges)?;
        let (run, faults, events) = judges;
        let (verdict, findings) = (run.finish(), faults.finish());
        Ok(Self {
            ran,
            unmet: unmet(scene, &verdict, &findings),
            verdict,
            findings,
            events: events.map(Events::finish).unwrap_or_default(),
        })
    }
}

fn unmet(scene: &Scene, verdict: &Verdict, findings: &[Finding]) -> Vec<String> {
    let mut unmet = expectation::unmet(&scene.expect, verdict);
    for (number, finding) in findings.iter().enumerate() {
        let kind = finding.fault.kind.name();
        let lines = finding.unmet().into_iter();
        unmet.extend(lines.map(|line| format!("fault[{number}] {kind}: {line}")));
    }
    unmet
}

fn truth<'a>(scene: &'a Scene, wavelength_mm: &'a dyn Fn(f64) -> f64) -> Truth<'a> {
    Truth {
        sensor: scene.sensor_configuration(),
        display: scene.display_configuration(),
        actuators: *scene.display.actuators,
        ..Truth::new(&scene.name, scene.estimator.method.name(), wavelength_mm)
    }
}
