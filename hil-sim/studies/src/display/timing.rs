//! When the display's outputs change: LDAC edges against the tick, channels against one another, and the
//! time from a movement of the hand to the output that carries it, whatever the link does.

mod picture;

use protocol::{Mode, RoleCounters, UpdateRate};

use super::{bad, configured, late};
use crate::study::{Progress, Record, Study, Table, csv, fixed, number, short};
use hil_sim_boards::display_alone::{self, DisplayBench};
use hil_sim_boards::{ElfError, Firmware};
use hil_sim_core::judge::actuators;
use hil_sim_core::judge::edges::{Edges, edges};
use hil_sim_core::judge::reaction::Reaction;
use hil_sim_core::judge::truth::Truth;
use hil_sim_core::scene::{Link, Motion};

/// The longest that 99 % of a hand's movement may take to the outputs at 2 kHz.
const GOAL_MS: f64 = 0.6;
/// The stroke of the paper's figure 7, over λ.
pub(super) const STROKE: Motion = Motion::Sinusoid {
    amplitude_mm_s: 70.0,
    frequency_hz: 0.83,
};
pub(super) const WAVELENGTH_MM: f64 = 2.0;
/// Edges before this are not looked at: the board starts.
const FROM_NS: u64 = 100_000_000;

/// A link, and what came of it.
#[derive(Clone, Debug)]
pub struct Row {
    rate_hz: u32,
    link: Link,
    edges: Edges,
    reaction: Reaction,
    /// Estimates sent, and of them those that arrived.
    estimates: (usize, usize),
    deadline_misses: u32,
}

/// Measures all rows: delays, and 20 % loss with 50 ms jitter on some.
pub fn measure(
    firmware: &Firmware,
    quick: bool,
    progress: &impl Progress,
) -> Result<Vec<Row>, ElfError> {
    let links = if quick {
        vec![late(0.0), bad(100.0)]
    } else {
        let fair = [0.0, 10.0, 50.0, 100.0, 200.0, 500.0].map(late);
        [&fair[..], &[0.0, 100.0, 500.0].map(bad)].concat()
    };
    let of_rate = |rate| links.iter().map(move |&link| (rate, link));
    let rates = [UpdateRate::Hz2000, UpdateRate::Hz4000];
    let plans: Vec<(UpdateRate, Link)> = rates.into_iter().flat_map(of_rate).collect();
    progress.begin(plans.len());
    progress.each(&plans, |&(rate, link)| row(firmware, rate, link, quick))
}

fn row(firmware: &Firmware, rate: UpdateRate, link: Link, quick: bool) -> Result<Row, ElfError> {
    let configuration = configured(Mode::Travelling, rate);
    let bench = DisplayBench {
        configuration,
        link,
        ..DisplayBench::new(STROKE, WAVELENGTH_MM, if quick { 1.5 } else { 8.0 })
    };
    let recording = display_alone::run(bench, firmware)?.recording;
    let surface = |_| WAVELENGTH_MM;
    let mut truth = Truth::new("timing", "", &surface);
    truth.display = configuration;
    let silent = || ElfError::Configuration {
        board: "display",
        reason: "its outputs never changed".to_owned(),
    };
    let reaction = actuators::judge(&truth, &recording).hand_to_output;
    let estimates = &recording.estimates;
    let arrived = estimates.iter().filter(|e| e.received_ns.is_some()).count();
    Ok(Row {
        rate_hz: rate.hz(),
        link,
        edges: edges(&recording.ticks, &recording.outputs, FROM_NS).ok_or_else(silent)?,
        reaction: reaction.ok_or_else(silent)?,
        estimates: (estimates.len(), arrived),
        deadline_misses: match recording.display_status.map(|status| status.role) {
            Some(RoleCounters::Display(counters)) => counters.deadline_misses,
            _ => 0,
        },
    })
}

impl Row {
    fn is_met(&self) -> bool {
        self.rate_hz != 2_000 || self.reaction.p99_ms <= GOAL_MS
    }
}

impl Study for Vec<Row> {
    const NAME: &'static str = "timing";

    fn table(&self) -> Option<Table> {
        let rows = self.iter().map(|row| {
            let (edges, reaction) = (&row.edges, &row.reaction);
            let (sent, arrived) = row.estimates;
            Record::default()
                .with("rate, Hz:", short(row.rate_hz))
                .with("delay, ms:", short(row.link.delay_ms))
                .with("jitter, ms:", short(row.link.jitter_ms))
                .with("loss, %:", number(100.0 * row.link.loss, 0))
                .with("LDAC after tick, µs:", number(edges.after.p50_us, 2))
                .with("its jitter p50, µs:", number(edges.jitter.p50_us, 3))
                .with("p99:", number(edges.jitter.p99_us, 3))
                .with("longest:", number(edges.jitter.max_us, 3))
                .with("skew, µs:", number(edges.skew_us, 3))
                .with("hand to output p50, ms:", number(reaction.p50_ms, 3))
                .with("p99:", number(reaction.p99_ms, 3))
                .with("longest:", number(reaction.max_ms, 3))
                .with("estimates arrived:", format!("{arrived} of {sent}"))
                .judged(row.is_met())
        });
        Some(rows.collect())
    }

    fn csvs(&self) -> Vec<(&'static str, String)> {
        let rows = self.iter().map(|row| {
            let (edges, reaction) = (&row.edges, &row.reaction);
            Record::default()
                .with("rate_hz", short(row.rate_hz))
                .with("delay_ms", short(row.link.delay_ms))
                .with("jitter_ms", short(row.link.jitter_ms))
                .with("loss", short(row.link.loss))
                .with("edges", short(edges.after_us.len()))
                .with("edge_after_tick_p50_us", fixed(edges.after.p50_us, 3))
                .with("jitter_p50_us", fixed(edges.jitter.p50_us, 3))
                .with("jitter_p99_us", fixed(edges.jitter.p99_us, 3))
                .with("jitter_max_us", fixed(edges.jitter.max_us, 3))
                .with("skew_us", fixed(edges.skew_us, 3))
                .with("hand_to_output_p50_ms", fixed(reaction.p50_ms, 4))
                .with("hand_to_output_p99_ms", fixed(reaction.p99_ms, 4))
                .with("hand_to_output_max_ms", fixed(reaction.max_ms, 4))
                .with("estimates_sent", short(row.estimates.0))
                .with("estimates_arrived", short(row.estimates.1))
                .with("deadline_misses", short(row.deadline_misses))
        });
        vec![("", csv(rows))]
    }

    fn picture(&self) -> String {
        picture::draw(self)
    }

    fn is_met(&self) -> bool {
        self.iter().all(Row::is_met)
    }
}
