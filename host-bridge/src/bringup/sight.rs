//! What is seen of a bench while a step is measured: what `doctor` sees, and how hand, arm and gauges moved.
//!
//! Time is the boards' own. So a bench that is emulated more slowly than the clock goes is measured as any
//! other.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use protocol::{
    Configuration, ConfigurationReport, Configure, DisplayConfiguration, DisplayCounters, GAUGES,
    Message, PortCounters, Question, Role, RoleCounters, SensorCounters, Setting, StreamGauges,
};

use crate::bench::Bench;
use crate::doctor::examination::{BoardFacts, Examination};
use crate::doctor::look::{Observer, look_with};
use crate::state::State;
use crate::system::System;

/// The longest that it is waited for the boards to have said enough.
const PATIENCE: Duration = Duration::from_secs(60);
/// Looks at a board whose port is there before it is given up.
const TRIES: u32 = 3;
/// Volts of a gauge's code, which is in sixteenths of an ADC step.
const VOLTS_PER_CODE: f64 = 3.3 / 65_536.0;

/// What to look for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// How long to look, in s of the boards' clocks.
    pub span_s: f64,
    /// An amplitude that the display is to take, in mV.
    pub amplitude_mv: Option<u16>,
}

/// What has been seen.
#[derive(Clone, Debug, Default)]
pub struct Sight {
    pub examination: Examination,
    /// The hand, by the display's motions.
    pub hand: Track,
    /// The arm, by the positions beside the gauges' samples.
    pub arm: Track,
    pub estimates: Track,
    pub surface: Surface,
    /// Each gauge's voltage.
    pub gauges: [Voltage; GAUGES],
    /// What became of the amplitude that was asked for: what is in force, in mV, or why it was refused.
    pub amplitude: Option<Result<u16, String>>,
}

/// Something that is said in order, with its place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Track {
    first: Option<Point>,
    last: Option<Point>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    sequence: u32,
    instant_us: u64,
    position_um: i64,
}

impl Track {
    fn go(&mut self, sequence: u32, instant_us: u64, position_um: i64) {
        let point = Point {
            sequence,
            instant_us,
            position_um,
        };
        if self.begins_again(sequence) {
            self.first = None;
        }
        self.first = self.first.or(Some(point));
        self.last = Some(point);
    }

    /// Whether a board that counts so has started anew.
    fn begins_again(&self, sequence: u32) -> bool {
        self.last.is_some_and(|last| sequence < last.sequence)
    }

    fn ends(&self) -> Option<(Point, Point)> {
        Some((self.first?, self.last?))
    }

    /// How long it was seen, in s of the board's clock.
    pub fn span_s(&self) -> f64 {
        self.ends().map_or(0.0, |(first, last)| {
            last.instant_us.saturating_sub(first.instant_us) as f64 * 1e-6
        })
    }

    /// How many were said in a second of the board's clock, lost ones too; none if it was not long to be seen.
    pub fn rate_hz(&self) -> Option<f64> {
        let (first, last) = self.ends()?;
        let span_s = self.span_s();
        (span_s > 0.1).then(|| f64::from(last.sequence - first.sequence) / span_s)
    }

    /// From the first place to the last, in mm.
    pub fn travel_mm(&self) -> Option<f64> {
        let (first, last) = self.ends()?;
        let way_um = last.position_um.saturating_sub(first.position_um);
        Some(way_um as f64 * 1e-3)
    }

    /// The same in a second, in mm/s.
    pub fn speed_mm_s(&self) -> Option<f64> {
        let span_s = self.span_s();
        (span_s > 0.1).then_some(self.travel_mm()? / span_s)
    }
}

/// What the estimates said.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surface {
    heard: u32,
    valid: u32,
    sum_mm: f64,
}

impl Surface {
    /// The share of valid ones, in percent.
    pub fn valid_percent(&self) -> Option<f64> {
        (self.heard > 0).then(|| 100.0 * f64::from(self.valid) / f64::from(self.heard))
    }

    /// The mean of the valid ones, in mm.
    pub fn wavelength_mm(&self) -> Option<f64> {
        (self.valid > 0).then(|| self.sum_mm / f64::from(self.valid))
    }
}

/// A voltage over time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Voltage {
    samples: u32,
    sum: f64,
    lowest: u16,
    highest: u16,
}

impl Default for Voltage {
    fn default() -> Self {
        Self {
            samples: 0,
            sum: 0.0,
            lowest: u16::MAX,
            highest: 0,
        }
    }
}

impl Voltage {
    fn take(&mut self, code: u16) {
        self.samples += 1;
        self.sum += f64::from(code);
        self.lowest = self.lowest.min(code);
        self.highest = self.highest.max(code);
    }

    /// Its mean, in V.
    pub fn mean_v(&self) -> Option<f64> {
        (self.samples > 0).then(|| self.sum / f64::from(self.samples) * VOLTS_PER_CODE)
    }

    /// From the lowest to the highest, in mV.
    pub fn swing_mv(&self) -> Option<f64> {
        (self.samples > 0).then(|| f64::from(self.highest - self.lowest) * VOLTS_PER_CODE * 1e3)
    }
}

impl Sight {
    /// Looks at `bench`, whose boards are there or not, until they have said enough or `ended` is set. A board
    /// whose port is there and that is not understood may be about to start: it is looked at again.
    pub fn of(system: &System, bench: &Bench, wanted: Wanted, ended: &AtomicBool) -> Self {
        let mut sight = Self::once(system, bench, wanted, ended);
        for _ in 1..TRIES {
            if !sight.may_come() || ended.load(Ordering::Acquire) {
                break;
            }
            sight = Self::once(system, bench, wanted, ended);
        }
        sight
    }

    /// Whether a board's port is there and nothing that is understood comes out of it.
    fn may_come(&self) -> bool {
        self.examination.boards.iter().any(|board| {
            matches!(
                board.state,
                State::Opened { .. }
                    | State::Silent { .. }
                    | State::Deaf { .. }
                    | State::Garbage { .. }
            )
        })
    }

    fn once(system: &System, bench: &Bench, wanted: Wanted, ended: &AtomicBool) -> Self {
        let mut watcher = Watcher {
            sight: Self::default(),
            wanted,
            asked: 0,
            heard: [0; 2],
            in_force: None,
            has_ordered: false,
        };
        let examination = look_with(system, bench, PATIENCE, ended, &mut watcher);
        Self {
            examination,
            ..watcher.sight
        }
    }

    /// What `doctor` sees of the board of `role`.
    pub fn board(&self, role: Role) -> Option<&BoardFacts> {
        self.examination.board(role)
    }

    /// What the display board has counted since its start.
    pub fn display(&self) -> Option<DisplayCounters> {
        match self.board(Role::Display)?.status()?.role {
            RoleCounters::Display(counters) => Some(counters),
            RoleCounters::Sensor(_) => None,
        }
    }

    /// What the sensor board has counted since its start.
    pub fn sensor(&self) -> Option<SensorCounters> {
        match self.board(Role::Sensor)?.status()?.role {
            RoleCounters::Sensor(counters) => Some(counters),
            RoleCounters::Display(_) => None,
        }
    }

    /// How a count of a board's port to the other one has grown while it was looked at, and in what time, in s.
    fn grown(&self, role: Role, count: fn(&PortCounters) -> u32) -> Option<(u32, f64)> {
        let board = self.board(role)?;
        let (first, last) = (board.first.as_ref()?, board.last.as_ref()?);
        let grown = count(&last.peer).wrapping_sub(count(&first.peer));
        let span_us = last.uptime_us.checked_sub(first.uptime_us)?;
        Some((grown, span_us as f64 * 1e-6))
    }

    /// Good frames that the board of `role` has heard from the other one.
    pub fn heard(&self, role: Role) -> Option<f64> {
        let (frames, _) = self.grown(role, |port| port.received)?;
        Some(frames.into())
    }

    /// The same in a second of its clock.
    pub fn heard_hz(&self, role: Role) -> Option<f64> {
        let (frames, span_s) = self.grown(role, |port| port.received)?;
        (span_s > 0.0).then(|| f64::from(frames) / span_s)
    }

    /// Noise and framing errors, damaged frames and frames without an end.
    pub fn damage(&self, role: Role) -> Option<f64> {
        let (frames, _) = self.grown(role, |port| {
            [port.line_errors, port.corrupt, port.overlong]
                .into_iter()
                .fold(0, u32::saturating_add)
        })?;
        Some(frames.into())
    }

    /// Frames of the other board's that never came.
    pub fn lost(&self, role: Role) -> Option<f64> {
        let (frames, _) = self.grown(role, |port| port.lost)?;
        Some(frames.into())
    }
}

struct Watcher {
    sight: Sight,
    wanted: Wanted,
    /// How often it was asked what is to be said.
    asked: u32,
    /// Statuses of the sensor board, and of the display board.
    heard: [u32; 2],
    /// What the display has in force, and its hash.
    in_force: Option<(u32, DisplayConfiguration)>,
    /// Whether the display was told to take the amplitude.
    has_ordered: bool,
}

/// Of the calls of [`Observer::say`], ten a second, the gauges are asked for anew at each such.
const STREAM_EVERY: u32 = 10;

impl Observer for Watcher {
    fn hear(&mut self, role: Role, message: &Message) {
        let sight = &mut self.sight;
        match message {
            Message::Motion(motion) => {
                if sight.hand.begins_again(motion.sequence) {
                    // The display has started anew, with its own amplitude.
                    sight.amplitude = None;
                    self.in_force = None;
                    self.has_ordered = false;
                }
                sight
                    .hand
                    .go(motion.sequence, motion.instant_us, motion.position_um);
            }
            Message::Estimate(estimate) => {
                sight
                    .estimates
                    .go(estimate.sequence, estimate.instant_us, 0);
                sight.surface.heard += 1;
                if let Some(wavelength_mm) = estimate.wavelength_mm.filter(|_| estimate.valid) {
                    sight.surface.valid += 1;
                    sight.surface.sum_mm += f64::from(wavelength_mm);
                }
            }
            Message::Gauges(gauges) => {
                sight
                    .arm
                    .go(gauges.first_sample, gauges.instant_us, gauges.position_um);
                for sample in &gauges.samples {
                    for (gauge, &code) in sight.gauges.iter_mut().zip(&sample.codes) {
                        gauge.take(code);
                    }
                }
            }
            Message::Configuration(report) if role == Role::Display => self.configured(report),
            Message::Status(_) => self.heard[usize::from(role == Role::Display)] += 1,
            _ => {}
        }
    }

    fn say(&mut self) -> Vec<(Role, Message)> {
        let turn = self.asked;
        self.asked += 1;
        if !turn.is_multiple_of(STREAM_EVERY) {
            return Vec::new();
        }
        let for_ms = StreamGauges::LONGEST_MS;
        let stream = Message::StreamGauges(StreamGauges { for_ms });
        let mut all = vec![(Role::Sensor, stream)];
        if let (Some(amplitude_mv), false) = (self.wanted.amplitude_mv, self.is_configured()) {
            all.push((Role::Display, self.order(amplitude_mv)));
        }
        all
    }

    fn has_enough(&self, present: &[&BoardFacts]) -> bool {
        let Self { sight, wanted, .. } = self;
        present.iter().all(|board| {
            let is_display = board.role == Role::Display;
            let (spans_s, is_configured) = if is_display {
                (vec![sight.hand.span_s()], self.is_configured())
            } else {
                (vec![sight.estimates.span_s(), sight.arm.span_s()], true)
            };
            is_configured
                && self.heard[usize::from(is_display)] >= 2
                && spans_s.iter().all(|&span_s| span_s >= wanted.span_s)
        })
    }
}

impl Watcher {
    /// Whether what was asked for is in force, or refused.
    fn is_configured(&self) -> bool {
        match (&self.sight.amplitude, self.wanted.amplitude_mv) {
            (_, None) | (Some(Err(_)), _) => true,
            (Some(Ok(in_force_mv)), Some(wanted_mv)) => *in_force_mv == wanted_mv,
            (None, Some(_)) => false,
        }
    }

    /// What is in force is asked for first: all but the amplitude is to stay as it is.
    fn order(&mut self, amplitude_mv: u16) -> Message {
        let Some((hash, in_force)) = self.in_force else {
            return Message::Question(Question::Configuration);
        };
        self.has_ordered = true;
        Message::Configure(Configure {
            replaces: Some(hash),
            configuration: Configuration::Display(DisplayConfiguration {
                amplitude_mv,
                ..in_force
            }),
        })
    }

    fn configured(&mut self, report: &ConfigurationReport) {
        if let Configuration::Display(display) = report.configuration {
            self.in_force = Some((report.hash, display));
            // All else stays as it is in force: no other refusal is an answer to this program. Where something else is
            // in force by now, the change is made again of that.
            let refused = report
                .refused
                .filter(|refusal| self.has_ordered && refusal.setting == Setting::AmplitudeMv);
            self.sight.amplitude = Some(match refused {
                None => Ok(display.amplitude_mv),
                Some(refusal) => Err(refusal.to_string()),
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use protocol::{Motion, Refusal};

    use super::*;

    #[test]
    fn an_amplitude_is_not_in_force_any_more_once_the_display_has_started_anew() {
        let mut watcher = Watcher {
            sight: Sight::default(),
            wanted: Wanted {
                span_s: 1.0,
                amplitude_mv: Some(1_000),
            },
            asked: 0,
            heard: [0; 2],
            in_force: None,
            has_ordered: false,
        };
        let motion = |sequence| {
            Message::Motion(Motion {
                sequence,
                instant_us: 0,
                position_um: 0,
                velocity_um_s: 0,
            })
        };
        let configuration = Configuration::Display(DisplayConfiguration {
            amplitude_mv: 1_000,
            ..DisplayConfiguration::DEFAULT
        });
        watcher.hear(Role::Display, &motion(70));
        let report = ConfigurationReport {
            refused: None,
            hash: configuration.hash(),
            configuration,
        };
        watcher.hear(Role::Display, &Message::Configuration(report));
        watcher.hear(Role::Display, &motion(71));
        assert_eq!(watcher.sight.amplitude, Some(Ok(1_000)));
        assert!(watcher.is_configured());
        watcher.hear(Role::Display, &motion(0));
        assert_eq!(watcher.sight.amplitude, None);
        assert!(!watcher.is_configured());
        let asks = Message::Question(Question::Configuration);
        assert_eq!(watcher.order(1_000), asks);
    }

    #[test]
    fn a_refusal_that_answers_somebody_else_is_none() {
        let mut watcher = Watcher {
            sight: Sight::default(),
            wanted: Wanted {
                span_s: 1.0,
                amplitude_mv: Some(700),
            },
            asked: 0,
            heard: [0; 2],
            in_force: None,
            has_ordered: false,
        };
        let report = |configuration: DisplayConfiguration, setting: Option<Setting>| {
            let refused = setting.map(|setting| Refusal {
                setting,
                index: 0,
                low: 0,
                high: 0,
            });
            ConfigurationReport::of(Configuration::Display(configuration), refused)
        };
        let orders = |watcher: &mut Watcher| -> Vec<Configure> {
            let turns = (0..STREAM_EVERY)
                .flat_map(|_| watcher.say())
                .collect::<Vec<_>>();
            let orders = turns.into_iter().filter_map(|(_, message)| match message {
                Message::Configure(configure) => Some(configure),
                _ => None,
            });
            orders.collect()
        };
        let before = DisplayConfiguration::DEFAULT;
        let other = DisplayConfiguration {
            fade_in_ms: 77,
            ..before
        };
        assert_eq!(orders(&mut watcher), []);
        // Another program asks for what can't be.
        watcher.configured(&report(before, Some(Setting::AmplitudeMv)));
        assert!(!watcher.is_configured());
        let replaced = |orders: &[Configure]| orders.first().and_then(|order| order.replaces);
        let of = |configuration| Configuration::Display(configuration).hash();
        assert_eq!(replaced(&orders(&mut watcher)), Some(of(before)));
        watcher.configured(&report(before, Some(Setting::Role)));
        assert!(!watcher.is_configured());
        // Another program has changed something in between: the change is made again of that.
        watcher.configured(&report(other, Some(Setting::Replaces)));
        assert!(!watcher.is_configured());
        assert_eq!(replaced(&orders(&mut watcher)), Some(of(other)));
        watcher.configured(&report(other, Some(Setting::AmplitudeMv)));
        assert!(watcher.is_configured() && matches!(watcher.sight.amplitude, Some(Err(_))));
    }

    #[test]
    fn a_way_that_no_number_holds_is_a_long_one() {
        let mut track = Track::default();
        track.go(1, 0, i64::MIN);
        track.go(2, 1_000_000, i64::MAX);
        assert!(track.travel_mm().is_some_and(|way_mm| way_mm > 1e15));
    }
}
