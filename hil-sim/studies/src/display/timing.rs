//! When the display's outputs change: LDAC edges against the tick, channels against one another, and the
//! time from a movement of the hand to the output that carries it, whatever the link does.

pub mod picture;

use protocol::{DisplayConfiguration, Mode, UpdateRate};
use serde::Serialize;

use crate::study::{Fixed, Short, Study, Table, csv_text, number, remark};
use hil_sim_boards::display_alone;
use hil_sim_boards::display_alone::DisplayBench;
use hil_sim_boards::{ElfError, Firmware};
use hil_sim_core::judge::actuators;
use hil_sim_core::judge::edges::{Edges, edges};
use hil_sim_core::judge::reaction::Reaction;
use hil_sim_core::judge::truth::Truth;
use hil_sim_core::run::batch::on_all_cores;
use hil_sim_core::scene::{Link, Motion};

/// The longest that 99 % of a hand's movement may take to the outputs at 2 kHz, in ms.
pub const GOAL_MS: f64 = 0.6;
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
    /// Updates per second.
    pub rate_hz: u32,
    /// What became of the estimates on their way.
    pub link: Link,
    /// The LDAC edges.
    pub edges: Edges,
    /// From the hand to the outputs, as [`hil_sim_core::judge::reaction`] defines it.
    pub reaction: Reaction,
    /// Estimates sent, and of them those that arrived.
    pub estimates: (usize, usize),
    /// Ticks that were not done in time, as the board counts them.
    pub deadline_misses: u32,
}

/// The links looked at: delays, and 20 % loss with 50 ms jitter on some.
fn links(quick: bool) -> Vec<Link> {
    let late = |delay_ms: f64| Link {
        delay_ms,
        ..Link::default()
    };
    let bad = |delay_ms: f64| Link {
        delay_ms,
        jitter_ms: 50.0,
        loss: 0.2,
        ..Link::default()
    };
    if quick {
        return vec![late(0.0), bad(100.0)];
    }
    [0.0, 10.0, 50.0, 100.0, 200.0, 500.0]
        .map(late)
        .into_iter()
        .chain([0.0, 100.0, 500.0].map(bad))
        .collect()
}

/// Measures all rows, on all cores. `done` is told after each of [`runs`].
///
/// # Errors
/// If the ELF can't be run.
pub fn measure(
    firmware: &Firmware,
    quick: bool,
    done: impl Fn() + Sync,
) -> Result<Vec<Row>, ElfError> {
    let plans: Vec<(UpdateRate, Link)> = [UpdateRate::Hz2000, UpdateRate::Hz4000]
        .into_iter()
        .flat_map(|rate| links(quick).into_iter().map(move |link| (rate, link)))
        .collect();
    let rows = on_all_cores(&plans, |&(rate, link)| {
        let row = row(firmware, rate, link, quick);
        done();
        row
    })?;
    Ok(rows)
}

/// How many runs [`measure`] makes.
pub fn runs(quick: bool) -> u64 {
    2 * links(quick).len() as u64
}

fn row(firmware: &Firmware, rate: UpdateRate, link: Link, quick: bool) -> Result<Row, ElfError> {
    let configuration = DisplayConfiguration {
        mode: Mode::Travelling,
        update_rate: rate,
        ..DisplayConfiguration::DEFAULT
    };
    let duration_s = if quick { 1.5 } else { 8.0 };
    let run = display_alone::run(
        DisplayBench {
            configuration,
            link,
            ..DisplayBench::new(STROKE, WAVELENGTH_MM, duration_s)
        },
        firmware,
    )?;
    let surface = |_| WAVELENGTH_MM;
    let mut truth = Truth::new("timing", "", &surface);
    truth.display = configuration;
    let recording = &run.recording;
    let silent = || ElfError::Configuration {
        board: "display",
        reason: "its outputs never changed".to_owned(),
    };
    Ok(Row {
        rate_hz: rate.hz(),
        link,
        edges: edges(&recording.ticks, &recording.outputs, FROM_NS).ok_or_else(silent)?,
        reaction: actuators::judge(&truth, recording)
            .hand_to_output
            .ok_or_else(silent)?,
        estimates: (
            recording.estimates.len(),
            recording
                .estimates
                .iter()
                .filter(|estimate| estimate.received_ns.is_some())
                .count(),
        ),
        deadline_misses: match recording.display_status.map(|status| status.role) {
            Some(protocol::RoleCounters::Display(counters)) => counters.deadline_misses,
            _ => 0,
        },
    })
}

/// Whether a row meets what is asked of it.
pub fn is_met(row: &Row) -> bool {
    row.rate_hz != 2_000 || row.reaction.p99_ms <= GOAL_MS
}

#[derive(Serialize)]
struct Record {
    rate_hz: u32,
    delay_ms: Short,
    jitter_ms: Short,
    loss: Short,
    edges: usize,
    edge_after_tick_p50_us: Fixed<3>,
    jitter_p50_us: Fixed<3>,
    jitter_p99_us: Fixed<3>,
    jitter_max_us: Fixed<3>,
    skew_us: Fixed<3>,
    hand_to_output_p50_ms: Fixed<4>,
    hand_to_output_p99_ms: Fixed<4>,
    hand_to_output_max_ms: Fixed<4>,
    estimates_sent: usize,
    estimates_arrived: usize,
    deadline_misses: u32,
}

impl Study for [Row] {
    const NAME: &'static str = "timing";

    fn table(&self) -> Option<Table> {
        let mut table = Table::new(&[
            "rate, Hz:",
            "delay, ms:",
            "jitter, ms:",
            "loss, %:",
            "LDAC after tick, µs:",
            "its jitter p50, µs:",
            "p99:",
            "longest:",
            "skew, µs:",
            "hand to output p50, ms:",
            "p99:",
            "longest:",
            "estimates arrived:",
        ]);
        for row in self {
            let (edges, reaction) = (&row.edges, &row.reaction);
            let cells = [
                row.rate_hz.to_string(),
                row.link.delay_ms.to_string(),
                row.link.jitter_ms.to_string(),
                number(100.0 * row.link.loss, 0),
                number(edges.after.p50_us, 2),
                number(edges.jitter.p50_us, 3),
                number(edges.jitter.p99_us, 3),
                number(edges.jitter.max_us, 3),
                number(edges.skew_us, 3),
                number(reaction.p50_ms, 3),
                number(reaction.p99_ms, 3),
                number(reaction.max_ms, 3),
                format!("{} of {}", row.estimates.1, row.estimates.0),
            ];
            table.row_with(cells, remark(is_met(row)));
        }
        Some(table)
    }

    fn csvs(&self) -> Result<Vec<(&'static str, String)>, csv::Error> {
        let records = self.iter().map(|row| Record {
            rate_hz: row.rate_hz,
            delay_ms: Short(row.link.delay_ms),
            jitter_ms: Short(row.link.jitter_ms),
            loss: Short(row.link.loss),
            edges: row.edges.after_us.len(),
            edge_after_tick_p50_us: row.edges.after.p50_us.into(),
            jitter_p50_us: row.edges.jitter.p50_us.into(),
            jitter_p99_us: row.edges.jitter.p99_us.into(),
            jitter_max_us: row.edges.jitter.max_us.into(),
            skew_us: row.edges.skew_us.into(),
            hand_to_output_p50_ms: row.reaction.p50_ms.into(),
            hand_to_output_p99_ms: row.reaction.p99_ms.into(),
            hand_to_output_max_ms: row.reaction.max_ms.into(),
            estimates_sent: row.estimates.0,
            estimates_arrived: row.estimates.1,
            deadline_misses: row.deadline_misses,
        });
        Ok(vec![("", csv_text(records)?)])
    }

    fn picture(&self) -> String {
        picture::draw(self)
    }

    fn is_met(&self) -> bool {
        self.iter().all(is_met)
    }
}
