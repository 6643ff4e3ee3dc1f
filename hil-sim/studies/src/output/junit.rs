//! JUnit XML of runs, for whatever shows test results: a case for each scene, in one suite for the engine.

use std::path::Path;
use std::time::Duration;

pub use quick_junit::TestCase;
use quick_junit::{NonSuccessKind, Report, SerializeError, TestCaseStatus, TestSuite};

use hil_sim_core::run::recording::Engine;

/// What became of a scene.
pub enum Fate<'a> {
    /// It ran.
    Ran {
        /// Wall time in s.
        wall_s: f64,
        /// The run's hash.
        hash: u64,
        /// The line that was printed of it.
        row: &'a str,
        /// A line for each expectation that was not met.
        unmet: &'a [String],
    },
    /// It could not be run, and why.
    Unusable(&'a str),
    /// It was not run, because another one could not be.
    Skipped,
}

/// The report on these cases.
pub fn xml(
    engine: Engine,
    cases: impl IntoIterator<Item = TestCase>,
) -> Result<String, SerializeError> {
    let mut suite = TestSuite::new(format!("hil-sim {}", engine.name()));
    suite.add_test_cases(cases);
    let mut report = Report::new("hil-sim");
    report.add_test_suite(suite);
    report.to_string()
}

/// The case of a scene's file, and of its name, which is the file's if it could not be read.
pub fn case(file: &Path, name: &str, fate: &Fate) -> TestCase {
    let not_passed = |kind, what: &str, message: String| {
        let mut status = TestCaseStatus::non_success(kind);
        status.set_type(what).set_message(message);
        status
    };
    let status = match fate {
        Fate::Ran { unmet: [], .. } => TestCaseStatus::success(),
        Fate::Ran { unmet, .. } => {
            let kind = NonSuccessKind::Failure;
            let mut status = not_passed(kind, "not as expected", unmet.join("; "));
            status.set_description(unmet.join("\n"));
            status
        }
        Fate::Unusable(reason) => not_passed(
            NonSuccessKind::Error,
            "cannot be used",
            (*reason).to_owned(),
        ),
        Fate::Skipped => {
            let mut status = TestCaseStatus::skipped();
            status.set_message("another scene cannot be used");
            status
        }
    };
    let file = file.display().to_string();
    let mut test = TestCase::new(name, status);
    test.add_property(("file", file.as_str()));
    test.set_classname(file);
    if let Fate::Ran {
        wall_s, hash, row, ..
    } = fate
    {
        test.set_time(Duration::try_from_secs_f64(*wall_s).unwrap_or_default());
        test.add_property(("hash", format!("{hash:016x}").as_str()));
        test.set_system_out(*row);
    }
    test
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_fate_is_a_case_that_can_be_read_back() {
        let of = |name: &str, fate| case(format!("scenes/{name}.toml").as_ref(), name, &fate);
        let unmet = ["mean_mm: 3 is not \"within\" 1 & 2", "x: y"].map(str::to_owned);
        let ran = |unmet| Fate::Ran {
            wall_s: 0.25,
            hash: 0xabc,
            row: "a <row> & \u{1b}more",
            unmet,
        };
        let text = xml(
            Engine::Native,
            [
                of("good", ran(&[])),
                of("bad", ran(&unmet)),
                of("ugly", Fate::Unusable("x.toml:1: <name>")),
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
