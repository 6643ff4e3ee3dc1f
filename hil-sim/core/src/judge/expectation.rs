//! A scene's `[expect]` against what was measured.

use crate::judge::Verdict;
use crate::scene::Expect;

/// A line for each expectation that the verdict does not meet, its key first ([`keys_of`]). What could not be measured meets none.
pub fn unmet(expect: &Expect, verdict: &Verdict) -> Vec<String> {
    let (summary, actuators) = (&verdict.summary, &verdict.actuators);
    let frequency_percent = match (actuators.frequency_hz, actuators.truth_hz) {
        (Some(measured), Some(truth)) if truth > 0.0 => Some(100.0 * (measured - truth) / truth),
        _ => None,
    };
    let most = |bound: f64| -bound..=bound;
    let checks = [
        (
            "wavelength_rms_percent",
            expect.wavelength_rms_percent.map(most),
            summary.rms_percent,
        ),
        (
            "wavelength_bias_percent",
            expect.wavelength_bias_percent.map(most),
            summary.bias_percent,
        ),
        (
            "mean_mm",
            expect
                .mean_mm
                .map(|mean| mean - expect.mean_tolerance_mm..=mean + expect.mean_tolerance_mm),
            summary.mean_mm,
        ),
        (
            "valid_share_min",
            expect.valid_share_min.map(|least| least..=1.0),
            summary.valid_share,
        ),
        (
            "wrong_share_max",
            expect.wrong_share_max.map(|most| 0.0..=most),
            summary.wrong_share,
        ),
        (
            "felt_right_share_min",
            expect.felt_right_share_min.map(|least| least..=1.0),
            summary.felt_right_share,
        ),
        (
            "felt_wrong_share_max",
            expect.felt_wrong_share_max.map(|most| 0.0..=most),
            summary.felt_wrong_share,
        ),
        (
            "settling_ms",
            expect.settling_ms.map(most),
            summary.settling_ms,
        ),
        (
            "latency_ms",
            expect.latency_ms.map(most),
            summary.latency_ms,
        ),
        (
            "frequency_percent",
            expect.frequency_percent.map(most),
            frequency_percent,
        ),
        (
            "phase_rms_cycles",
            expect.phase_rms_cycles.map(most),
            actuators.phase_error_rms_cycles,
        ),
    ];
    let mut lines = Vec::new();
    for (key, wanted, measured) in checks {
        let Some(wanted) = wanted else { continue };
        let (low, high) = (wanted.start(), wanted.end());
        match measured {
            Some(measured) if wanted.contains(&measured) => {}
            Some(measured) => {
                let (than, bound) = if measured > *high {
                    ("more", *high)
                } else {
                    ("less", *low)
                };
                let [number, bound] = told_apart(measured, bound);
                // The one that is given by its middle is told by both ends.
                let said = if key == "mean_mm" {
                    format!("not within {low:.4} and {high:.4}")
                } else {
                    format!("{than} than {bound}")
                };
                lines.push(format!("{key}: {number} is {said}"));
            }
            None => lines.push(format!("{key}: nothing could be measured")),
        }
    }
    lines
}

/// Two numbers to four digits, or to as many more as tell them apart.
fn told_apart(one: f64, other: f64) -> [String; 2] {
    (4..=17)
        .map(|digits| [one, other].map(|value| rounded(value, digits)))
        .find(|[one, other]| one != other)
        .unwrap_or_else(|| [one, other].map(|value| value.to_string()))
}

/// A number to so many digits.
fn rounded(value: f64, digits: i32) -> String {
    let whole = value.abs().max(1e-9).log10().floor();
    let decimals = (f64::from(digits) - 1.0 - whole).max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    match text.split_once('.') {
        Some(_) => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        None => text,
    }
}

/// The keys of a scene's file that a line is about, as [`crate::scene_file::line::line_of`] takes them: what stands
/// before its colon, a key of `[expect]` or `fault[0] kind`.
pub fn keys_of(line: &str) -> Vec<&str> {
    let key = line.split(':').next().unwrap_or(line);
    match key
        .strip_prefix("fault[")
        .and_then(|rest| rest.split(']').next())
    {
        Some(number) => vec!["fault", number, "kind"],
        None => vec!["expect", key],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict() -> Verdict {
        let mut verdict = Verdict {
            estimates: Vec::new(),
            summary: Default::default(),
            actuators: Default::default(),
        };
        verdict.summary.rms_percent = Some(2.0);
        verdict.summary.bias_percent = Some(-1.5);
        verdict.summary.mean_mm = Some(2.02);
        verdict.summary.valid_share = Some(0.9);
        verdict.summary.wrong_share = Some(0.002);
        verdict.summary.felt_right_share = Some(0.85);
        verdict.summary.felt_wrong_share = Some(0.01);
        verdict.actuators.frequency_hz = Some(25.1);
        verdict.actuators.truth_hz = Some(25.0);
        verdict
    }

    fn expect(change: impl Fn(&mut Expect)) -> Vec<String> {
        let mut expect = Expect {
            mean_tolerance_mm: 0.03,
            ..Expect::default()
        };
        change(&mut expect);
        unmet(&expect, &verdict())
    }

    #[test]
    fn a_number_just_beyond_its_bound_is_told_apart_from_it() {
        assert_eq!(told_apart(0.950_119, 0.950_12), ["0.950119", "0.95012"]);
        assert_eq!(told_apart(2.0, 1.0), ["2", "1"]);
        let next = f64::from_bits(1.0_f64.to_bits() + 1);
        let [one, other] = told_apart(1.0, next);
        assert_ne!(one, other);
    }

    #[test]
    fn a_scene_that_expects_nothing_is_content() {
        assert!(expect(|_| {}).is_empty());
    }

    #[test]
    fn bounds_that_hold_are_silent() {
        let unmet = expect(|e| {
            e.wavelength_rms_percent = Some(2.0);
            e.wavelength_bias_percent = Some(1.5);
            e.mean_mm = Some(2.0);
            e.valid_share_min = Some(0.9);
            e.wrong_share_max = Some(0.002);
            e.felt_right_share_min = Some(0.85);
            e.felt_wrong_share_max = Some(0.01);
            e.frequency_percent = Some(0.5);
        });
        assert!(unmet.is_empty(), "{unmet:?}");
    }

    #[test]
    fn each_bound_that_does_not_hold_has_its_line() {
        let unmet = expect(|e| {
            e.wavelength_rms_percent = Some(1.9);
            e.wavelength_bias_percent = Some(1.4);
            e.mean_mm = Some(2.06);
            e.valid_share_min = Some(0.91);
            e.wrong_share_max = Some(0.001);
            e.felt_right_share_min = Some(0.86);
            e.felt_wrong_share_max = Some(0.009);
            e.frequency_percent = Some(0.3);
        });
        let keys: Vec<&str> = unmet.iter().map(|line| keys_of(line)[1]).collect();
        assert_eq!(
            keys,
            [
                "wavelength_rms_percent",
                "wavelength_bias_percent",
                "mean_mm",
                "valid_share_min",
                "wrong_share_max",
                "felt_right_share_min",
                "felt_wrong_share_max",
                "frequency_percent"
            ]
        );
    }

    #[test]
    fn a_line_says_what_was_measured_and_which_bound_it_is_beyond() {
        for (value, text) in [
            (389.75, "389.8"),
            (0.000_412_36, "0.0004124"),
            (-1.5, "-1.5"),
            (0.0, "0"),
            (123_456.0, "123456"),
        ] {
            assert_eq!(rounded(value, 4), text);
        }
        let unmet = expect(|e| {
            e.wavelength_bias_percent = Some(1.4);
            e.valid_share_min = Some(0.91);
            e.wrong_share_max = Some(0.001);
        });
        assert_eq!(
            unmet,
            [
                "wavelength_bias_percent: -1.5 is less than -1.4",
                "valid_share_min: 0.9 is less than 0.91",
                "wrong_share_max: 0.002 is more than 0.001"
            ]
        );
    }

    #[test]
    fn a_line_leads_to_its_place_in_the_file() {
        assert_eq!(keys_of("mean_mm: 1 is not"), ["expect", "mean_mm"]);
        assert_eq!(
            keys_of("fault[3] link-down: no sign"),
            ["fault", "3", "kind"]
        );
    }

    #[test]
    fn what_could_not_be_measured_is_not_met() {
        let unmet = expect(|e| e.settling_ms = Some(500.0));
        assert_eq!(unmet, ["settling_ms: nothing could be measured"]);
    }
}
