//! What became of a fault, beside its row of the table.

use crate::scene::fault::{Fault, Row, nanoseconds};

/// What became of one fault.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The fault.
    pub fault: Fault,
    /// Whether the stimulus was on when it began.
    pub was_driving: bool,
    /// From its beginning to the first sign of it, in ns.
    pub detected_ns: Option<u64>,
    /// What the sign was; empty if there was none.
    pub sign: String,
    /// From its beginning until all outputs were at 0 V and stayed there for the rest of it, in ns.
    pub safe_ns: Option<u64>,
    /// Outputs that were not at 0 V when they had to be, or stood at another voltage.
    pub stuck: usize,
    /// Of these, those that stood at another voltage.
    pub standing: usize,
    /// Whether any output was driven after the fault had been answered by 0 V.
    pub drives_again: bool,
    /// From its end until the display drove again, in ns.
    pub again_ns: Option<u64>,
    /// Resets of the display board until the next fault.
    pub resets: usize,
    /// Of these, how many may come of other faults.
    pub(super) resets_of_others: usize,
    /// What is not judged, each with the reason.
    pub unjudged: Vec<String>,
    /// Whether it is one that has to be seen and answered: long enough, and great enough.
    pub(super) must_show: bool,
    /// Whether the display has said that it has stopped, for a reason that the kind has.
    pub(super) has_stopped: bool,
    /// It is a Stop that the display never hears: what the outputs do has other reasons.
    pub(super) is_unheard: bool,
    /// Why it need not be seen in time all the same.
    pub(super) unseen: Option<&'static str>,
    /// From its beginning until nobody looks on any more, in ns.
    pub(super) left_ns: u64,
    /// What else is not as the table of kinds has it.
    pub(super) otherwise: Vec<String>,
}

impl Finding {
    /// What is not as the table of kinds has it.
    pub fn unmet(&self) -> Vec<String> {
        if self.is_unheard {
            return self.otherwise.clone();
        }
        let row = self.fault.kind.row();
        let mut unmet = Vec::new();
        if self.must_show {
            self.must_be_answered(row, &mut unmet);
        }
        // What need not be seen must do no harm either.
        let stuck = if self.must_show {
            self.stuck
        } else {
            self.standing
        };
        if stuck > 0 {
            unmet.push(format!("{stuck} outputs stuck"));
        }
        // What nobody has seen is over without a stop, and so is what CLR alone has answered.
        let is_answered = self.must_show || self.has_stopped || self.resets > self.resets_of_others;
        if is_answered && self.is_restart_against_the_table() {
            let again = if self.drives_again {
                ", drives again"
            } else {
                ""
            };
            unmet.push(format!(
                "restarted against the table: {} resets{again}",
                self.resets
            ));
        }
        unmet.extend_from_slice(&self.otherwise);
        unmet
    }

    /// Whether it was seen, and the outputs were at 0 V, in time.
    fn must_be_answered(&self, row: &Row, unmet: &mut Vec<String>) {
        if let Some(within_ms) = self.fault.seen_within_ms()
            && self.unseen.is_none()
        {
            match self.detected_ms() {
                None => unmet.push("no sign of it".to_owned()),
                Some(ms) if ms > within_ms => {
                    unmet.push(format!("{} after {ms:.2} ms of {within_ms}", self.sign));
                }
                Some(_) => {}
            }
        }
        if let Some(within_ms) = row.safe_within_ms {
            match self.safe_ms() {
                None if self.left_ns < nanoseconds(within_ms * 1e-3) => {}
                None => unmet.push("outputs not at 0 V".to_owned()),
                Some(ms) if ms > within_ms => {
                    unmet.push(format!("0 V after {ms:.2} ms of {within_ms}"));
                }
                Some(_) => {}
            }
        }
    }

    /// [`Finding::detected_ns`] in ms.
    pub fn detected_ms(&self) -> Option<f64> {
        self.detected_ns.map(|ns| ns as f64 * 1e-6)
    }

    /// [`Finding::safe_ns`] in ms.
    pub fn safe_ms(&self) -> Option<f64> {
        self.safe_ns.map(|ns| ns as f64 * 1e-6)
    }

    /// Whether the display drove again where it must not, or was reset more often than it may.
    pub fn is_restart_against_the_table(&self) -> bool {
        let row = self.fault.kind.row();
        self.resets > row.resets + self.resets_of_others
            || (self.drives_again && !row.class.may_drive_again())
    }
}
