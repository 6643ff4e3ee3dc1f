//! What the voltages do when the hand stops in mid-wave and starts again, from the display's ELF.
//!
//! The hand moves steadily and stops dead at a tick at which the watched channel stands at a crest: the
//! worst place, with the most voltage left standing. Later it starts again. How long the way to 0 V
//! takes is counted from the tick at which the last encoder count was read.

pub mod picture;

use std::sync::Arc;

use protocol::{DisplayConfiguration, Mode, UpdateRate};
use serde::Serialize;

use crate::study::{Fixed, Study, Table, csv_text, number, remark};
use hil_sim_boards::display_alone;
use hil_sim_boards::display_alone::{AloneRun, DisplayBench};
use hil_sim_boards::{ElfError, Firmware};
use hil_sim_core::plant::motion::MM_PER_COUNT;
use hil_sim_core::run::batch::on_all_cores;
use hil_sim_core::run::recording::{ACTUATORS, OutputRecord, Recording, volts};
use hil_sim_core::scene::{Motion, Series};

/// The longest that any channel may take to 0 V after the last count, in ms: rest is seen in 10 ms and
/// reached in 8 more, with a tick for either.
pub const GOAL_MS: f64 = 20.0;
/// The hand moves at this speed.
pub const SPEED_MM_S: f64 = 50.0;
const WAVELENGTH_MM: f64 = 2.0;
/// From when on the hand moves, and from when on a crest is looked for, in s.
const MOVES_S: f64 = 0.1;
const CREST_FROM_S: f64 = 1.5;
/// How long it rests, in s: shorter than the longest age of an estimate, so that what is seen is the rest.
const RESTS_S: f64 = 0.4;
/// How long it goes on then, in s.
const GOES_ON_S: f64 = 0.6;
/// The channel that is watched.
const WATCHED: usize = 24;
const ZERO: u16 = 0x8000;

/// A stop, and what came of it.
#[derive(Clone, Debug)]
pub struct Stop {
    /// Updates per second.
    pub rate_hz: u32,
    /// How the actuators share the stimulus.
    pub mode: Mode,
    /// The tick at which the last count was read, in s.
    pub last_count_s: f64,
    /// The watched channel's voltage then, in V.
    pub crest_v: f64,
    /// From then to exactly 0 V on the watched channel, for the rest's whole length; none if it never is.
    pub watched_ms: Option<f64>,
    /// The same of the last of all channels.
    pub all_ms: Option<f64>,
    /// From the first count after the rest to the first voltage other than 0 on the watched channel, in ms.
    pub starts_ms: Option<f64>,
    /// The largest step of any channel at one edge from the stop to 0.1 s after the start, in V.
    pub largest_step_v: f64,
    /// The largest step of the steady wave before it, in V.
    pub natural_step_v: f64,
    /// The hand's speed in mm/s, by encoder counts a tick, over s from the last count.
    pub speeds: Vec<(f64, f64)>,
    /// The watched voltage in V over s from the last count, at every edge.
    pub voltages: Vec<(f64, f64)>,
}

/// Measures a stop for each rate and mode, on all cores.
///
/// # Errors
/// If the ELF can't be run.
pub fn measure(firmware: &Firmware, quick: bool) -> Result<Vec<Stop>, ElfError> {
    let both = [UpdateRate::Hz2000, UpdateRate::Hz4000];
    let modes = [Mode::Uniform, Mode::Travelling];
    let plans: Vec<DisplayConfiguration> = both
        .into_iter()
        .flat_map(|rate| modes.map(|mode| (rate, mode)))
        .map(|(update_rate, mode)| DisplayConfiguration {
            mode,
            update_rate,
            ..DisplayConfiguration::DEFAULT
        })
        .take(if quick { 1 } else { 4 })
        .collect();
    on_all_cores(&plans, |&configuration| stop(firmware, configuration))
}

fn stop(firmware: &Firmware, configuration: DisplayConfiguration) -> Result<Stop, ElfError> {
    let run = |hand: Motion, duration_s: f64| -> Result<AloneRun, ElfError> {
        display_alone::run(
            DisplayBench {
                configuration,
                ..DisplayBench::new(hand, WAVELENGTH_MM, duration_s)
            },
            firmware,
        )
    };
    // Once without a stop, to see where a crest is; the same instants then come again.
    let steady = run(hand(None), CREST_FROM_S + 0.2)?.recording;
    let stops_s = crest_s(&steady).ok_or_else(|| ElfError::Configuration {
        board: "display",
        reason: "its outputs never came to a crest".to_owned(),
    })?;
    let ends_s = stops_s + RESTS_S + GOES_ON_S;
    let recording = run(hand(Some(stops_s)), ends_s)?.recording;
    Ok(judge(&recording, configuration, stops_s))
}

/// A steady hand, from [`MOVES_S`] on; stops at an instant, rests and goes on.
fn hand(stops_s: Option<f64>) -> Motion {
    let start_mm = 0.3 * MM_PER_COUNT;
    let mut at = vec![0.0, MOVES_S];
    let mut values = vec![start_mm, start_mm];
    match stops_s {
        None => {
            at.push(100.0);
            values.push(start_mm + SPEED_MM_S * (100.0 - MOVES_S));
        }
        Some(stops_s) => {
            let rests_mm = start_mm + SPEED_MM_S * (stops_s - MOVES_S);
            at.extend([stops_s, stops_s + RESTS_S, stops_s + RESTS_S + 10.0]);
            values.extend([rests_mm, rests_mm, rests_mm + 10.0 * SPEED_MM_S]);
        }
    }
    Motion::Recorded(Arc::new(Series {
        at,
        values,
        width: 1,
    }))
}

/// The tick before the edge at which the watched channel is at its highest, after [`CREST_FROM_S`], in s.
fn crest_s(recording: &Recording) -> Option<f64> {
    let highest = recording
        .outputs
        .iter()
        .filter(|output| seconds(output.at_ns) >= CREST_FROM_S)
        .max_by_key(|output| (output.words[WATCHED], std::cmp::Reverse(output.at_ns)))?;
    let next = recording
        .ticks
        .partition_point(|tick| tick.at_ns <= highest.at_ns);
    Some(seconds(recording.ticks.get(next.checked_sub(1)?)?.at_ns))
}

fn judge(recording: &Recording, configuration: DisplayConfiguration, stops_s: f64) -> Stop {
    let (ticks, outputs) = (&recording.ticks, &recording.outputs);
    let starts_again_s = stops_s + RESTS_S;
    // The tick of the last count before the rest, and of the first after it.
    let counts = ticks
        .windows(2)
        .filter(|pair| pair[0].encoder != pair[1].encoder)
        .map(|pair| pair[1].at_ns);
    let (mut last_ns, mut again_ns) = (0, None);
    for at_ns in counts {
        if seconds(at_ns) < starts_again_s {
            last_ns = at_ns;
        } else if again_ns.is_none() {
            again_ns = Some(at_ns);
        }
    }
    let end_ns = again_ns.unwrap_or(u64::MAX);
    let rest: Vec<&OutputRecord> = outputs
        .iter()
        .filter(|output| (last_ns..end_ns).contains(&output.at_ns))
        .collect();
    let silent_ms = |channel: usize| silent_ms(&rest, channel, last_ns);
    let all_ms = (0..ACTUATORS)
        .map(silent_ms)
        .try_fold(0.0, |latest, ms| ms.map(|ms: f64| ms.max(latest)));
    let starts_ms = again_ns.and_then(|again_ns| {
        let first = outputs
            .iter()
            .find(|output| output.at_ns >= again_ns && output.words[WATCHED] != ZERO)?;
        Some((first.at_ns - again_ns) as f64 * 1e-6)
    });
    let from = |at_ns: u64| seconds(at_ns) - seconds(last_ns);
    let until_ns = again_ns.map_or(u64::MAX, |again_ns| again_ns + 100_000_000);
    Stop {
        rate_hz: configuration.update_rate.hz(),
        mode: configuration.mode,
        last_count_s: seconds(last_ns),
        crest_v: outputs
            .iter()
            .rfind(|output| output.at_ns <= last_ns + 1_000_000_000 / 2_000)
            .map_or(0.0, |output| volts(output.words[WATCHED])),
        watched_ms: silent_ms(WATCHED),
        all_ms,
        starts_ms,
        largest_step_v: largest_step_v(outputs, last_ns..until_ns),
        natural_step_v: largest_step_v(outputs, last_ns.saturating_sub(200_000_000)..last_ns),
        speeds: ticks
            .windows(2)
            .map(|pair| {
                let counts = pair[1].encoder.wrapping_sub(pair[0].encoder).cast_signed();
                let period_s = seconds(pair[1].at_ns) - seconds(pair[0].at_ns);
                (
                    from(pair[1].at_ns),
                    f64::from(counts) * MM_PER_COUNT / period_s,
                )
            })
            .collect(),
        voltages: outputs
            .iter()
            .map(|output| (from(output.at_ns), volts(output.words[WATCHED])))
            .collect(),
    }
}

/// From `last_ns` to the edge from which on a channel stays at 0 V for the rest of the rest, in ms.
fn silent_ms(rest: &[&OutputRecord], channel: usize, last_ns: u64) -> Option<f64> {
    let silent = rest
        .iter()
        .rposition(|output| output.words[channel] != ZERO)
        .map_or(0, |loud| loud + 1);
    let first = rest.get(silent)?;
    Some((first.at_ns - last_ns) as f64 * 1e-6)
}

fn largest_step_v(outputs: &[OutputRecord], within_ns: std::ops::Range<u64>) -> f64 {
    outputs
        .windows(2)
        .filter(|pair| within_ns.contains(&pair[1].at_ns))
        .flat_map(|pair| {
            (0..ACTUATORS).map(|channel| {
                (volts(pair[1].words[channel]) - volts(pair[0].words[channel])).abs()
            })
        })
        .fold(0.0, f64::max)
}

fn seconds(at_ns: u64) -> f64 {
    at_ns as f64 * 1e-9
}

/// Whether every channel came to 0 V in time.
pub fn is_met(stop: &Stop) -> bool {
    stop.all_ms.is_some_and(|ms| ms <= GOAL_MS)
}

/// A point of a stop's course.
#[derive(Serialize)]
struct Record {
    rate_hz: u32,
    mode: &'static str,
    what: &'static str,
    from_last_count_ms: Fixed<4>,
    value: Fixed<5>,
}

impl Study for [Stop] {
    const NAME: &'static str = "stop";

    fn table(&self) -> Option<Table> {
        let mut table = Table::new(&[
            "rate, Hz:",
            "mode",
            "crest, V:",
            "last count to 0 V, ms:",
            "the last channel's, ms:",
            "first count to voltage, ms:",
            "largest step, V:",
            "of the wave itself, V:",
        ]);
        for stop in self {
            let cells = [
                stop.rate_hz.to_string(),
                super::word_of_mode(stop.mode).to_owned(),
                number(stop.crest_v, 2),
                number(stop.watched_ms, 2),
                number(stop.all_ms, 2),
                number(stop.starts_ms, 2),
                number(stop.largest_step_v, 3),
                number(stop.natural_step_v, 3),
            ];
            table.row_with(cells, remark(is_met(stop)));
        }
        Some(table)
    }

    /// Both lines of what is drawn, time by time.
    fn csvs(&self) -> Result<Vec<(&'static str, String)>, csv::Error> {
        let records = self.iter().flat_map(|stop| {
            let speeds = stop.speeds.iter().map(|point| ("speed_mm_s", point));
            let voltages = stop.voltages.iter().map(|point| ("voltage_v", point));
            let shown = speeds
                .chain(voltages)
                .filter(|(_, (t_s, _))| picture::SHOWN_S.contains(t_s));
            shown.map(|(what, (t_s, value))| Record {
                rate_hz: stop.rate_hz,
                mode: super::word_of_mode(stop.mode),
                what,
                from_last_count_ms: (t_s * 1e3).into(),
                value: (*value).into(),
            })
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

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim_core::run::fault_evidence::FaultEvidence;
    use hil_sim_core::run::recording::{Engine, TickRecord};

    /// A hand that stops at 1 s and goes on at 1.4 s; channel 24 stands at 0x9000 and channel 3 at
    /// 0x7000 until 1 s, then at half of it for 5 and 9 ms, then at 0 V until 2 ms after the start.
    fn made_up() -> Recording {
        let moves_mm = |t_s: f64| SPEED_MM_S * (t_s.min(1.0) + (t_s - 1.4).max(0.0)) + 0.001;
        let ticks: Vec<TickRecord> = (0..4_000u64)
            .map(|tick| TickRecord {
                at_ns: tick * 500_000,
                encoder: hil_sim_core::plant::motion::encoder(moves_mm(tick as f64 * 5e-4)),
                position_mm: moves_mm(tick as f64 * 5e-4),
            })
            .collect();
        let outputs = ticks
            .iter()
            .map(|tick| {
                let t_ms = tick.at_ns as f64 * 1e-6;
                let level = |ms: f64, full: u16| {
                    if t_ms <= 1_000.0 || t_ms >= 1_402.0 {
                        full
                    } else if t_ms < 1_000.0 + ms {
                        ZERO / 2 + full / 2
                    } else {
                        ZERO
                    }
                };
                let mut words = [ZERO; ACTUATORS];
                words[WATCHED] = level(5.0, 0x9000);
                words[3] = level(9.0, 0x7000);
                OutputRecord {
                    at_ns: tick.at_ns + 50_000,
                    words,
                    skew_ns: 0,
                }
            })
            .collect();
        Recording {
            engine: Engine::Native,
            duration_s: 2.0,
            warm_up_s: 0.0,
            wall_s: 1.0,
            hash: 0,
            signs: FaultEvidence::default(),
            scans: Vec::new(),
            ticks,
            estimates: Vec::new(),
            arrived: Vec::new(),
            outputs,
            sensor_status: None,
            display_status: None,
            log: Vec::new(),
        }
    }

    #[test]
    fn the_way_to_zero_is_counted_from_the_last_count_to_the_last_edge_that_is_not_zero() {
        let stop = judge(&made_up(), DisplayConfiguration::DEFAULT, 1.0);
        assert!((stop.last_count_s - 1.0).abs() < 1e-9, "{stop:?}");
        // Edges come 0.05 ms after their ticks.
        assert!((stop.watched_ms.unwrap() - 5.05).abs() < 1e-6);
        assert!((stop.all_ms.unwrap() - 9.05).abs() < 1e-6);
        // The first count after the rest is read a tick after it.
        assert!(
            (stop.starts_ms.unwrap() - 1.55).abs() < 1e-6,
            "{:?}",
            stop.starts_ms
        );
        assert!(
            (stop.largest_step_v - 0.625).abs() < 1e-9,
            "{}",
            stop.largest_step_v
        );
        assert_eq!(stop.natural_step_v, 0.0);
        assert!(is_met(&stop));
    }

    #[test]
    fn a_voltage_that_stands_through_the_rest_never_comes_to_zero() {
        let mut recording = made_up();
        for output in &mut recording.outputs {
            output.words[7] = 0x8001;
        }
        let stop = judge(&recording, DisplayConfiguration::DEFAULT, 1.0);
        assert!(stop.watched_ms.is_some());
        assert_eq!(stop.all_ms, None);
        assert!(!is_met(&stop));
    }

    #[test]
    fn the_hand_stops_dead_and_goes_on() {
        let hand = hand(Some(1.5));
        assert_eq!(hand.velocity_mm_s(0.05), 0.0);
        assert!((hand.velocity_mm_s(1.0) - SPEED_MM_S).abs() < 1e-9);
        assert_eq!(hand.velocity_mm_s(1.7), 0.0);
        assert!((hand.velocity_mm_s(1.95) - SPEED_MM_S).abs() < 1e-9);
    }
}
