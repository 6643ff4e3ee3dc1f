//! What the voltages do when the hand stops in mid-wave and starts again, from the display's ELF.
//!
//! The hand moves steadily and stops dead at a tick at which the watched channel stands at a crest: the
//! worst place, with the most voltage left standing. Later it starts again. How long the way to 0 V
//! takes is counted from the tick at which the last encoder count was read.

mod picture;

use std::ops::Range;

use protocol::{DisplayConfiguration, Mode, UpdateRate};

use super::{configured, seconds, through};
use crate::study::{Progress, Record, Study, Table, csv, fixed, number, short};
use hil_sim_boards::display_alone::{self, DisplayBench};
use hil_sim_boards::{ElfError, Firmware};
use hil_sim_core::plant::motion::MM_PER_COUNT;
use hil_sim_core::run::recording::{ACTUATORS, OutputRecord, Recording, volts};
use hil_sim_core::scene::Motion;

/// The longest that any channel may take to 0 V after the last count: rest is seen in 10 ms and
/// reached in 8 more, with a tick for either.
const GOAL_MS: f64 = 20.0;
const SPEED_MM_S: f64 = 50.0;
const WAVELENGTH_MM: f64 = 2.0;
/// From when on the hand moves, and from when on a crest is looked for.
const MOVES_S: f64 = 0.1;
const CREST_FROM_S: f64 = 1.5;
/// How long it rests: shorter than the longest age of an estimate, so that what is seen is the rest.
const RESTS_S: f64 = 0.4;
/// How long it goes on then.
const GOES_ON_S: f64 = 0.6;
const WATCHED: usize = 24;
const ZERO: u16 = 0x8000;

/// A stop, and what came of it.
#[derive(Clone, Debug)]
pub struct Stop {
    rate_hz: u32,
    mode: Mode,
    /// The watched channel's voltage at the tick of the last count.
    crest_v: f64,
    /// From then to exactly 0 V on the watched channel, for the rest's whole length; none if it never is.
    watched_ms: Option<f64>,
    /// The same of the last of all channels.
    all_ms: Option<f64>,
    /// From the first count after the rest to the first voltage other than 0 on the watched channel.
    starts_ms: Option<f64>,
    /// The largest step of any channel at one edge from the stop to 0.1 s after the start.
    largest_step_v: f64,
    /// The largest step of the steady wave before it.
    natural_step_v: f64,
    /// The hand's speed in mm/s, by encoder counts a tick, over s from the last count.
    speeds: Vec<(f64, f64)>,
    /// The watched voltage in V over s from the last count, at every edge.
    voltages: Vec<(f64, f64)>,
}

/// Measures a stop for each rate and mode.
pub fn measure(
    firmware: &Firmware,
    quick: bool,
    progress: &impl Progress,
) -> Result<Vec<Stop>, ElfError> {
    let modes = [Mode::Uniform, Mode::Travelling];
    let plans = [UpdateRate::Hz2000, UpdateRate::Hz4000].map(|r| modes.map(|m| configured(m, r)));
    let plans = &plans.as_flattened()[..if quick { 1 } else { 4 }];
    progress.begin(plans.len());
    progress.each(plans, |&configuration| stop(firmware, configuration))
}

fn stop(firmware: &Firmware, configuration: DisplayConfiguration) -> Result<Stop, ElfError> {
    let run = |hand: Motion, duration_s: f64| {
        let bench = DisplayBench {
            configuration,
            ..DisplayBench::new(hand, WAVELENGTH_MM, duration_s)
        };
        display_alone::run(bench, firmware).map(|run| run.recording)
    };
    // Once without a stop, to see where a crest is; the same instants then come again.
    let steady = run(hand(None), CREST_FROM_S + 0.2)?;
    let stops_s = crest_s(&steady).ok_or_else(|| ElfError::Configuration {
        board: "display",
        reason: "its outputs never came to a crest".to_owned(),
    })?;
    let recording = run(hand(Some(stops_s)), stops_s + RESTS_S + GOES_ON_S)?;
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
    through(at, values)
}

/// The tick before the edge at which the watched channel is at its highest, after [`CREST_FROM_S`], in s.
fn crest_s(recording: &Recording) -> Option<f64> {
    let outputs = recording.outputs.iter();
    let highest = outputs
        .filter(|output| seconds(output.at_ns) >= CREST_FROM_S)
        .max_by_key(|output| (output.words[WATCHED], std::cmp::Reverse(output.at_ns)))?;
    let ticks = &recording.ticks;
    let next = ticks.partition_point(|tick| tick.at_ns <= highest.at_ns);
    Some(seconds(ticks.get(next.checked_sub(1)?)?.at_ns))
}

fn judge(recording: &Recording, configuration: DisplayConfiguration, stops_s: f64) -> Stop {
    let (ticks, outputs) = (&recording.ticks, &recording.outputs);
    // The ticks of the counts before the rest, and of those after it.
    let counts = ticks
        .windows(2)
        .filter(|pair| pair[0].encoder != pair[1].encoder)
        .map(|pair| pair[1].at_ns);
    let (before, after): (Vec<u64>, Vec<u64>) =
        counts.partition(|&at_ns| seconds(at_ns) < stops_s + RESTS_S);
    let last_ns = before.last().copied().unwrap_or(0);
    let again_ns = after.first().copied();
    let within = last_ns..again_ns.unwrap_or(u64::MAX);
    let rest: Vec<&OutputRecord> = outputs
        .iter()
        .filter(|output| within.contains(&output.at_ns))
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
    let speeds = ticks.windows(2).map(|pair| {
        let counts = pair[1].encoder.wrapping_sub(pair[0].encoder).cast_signed();
        let period_s = seconds(pair[1].at_ns) - seconds(pair[0].at_ns);
        let speed_mm_s = f64::from(counts) * MM_PER_COUNT / period_s;
        (from(pair[1].at_ns), speed_mm_s)
    });
    let watched_v = |output: &OutputRecord| volts(output.words[WATCHED]);
    Stop {
        rate_hz: configuration.update_rate.hz(),
        mode: configuration.mode,
        crest_v: outputs
            .iter()
            .rfind(|output| output.at_ns <= last_ns + 1_000_000_000 / 2_000)
            .map_or(0.0, watched_v),
        watched_ms: silent_ms(WATCHED),
        all_ms,
        starts_ms,
        largest_step_v: largest_step_v(outputs, last_ns..until_ns),
        natural_step_v: largest_step_v(outputs, last_ns.saturating_sub(200_000_000)..last_ns),
        speeds: speeds.collect(),
        voltages: outputs
            .iter()
            .map(|output| (from(output.at_ns), watched_v(output)))
            .collect(),
    }
}

/// From `last_ns` to the edge from which on a channel stays at 0 V for the rest of the rest, in ms.
fn silent_ms(rest: &[&OutputRecord], channel: usize, last_ns: u64) -> Option<f64> {
    let loud = rest
        .iter()
        .rposition(|output| output.words[channel] != ZERO);
    let first = rest.get(loud.map_or(0, |loud| loud + 1))?;
    Some((first.at_ns - last_ns) as f64 * 1e-6)
}

fn largest_step_v(outputs: &[OutputRecord], within_ns: Range<u64>) -> f64 {
    let steps = outputs
        .windows(2)
        .filter(|pair| within_ns.contains(&pair[1].at_ns));
    steps
        .flat_map(|pair| pair[1].words.iter().zip(&pair[0].words))
        .map(|(&to, &from)| (volts(to) - volts(from)).abs())
        .fold(0.0, f64::max)
}

impl Stop {
    fn is_met(&self) -> bool {
        self.all_ms.is_some_and(|ms| ms <= GOAL_MS)
    }
}

impl Study for Vec<Stop> {
    const NAME: &'static str = "stop";

    fn table(&self) -> Option<Table> {
        let rows = self.iter().map(|stop| {
            Record::default()
                .with("rate, Hz:", short(stop.rate_hz))
                .with("mode", stop.mode.name())
                .with("crest, V:", number(stop.crest_v, 2))
                .with("last count to 0 V, ms:", number(stop.watched_ms, 2))
                .with("the last channel's, ms:", number(stop.all_ms, 2))
                .with("first count to voltage, ms:", number(stop.starts_ms, 2))
                .with("largest step, V:", number(stop.largest_step_v, 3))
                .with("of the wave itself, V:", number(stop.natural_step_v, 3))
                .judged(stop.is_met())
        });
        Some(rows.collect())
    }

    /// Both lines of what is drawn, time by time.
    fn csvs(&self) -> Vec<(&'static str, String)> {
        let rows = self.iter().flat_map(|stop| {
            let speeds = stop.speeds.iter().map(|point| ("speed_mm_s", point));
            let voltages = stop.voltages.iter().map(|point| ("voltage_v", point));
            let all = speeds.chain(voltages);
            let shown = all.filter(|(_, (t_s, _))| picture::SHOWN_S.contains(t_s));
            shown.map(|(what, (t_s, value))| {
                Record::default()
                    .with("rate_hz", short(stop.rate_hz))
                    .with("mode", stop.mode.name())
                    .with("what", what)
                    .with("from_last_count_ms", fixed(t_s * 1e3, 4))
                    .with("value", fixed(*value, 5))
            })
        });
        vec![("", csv(rows))]
    }

    fn picture(&self) -> String {
        picture::draw(self)
    }

    fn is_met(&self) -> bool {
        self.iter().all(Stop::is_met)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
            ticks,
            outputs,
            ..Recording::empty(Engine::Native, 2.0)
        }
    }

    #[test]
    fn the_way_to_zero_is_counted_from_the_last_count_to_the_last_edge_that_is_not_zero() {
        let stop = judge(&made_up(), DisplayConfiguration::DEFAULT, 1.0);
        // Edges come 0.05 ms after their ticks; times are from the last count.
        let last_count_s = 0.05e-3 - stop.voltages[0].0;
        assert!((last_count_s - 1.0).abs() < 1e-9, "{stop:?}");
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
        assert!(stop.is_met());
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
        assert!(!stop.is_met());
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
