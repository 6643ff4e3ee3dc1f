//! JUnit XML of runs, for whatever shows test results: a case for each scene, in one suite for the engine.

use std::time::Duration;

use quick_junit::{NonSuccessKind, Report, SerializeError, TestCase, TestCaseStatus, TestSuite};

use hil_sim_core::run::recording::Engine;

/// What became of a scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Fate {
    /// It ran.
    Ran {
        /// Wall time in s.
        wall_s: f64,
        /// The run's hash.
        hash: u64,
        /// The line that was printed of it.
        row: String,
        /// A line for each expectation that was not met.
        unmet: Vec<String>,
    },
    /// It could not be run, and why.
    Unusable(String),
    /// It was not run, because another one could not be.
    Skipped,
}

/// A scene, and what became of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The scene's file.
    pub file: String,
    /// The scene's name; the file's if it could not be read.
    pub name: String,
    /// What became of it.
    pub fate: Fate,
}

/// The report on these scenes.
///
/// # Errors
/// None in practice: text is written to memory.
pub fn xml(engine: Engine, cases: &[Case]) -> Result<String, SerializeError> {
    let mut suite = TestSuite::new(format!("hil-sim {}", engine.name()));
    suite.add_test_cases(cases.iter().map(case));
    let mut report = Report::new("hil-sim");
    report.add_test_suite(suite);
    report.to_string()
}

fn case(case: &Case) -> TestCase {
    let status = match &case.fate {
        Fate::Ran { unmet, .. } if unmet.is_empty() => TestCaseStatus::success(),
        Fate::Ran { unmet, .. } => {
            let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
            status
                .set_type("not as expected")
                .set_message(unmet.join("; "))
                .set_description(unmet.join("\n"));
            status
        }
        Fate::Unusable(reason) => {
            let mut status = TestCaseStatus::non_success(NonSuccessKind::Error);
            status
                .set_type("cannot be used")
                .set_message(reason.clone());
            status
        }
        Fate::Skipped => {
            let mut status = TestCaseStatus::skipped();
            status.set_message("another scene cannot be used");
            status
        }
    };
    let mut test = TestCase::new(case.name.clone(), status);
    test.set_classname(case.file.clone());
    test.add_property(("file", case.file.as_str()));
    if let Fate::Ran {
        wall_s, hash, row, ..
    } = &case.fate
    {
        test.set_time(Duration::try_from_secs_f64(*wall_s).unwrap_or_default());
        test.add_property(("hash", format!("{hash:016x}").as_str()));
        test.set_system_out(row.clone());
    }
    test
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_fate_is_a_case_that_can_be_read_back() {
        let of = |name: &str, fate| Case {
            file: format!("scenes/{name}.toml"),
            name: name.to_owned(),
            fate,
        };
        let ran = |unmet: &[&str]| Fate::Ran {
            wall_s: 0.25,
            hash: 0xabc,
            row: "a <row> & \u{1b}more".to_owned(),
            unmet: unmet.iter().map(|&line| line.to_owned()).collect(),
        };
        let text = xml(
            Engine::Native,
            &[
                of("good", ran(&[])),
                of("bad", ran(&["mean_mm: 3 is not \"within\" 1 & 2", "x: y"])),
                of("ugly", Fate::Unusable("x.toml:1: <name>".to_owned())),
                of("other", Fate::Skipped),
            ],
        )
        .unwrap();
        let report = Report::deserialize_from_str(&text).unwrap();
        let suite = &report.test_suites[0];
        assert_eq!(suite.name.as_str(), "hil-sim native");
        assert_eq!((suite.tests, suite.failures, suite.errors), (4, 1, 1));
        assert!(text.contains("skipped=\"1\""), "{text}");
        assert!(text.contains("time=\"0.250\""), "{text}");
        assert!(text.contains("0000000000000abc"), "{text}");
        assert!(
            text.contains("3 is not &quot;within&quot; 1 &amp; 2; x: y"),
            "{text}"
        );
    }
}
