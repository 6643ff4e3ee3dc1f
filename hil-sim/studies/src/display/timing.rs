//! When the display's outputs change: LDAC edges against the tick, channels against one another, and the
//! time from a movement of the hand to the output that carries it, whatever the link does.

pub mod picture;

use protocol::{DisplayConfiguration, Mode, UpdateRate};

use hil_sim_boards::display_alone;
use hil_sim_boards::display_alone::Alone;
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
        Alone {
            configuration,
            link,
            ..Alone::new(STROKE, WAVELENGTH_MM, duration_s)
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

/// The rows as CSV.
///
/// # Errors
/// None in practice: it is written to memory.
pub fn csv(rows: &[Row]) -> Result<String, csv::Error> {
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record([
        "rate_hz",
        "delay_ms",
        "jitter_ms",
        "loss",
        "edges",
        "edge_after_tick_p50_us",
        "jitter_p50_us",
        "jitter_p99_us",
        "jitter_max_us",
        "skew_us",
        "hand_to_output_p50_ms",
        "hand_to_output_p99_ms",
        "hand_to_output_max_ms",
        "estimates_sent",
        "estimates_arrived",
        "deadline_misses",
    ])?;
    for row in rows {
        let edges = &row.edges;
        table.write_record([
            row.rate_hz.to_string(),
            row.link.delay_ms.to_string(),
            row.link.jitter_ms.to_string(),
            row.link.loss.to_string(),
            edges.after_us.len().to_string(),
            format!("{:.3}", edges.after.p50_us),
            format!("{:.3}", edges.jitter.p50_us),
            format!("{:.3}", edges.jitter.p99_us),
            format!("{:.3}", edges.jitter.max_us),
            format!("{:.3}", edges.skew_us),
            format!("{:.4}", row.reaction.p50_ms),
            format!("{:.4}", row.reaction.p99_ms),
            format!("{:.4}", row.reaction.max_ms),
            row.estimates.0.to_string(),
            row.estimates.1.to_string(),
            row.deadline_misses.to_string(),
        ])?;
    }
    super::finish_csv(table)
}
