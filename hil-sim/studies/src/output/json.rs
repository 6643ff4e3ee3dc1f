//! A run in JSON: one object per scene.

mod lines;

use std::io::{self, Write};

use protocol::Status;
use serde::Serialize;

use crate::output::json::lines::Lines;
use hil_sim_core::judge::event::Event;
use hil_sim_core::judge::fault::Finding;
use hil_sim_core::judge::outcome::Judgement;
use hil_sim_core::judge::{Actuators, JudgedEstimate, Summary, Verdict};
use hil_sim_core::run::recording::Ran;
use hil_sim_core::scene::{Gauges, Scene};

/// A scene's object. A number that could not be measured is null.
#[derive(Clone, Debug, Serialize)]
pub struct SceneResult<'a> {
    /// The scene's name.
    pub name: &'a str,
    /// `native` or `elf`.
    pub engine: &'static str,
    /// How λ was estimated.
    pub method: &'a str,
    /// XXH3 of every link byte and DAC word with its instant: 16 hexadecimal digits.
    pub hash: String,
    /// Virtual time run per wall time.
    pub realtime_factor: Option<f64>,
    /// Every estimate beside the truth.
    pub estimates: &'a [JudgedEstimate],
    /// The estimates as a whole.
    pub summary: Summary,
    /// What the actuators did.
    pub actuators: Actuators,
    /// The counters of both ends.
    pub link: Link,
    /// What faults were injected.
    pub faults: Vec<Fault>,
    /// The contact model; null with recorded gauges.
    pub contact: Option<ContactResult>,
    /// What happened, and when.
    pub events: Vec<Event>,
}

/// The contact model that a scene was run with.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ContactResult {
    /// The rung, as scenes call it.
    pub model: &'static str,
    /// Why `"auto"` chose it; null if the scene names it.
    pub reason: Option<String>,
}

impl ContactResult {
    /// The one of a scene; none with recorded gauges.
    pub fn of(scene: &Scene) -> Option<Self> {
        matches!(scene.gauges, Gauges::Kinematic(_)).then(|| Self {
            model: scene.contact.rung.name(),
            reason: scene.contact_reason.clone(),
        })
    }

    /// The rung and why, in words.
    pub fn sentence(&self) -> String {
        match &self.reason {
            None => format!("contact {}, as the scene says", self.model),
            Some(reason) => format!("contact {}: {reason}", self.model),
        }
    }
}

/// The last counters of both ends; null where none arrived.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Link {
    /// The sensor board's.
    pub sensor: Option<Status>,
    /// The display board's.
    pub display: Option<Status>,
}

/// A fault that was injected, and how the boards took it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fault {
    /// Its kind, as the scene writes it.
    pub kind: &'static str,
    /// When, in s since the scene's start.
    pub at_s: f64,
    /// Until it was noticed, in ms.
    pub detected_ms: Option<f64>,
    /// Until the outputs were harmless, in ms.
    pub safe_ms: Option<f64>,
    /// What is not as the table of kinds has it.
    pub unmet: Vec<String>,
    /// What was not judged, and why.
    pub unjudged: Vec<String>,
}

impl From<&Finding> for Fault {
    fn from(finding: &Finding) -> Self {
        Self {
            kind: finding.fault.kind.name(),
            at_s: finding.fault.at_s,
            detected_ms: finding.detected_ms(),
            safe_ms: finding.safe_ms(),
            unmet: finding.unmet(),
            unjudged: finding.unjudged.clone(),
        }
    }
}

impl<'a> SceneResult<'a> {
    /// The object of a judged run; `scene` is the one that was run.
    pub fn of(judgement: &'a Judgement, scene: &'a Scene) -> Self {
        let method = scene.estimator.method.name();
        Self {
            contact: ContactResult::of(scene),
            events: judgement.events.clone(),
            faults: judgement.findings.iter().map(Fault::from).collect(),
            ..Self::new(&scene.name, method, &judgement.ran, &judgement.verdict)
        }
    }

    /// The object of one run, without faults, contact and events: of a scene's name, and of how λ was estimated,
    /// as the scene writes it.
    fn new(name: &'a str, method: &'a str, ran: &Ran, verdict: &'a Verdict) -> Self {
        Self {
            name,
            engine: ran.engine.name(),
            method,
            hash: format!("{:016x}", ran.hash),
            realtime_factor: ran.realtime_factor(),
            estimates: &verdict.estimates,
            summary: verdict.summary,
            actuators: verdict.actuators,
            link: Link {
                sensor: ran.sensor_status,
                display: ran.display_status,
            },
            faults: Vec::new(),
            contact: None,
            events: Vec::new(),
        }
    }
}

/// The JSON of several runs: a list, indented, a line for each estimate, closed by a line break. It is written object by
/// object, so that none has to be kept.
#[derive(Debug, Default)]
pub struct JsonList {
    begun: bool,
}

impl JsonList {
    /// Writes the next run.
    pub fn write(&mut self, result: &SceneResult, out: &mut impl Write) -> io::Result<()> {
        let begun = std::mem::replace(&mut self.begun, true);
        out.write_all(if begun { b",\n  " } else { b"[\n  " })?;
        let mut out = serde_json::Serializer::with_formatter(out, Lines::in_a_list());
        Ok(result.serialize(&mut out)?)
    }

    /// The text to be written at the end.
    pub fn end(&self) -> &'static str {
        if self.begun { "\n]\n" } else { "[]\n" }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use hil_sim_core::judge::judge;
    use hil_sim_core::judge::synthetic::Run;
    use hil_sim_core::judge::truth::Truth;

    /// The list, written at once.
    fn to_json(results: &[SceneResult]) -> serde_json::Result<String> {
        let mut bytes = Vec::new();
        let mut out = serde_json::Serializer::with_formatter(&mut bytes, Lines::default());
        results.serialize(&mut out)?;
        bytes.push(b'\n');
        // A serializer of JSON writes nothing but UTF-8.
        String::from_utf8(bytes).map_err(serde::ser::Error::custom)
    }

    fn parsed(run: &Run) -> Value {
        let truth = Truth::new("a scene", "counting", &*run.surface_mm);
        let recording = run.record();
        let verdict = judge(&truth, &recording);
        let text = to_json(&[SceneResult::new(
            truth.name,
            truth.method,
            &recording.ran(),
            &verdict,
        )])
        .unwrap();
        serde_json::from_str(&text).unwrap()
    }

    fn keys(value: &Value) -> Vec<&str> {
        value
            .as_object()
            .unwrap()
            .keys()
            .map(String::as_str)
            .collect()
    }

    #[test]
    fn a_scene_has_the_contracts_names() {
        let json = parsed(&Run::steady(50.0, 2.0));
        let scene = &json[0];
        assert_eq!(scene["name"], "a scene");
        assert_eq!(scene["engine"], "native");
        assert_eq!(scene["method"], "counting");
        assert_eq!(scene["hash"], "0123456789abcdef");
        assert_eq!(scene["realtime_factor"], 2_000.0);
        assert_eq!(scene["faults"], json!([]));
        assert_eq!(scene["link"], json!({ "sensor": null, "display": null }));
        assert_eq!(
            scene["estimates"][0],
            json!({
                "t_s": 0.01,
                "truth_mm": 2.0,
                "wavelength_mm": 2.0,
                "confidence": 0.75,
                "valid": true,
                "counted_mm": 2.25,
                "range": "T1",
                "amplitude_lsb": 400.0,
                "contact": "slip",
                "lag_um": null,
                "gauges_used": [0, 2, 3, 4],
                "health": ["good", "dead", "good", "good", "good"]
            })
        );
        let summary = keys(&scene["summary"]);
        for name in [
            "rms_percent",
            "bias_percent",
            "mean_mm",
            "valid_share",
            "wrong_share",
            "counted_rms_percent",
            "settling_ms",
            "latency_ms",
            "felt_right_share",
            "felt_wrong_share",
            "rendering_needed",
        ] {
            assert!(summary.contains(&name), "{name}");
        }
        let actuators = keys(&scene["actuators"]);
        for name in [
            "frequency_hz",
            "truth_hz",
            "phase_error_rms_cycles",
            "max_step_v",
            "mean_v",
            "skew_us",
        ] {
            assert!(actuators.contains(&name), "{name}");
        }
    }

    #[test]
    fn a_list_written_piece_by_piece_is_the_list_written_at_once() {
        let run = Run::steady(50.0, 2.0);
        let truth = Truth::new("a scene", "counting", &*run.surface_mm);
        let recording = run.record();
        let verdict = judge(&truth, &recording);
        let results: Vec<SceneResult> = (0..3)
            .map(|_| SceneResult::new(truth.name, truth.method, &recording.ran(), &verdict))
            .collect();
        for count in 0..=3 {
            let mut list = JsonList::default();
            let mut text = Vec::new();
            for result in &results[..count] {
                list.write(result, &mut text).unwrap();
            }
            text.extend(list.end().bytes());
            assert_eq!(text, to_json(&results[..count]).unwrap().into_bytes());
        }
    }

    #[test]
    fn what_was_not_measured_is_null() {
        let json = parsed(&Run {
            duration_s: 0.0,
            ..Run::steady(50.0, 2.0)
        });
        let numbers = |part: &str| json[0][part].as_object().unwrap().clone();
        assert!(numbers("summary").values().all(Value::is_null));
        assert!(numbers("actuators").values().all(Value::is_null));
    }
}
