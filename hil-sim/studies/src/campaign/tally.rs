//! What came of all trials of a kind, and of the campaign as a whole.

use serde::Serialize;

use super::Trial;
use hil_sim_core::scene::fault::Kind;

/// Share of the faults that are to be seen that have to be.
const SEEN_SHARE: f64 = 0.99;

/// All trials of a kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tally {
    /// The kind's name.
    pub kind: &'static str,
    /// What is expected of the display: `stops`, `fades`, `holds` or `sensor`.
    pub expected: &'static str,
    /// Faults injected.
    pub injected: usize,
    /// Of these, how many met a stimulus that was on.
    pub driving: usize,
    /// Whether a sign of it is asked for.
    pub is_to_be_seen: bool,
    /// How many showed.
    pub seen: usize,
    /// Time to the first sign in ms: the median and the longest.
    pub detected_ms: Option<[f64; 2]>,
    /// Whether it could put out a wrong voltage, and within which time in ms 0 V is asked for.
    pub safe_within_ms: Option<f64>,
    /// How many of them had come to 0 V in that time.
    pub safe: usize,
    /// Time to 0 V in ms: the median and the longest.
    pub safe_ms: Option<[f64; 2]>,
    /// Outputs stuck, of all trials.
    pub stuck: usize,
    /// Resets of the display, of all trials.
    pub resets: usize,
    /// How many drove again before the power went.
    pub drove_again: usize,
    /// How many restarted against the table.
    pub restarts: usize,
    /// How many were in any way not as the table has it.
    pub unmet: usize,
}

impl Tally {
    /// The trials of `kind`.
    pub fn of(kind: Kind, trials: &[Trial]) -> Self {
        let row = kind.row();
        let findings = || {
            trials
                .iter()
                .map(|trial| &trial.finding)
                .filter(|finding| finding.fault.kind == kind)
        };
        Self {
            kind: row.name,
            expected: row.class.name(),
            injected: findings().count(),
            driving: findings().filter(|finding| finding.was_driving).count(),
            is_to_be_seen: !row.signs.is_empty(),
            seen: findings()
                .filter(|finding| finding.detected_ns.is_some())
                .count(),
            detected_ms: middle_and_worst(findings().filter_map(|f| f.detected_ms()).collect()),
            safe_within_ms: row.safe_within_ms,
            safe: findings()
                .filter_map(|finding| Some((finding.safe_ms()?, row.safe_within_ms?)))
                .filter(|(ms, within_ms)| ms <= within_ms)
                .count(),
            safe_ms: middle_and_worst(findings().filter_map(|f| f.safe_ms()).collect()),
            stuck: findings().map(|finding| finding.stuck).sum(),
            resets: findings().map(|finding| finding.resets).sum(),
            drove_again: findings().filter(|finding| finding.drives_again).count(),
            restarts: findings()
                .filter(|finding| finding.is_restart_against_the_table())
                .count(),
            unmet: trials
                .iter()
                .filter(|trial| trial.finding.fault.kind == kind && !trial.unmet().is_empty())
                .count(),
        }
    }
}

fn middle_and_worst(mut numbers: Vec<f64>) -> Option<[f64; 2]> {
    numbers.sort_by(f64::total_cmp);
    let worst = *numbers.last()?;
    let middle = f64::midpoint(numbers[(numbers.len() - 1) / 2], numbers[numbers.len() / 2]);
    Some([middle, worst])
}

/// The campaign's goals that are not met, one a line.
pub fn unmet(tallies: &[Tally]) -> Vec<String> {
    let mut unmet = Vec::new();
    let to_be_seen = || tallies.iter().filter(|tally| tally.is_to_be_seen);
    let seen: usize = to_be_seen().map(|tally| tally.seen).sum();
    let injected: usize = to_be_seen().map(|tally| tally.injected).sum();
    if (seen as f64) < SEEN_SHARE * injected as f64 {
        unmet.push(format!("seen: {seen} of {injected}, below 99 %"));
    }
    for tally in tallies {
        let kind = tally.kind;
        let injected = tally.injected;
        if tally.driving < injected {
            unmet.push(format!(
                "{kind}: the stimulus was on in {} of {injected}",
                tally.driving
            ));
        }
        if tally.unmet > 0 {
            unmet.push(format!(
                "{kind}: {} of {injected} not as the table has it",
                tally.unmet
            ));
        }
    }
    unmet
}
