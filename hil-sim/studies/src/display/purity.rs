//! How pure the stimulus is at the converters: spurs from 0 to 1 kHz and the mean of every channel, from
//! the LDAC edges of the display's ELF.
//!
//! A hand at a steady speed over a steady λ asks for a sine of v/λ. Where it moves by whole counts of its
//! encoder a tick, the encoder adds nothing and what is not the sine is the display's own; the same
//! stimuli at speeds between whole counts show what the encoder's steps add.

mod picture;
mod stretch;

use protocol::{DisplayConfiguration, Mode, Rendering, UpdateRate};

use super::{PLAIN_TEXTURE, configured, seconds};
use crate::study::{Progress, Record, Study, Table, csv, fixed, number, short};
use hil_sim_boards::display_alone::{self, DisplayBench};
use hil_sim_boards::{ElfError, Firmware};
use hil_sim_core::judge::mean::{Held, about_a_second_s};
use hil_sim_core::judge::spectrum::{Spectrum, spectra};
use hil_sim_core::plant::motion::MM_PER_COUNT;
use hil_sim_core::run::recording::{ACTUATORS, Recording, volts};
use stretch::{StimulusSequence, Stretch};

/// The highest a spur may be, in dB over the stimulus.
const GOAL_DBC: f64 = -80.0;
/// The farthest from 0 V that a channel's mean may be.
const GOAL_MEAN_MV: f64 = 5.0;
/// Spurs are looked for from 0 Hz to this.
const HIGHEST_HZ: f64 = 1_000.0;
const FREQUENCIES_HZ: [f64; 12] = [
    5.0, 7.3, 10.4, 14.2, 20.6, 28.7, 40.0, 57.4, 80.6, 113.3, 160.7, 200.0,
];
/// The wavelength that a stimulus' is kept near to.
const USUAL_MM: f64 = 1.5;
/// Counts a tick between whole ones: the golden section, which no small fraction comes near to.
const BETWEEN: f64 = 0.381_966;
/// From a stretch's beginning to where it is looked at: what fades, glides and settles has done so.
const SETTLING_S: f64 = 2.5;
/// For how long it is looked at.
const LOOK_S: f64 = 2.2;
/// Over what a spectrum is taken: 0.5 Hz a bin.
const SPECTRUM_S: f64 = 2.0;
/// The frequency whose spectra are drawn.
const SHOWN_HZ: f64 = 40.0;

/// How the hand moves.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Hand {
    /// At a steady speed, by whole counts a tick.
    Whole,
    /// At a steady speed between whole counts a tick.
    Between,
    /// To and fro, v = peak · sin 2π f t.
    Stroke { peak_mm_s: f64, frequency_hz: f64 },
}

/// A stimulus, and what came of it.
#[derive(Clone, Debug)]
pub struct Row {
    rate_hz: u32,
    mode: Mode,
    hand: Hand,
    /// The highest of strokes.
    speed_mm_s: f64,
    wavelength_mm: f64,
    /// v/λ of a steady speed.
    frequency_hz: Option<f64>,
    /// Ticks in which a steady hand did not move by the usual counts: 0 for whole ones.
    uneven_ticks: usize,
    /// Amplitude of the stimulus' own line, the lowest of the channels.
    stimulus_v: Option<f64>,
    /// The highest spur over its channel's stimulus, in dB, and its frequency, at worst over the channels.
    spur: Option<(f64, f64)>,
    /// The farthest mean of any channel over whole cycles of about a second: cycles of a steady
    /// stimulus, or of the hand.
    whole_mean_mv: f64,
    /// The same over exactly a second, wherever it begins.
    second_mean_mv: f64,
    /// The spectrum of the channel with the highest spur, for [`SHOWN_HZ`].
    spectrum: Option<Spectrum>,
}

struct Plan {
    rate: UpdateRate,
    mode: Mode,
    hands: Vec<Hand>,
}

/// Measures all rows; quick: two stimuli and a stroke at 2 kHz. With another rendering than the fundamental the
/// surface is told to be a sine and nothing else, so that what is not the sine is still the display's own.
pub fn measure(
    firmware: &Firmware,
    rendering: Rendering,
    quick: bool,
    progress: &impl Progress,
) -> Result<Vec<Row>, ElfError> {
    let plans = plans(quick);
    progress.begin(plans.len());
    let rows = progress.each(&plans, |plan| run(plan, firmware, rendering, quick))?;
    Ok(rows.into_iter().flatten().collect())
}

fn plans(quick: bool) -> Vec<Plan> {
    let strokes = [(70.0, 0.83), (30.0, 0.5), (100.0, 1.5)];
    // A hand that trembles about a place: 0.5 mm, 0.3 mm and 0.1 mm either way.
    let wobbles = [(10.0, 3.2), (15.0, 7.7), (6.0, 9.5)];
    let stroke = |(peak_mm_s, frequency_hz)| Hand::Stroke {
        peak_mm_s,
        frequency_hz,
    };
    if quick {
        return vec![Plan {
            rate: UpdateRate::Hz2000,
            mode: Mode::Travelling,
            hands: vec![Hand::Whole, stroke(strokes[0])],
        }];
    }
    let mut plans = Vec::new();
    for rate in [UpdateRate::Hz2000, UpdateRate::Hz4000] {
        for mode in [Mode::Uniform, Mode::Travelling] {
            let to_and_fro = strokes.into_iter().chain(wobbles).map(stroke).collect();
            let groups = [vec![Hand::Whole], vec![Hand::Between], to_and_fro];
            plans.extend(groups.map(|hands| Plan { rate, mode, hands }));
        }
    }
    plans
}

fn run(
    plan: &Plan,
    firmware: &Firmware,
    rendering: Rendering,
    quick: bool,
) -> Result<Vec<Row>, ElfError> {
    // The second comes with what the first has left behind.
    let frequencies: &[f64] = if quick {
        &[10.4, SHOWN_HZ]
    } else {
        &FREQUENCIES_HZ
    };
    let mut stretches = Vec::new();
    for &hand in &plan.hands {
        match hand {
            Hand::Stroke { .. } => stretches.push(Stretch {
                hand,
                speed_mm_s: 0.0,
                wavelength_mm: 2.0,
                lasts_s: SETTLING_S + 2.0 * LOOK_S,
            }),
            Hand::Whole | Hand::Between => {
                stretches.extend(frequencies.iter().map(|&f| steady(plan.rate, hand, f)));
            }
        }
    }
    let course = StimulusSequence::new(stretches);
    let bench = DisplayBench {
        configuration: DisplayConfiguration {
            rendering,
            ..configured(plan.mode, plan.rate)
        },
        texture: (rendering != Rendering::Fundamental).then_some(PLAIN_TEXTURE),
        surface: course.surface(),
        ..DisplayBench::new(course.hand(), 2.0, course.ends_s + 0.01)
    };
    let recording = display_alone::run(bench, firmware)?.recording;
    let rows = course.stretches.iter().map(|(from_s, stretch)| {
        let looked_at = (from_s + SETTLING_S, from_s + stretch.lasts_s);
        row(plan, stretch, &recording, looked_at)
    });
    Ok(rows.collect())
}

/// The steady stretch that makes a stimulus of `frequency_hz` at a usual λ.
fn steady(rate: UpdateRate, hand: Hand, frequency_hz: f64) -> Stretch {
    let count_a_tick_mm_s = MM_PER_COUNT * f64::from(rate.hz());
    let counts = (frequency_hz * USUAL_MM / count_a_tick_mm_s)
        .round()
        .max(1.0);
    let counts = counts + if hand == Hand::Between { BETWEEN } else { 0.0 };
    let speed_mm_s = counts * count_a_tick_mm_s;
    Stretch {
        hand,
        speed_mm_s,
        wavelength_mm: speed_mm_s / frequency_hz,
        lasts_s: SETTLING_S + LOOK_S,
    }
}

fn row(plan: &Plan, stretch: &Stretch, recording: &Recording, (from_s, to_s): (f64, f64)) -> Row {
    // One edge before what is looked at, so that there is a voltage to begin with.
    let outputs = &recording.outputs;
    let first = outputs.partition_point(|output| seconds(output.at_ns) <= from_s);
    let last = outputs.partition_point(|output| seconds(output.at_ns) < to_s);
    let outputs = outputs.get(first.saturating_sub(1)..last);
    let outputs = outputs.unwrap_or_default();
    let edges_s: Vec<f64> = outputs.iter().map(|o| seconds(o.at_ns)).collect();
    let channels = distinct(outputs.iter().map(|output| &output.words));
    let from_s = edges_s
        .first()
        .map_or(from_s, |&first_s| from_s.max(first_s));

    let (frequency_hz, cycles_hz) = match stretch.hand {
        Hand::Stroke { frequency_hz, .. } => (None, frequency_hz),
        Hand::Whole | Hand::Between => {
            let frequency_hz = stretch.speed_mm_s / stretch.wavelength_mm;
            (Some(frequency_hz), frequency_hz)
        }
    };
    let farthest_mv = |window_s: f64| {
        let channels = channels.iter().filter(|_| !edges_s.is_empty());
        let means = channels.filter_map(|channel| {
            Held::new(&edges_s, channel).farthest_mean((from_s, to_s), window_s)
        });
        1e3 * means.fold(0.0, |worst, mean| mean.abs().max(worst))
    };
    let mut row = Row {
        rate_hz: plan.rate.hz(),
        mode: plan.mode,
        hand: stretch.hand,
        speed_mm_s: stretch.peak_mm_s(),
        wavelength_mm: stretch.wavelength_mm,
        frequency_hz,
        uneven_ticks: uneven_ticks(recording, (from_s, to_s)),
        stimulus_v: None,
        spur: None,
        whole_mean_mv: farthest_mv(about_a_second_s(cycles_hz)),
        second_mean_mv: farthest_mv(1.0),
        spectrum: None,
    };
    let Some(frequency_hz) = frequency_hz.filter(|_| edges_s.len() > 1) else {
        return row;
    };
    let looked_at = (from_s, from_s + SPECTRUM_S);
    for spectrum in spectra(&edges_s, &channels, looked_at, HIGHEST_HZ) {
        let line = spectrum.line(frequency_hz);
        let Some((line, spur)) = line.zip(spectrum.worst_spur(frequency_hz)) else {
            continue;
        };
        let own_v = line.amplitude_v;
        let dbc = 20.0 * (spur.amplitude_v / own_v).log10();
        row.stimulus_v = Some(row.stimulus_v.map_or(own_v, |least: f64| least.min(own_v)));
        if row.spur.is_none_or(|(worst, _)| dbc > worst) {
            row.spur = Some((dbc, spur.frequency_hz));
            row.spectrum = (frequency_hz.round() == SHOWN_HZ).then_some(spectrum);
        }
    }
    row
}

/// The channels that differ from one another, in V.
fn distinct<'a>(words: impl Iterator<Item = &'a [u16; ACTUATORS]> + Clone) -> Vec<Vec<f64>> {
    let mut channels: Vec<Vec<u16>> = Vec::new();
    for actuator in 0..ACTUATORS {
        let channel: Vec<u16> = words.clone().map(|words| words[actuator]).collect();
        if !channels.contains(&channel) {
            channels.push(channel);
        }
    }
    let in_volts = |channel: Vec<u16>| channel.into_iter().map(volts).collect();
    channels.into_iter().map(in_volts).collect()
}

/// Ticks in which the hand's encoder went on by other than its commonest counts.
fn uneven_ticks(recording: &Recording, (from_s, to_s): (f64, f64)) -> usize {
    let ticks = recording.ticks.iter();
    let within = ticks.filter(|tick| (from_s..to_s).contains(&seconds(tick.at_ns)));
    let within: Vec<u16> = within.map(|tick| tick.encoder).collect();
    let mut counts: Vec<u16> = within
        .windows(2)
        .map(|pair| pair[1].wrapping_sub(pair[0]))
        .collect();
    counts.sort_unstable();
    let alike = counts.chunk_by(|one, other| one == other);
    counts.len() - alike.map(<[u16]>::len).max().unwrap_or(0)
}

impl Row {
    /// Whole counts are to have no spurs, everything no mean.
    fn is_met(&self) -> bool {
        let pure = self.hand != Hand::Whole || self.spur.is_some_and(|(dbc, _)| dbc <= GOAL_DBC);
        pure && self.whole_mean_mv <= GOAL_MEAN_MV
    }

    fn word_of_hand(&self) -> &'static str {
        match self.hand {
            Hand::Whole => "whole counts",
            Hand::Between => "between counts",
            Hand::Stroke { .. } => "strokes",
        }
    }

    /// The spectrum: Hz, and dB over the stimulus.
    fn levels_dbc(&self) -> Vec<(f64, f64)> {
        let (Some(spectrum), Some(frequency_hz)) = (&self.spectrum, self.frequency_hz) else {
            return Vec::new();
        };
        let own = spectrum.line(frequency_hz);
        let stimulus_v = own.map_or(1.0, |line| line.amplitude_v);
        let level = |(bin, amplitude_v): (u32, &f64)| {
            let dbc = 20.0 * (amplitude_v / stimulus_v).max(1e-9).log10();
            (f64::from(bin) * spectrum.bin_hz, dbc)
        };
        (0..).zip(&spectrum.amplitudes_v).map(level).collect()
    }
}

impl Study for Vec<Row> {
    const NAME: &'static str = "purity";

    fn table(&self) -> Option<Table> {
        let rows = self.iter().map(|row| {
            Record::default()
                .with("rate, Hz:", short(row.rate_hz))
                .with("mode", row.mode.name())
                .with("hand", row.word_of_hand())
                .with("mm/s:", number(row.speed_mm_s, 1))
                .with("λ, mm:", number(row.wavelength_mm, 2))
                .with("stimulus, Hz:", number(row.frequency_hz, 0))
                .with("V:", number(row.stimulus_v, 3))
                .with("worst spur, dBc:", number(row.spur.map(|spur| spur.0), 1))
                .with("at, Hz:", number(row.spur.map(|spur| spur.1), 1))
                .with("mean over whole cycles, mV:", number(row.whole_mean_mv, 2))
                .with("over any second, mV:", number(row.second_mean_mv, 1))
                .judged(row.is_met())
        });
        Some(rows.collect())
    }

    fn csvs(&self) -> Vec<(&'static str, String)> {
        let of = |row: &Row| {
            Record::default()
                .with("rate_hz", short(row.rate_hz))
                .with("mode", row.mode.name())
                .with("hand", row.word_of_hand())
        };
        let rows = self.iter().map(|row| {
            let hand_hz = match row.hand {
                Hand::Stroke { frequency_hz, .. } => Some(frequency_hz),
                Hand::Whole | Hand::Between => None,
            };
            of(row)
                .with("hand_hz", fixed(hand_hz, 4))
                .with("speed_mm_s", fixed(row.speed_mm_s, 4))
                .with("wavelength_mm", fixed(row.wavelength_mm, 4))
                .with("frequency_hz", fixed(row.frequency_hz, 4))
                .with("uneven_ticks", short(row.uneven_ticks))
                .with("stimulus_v", fixed(row.stimulus_v, 4))
                .with("spur_dbc", fixed(row.spur.map(|spur| spur.0), 4))
                .with("spur_hz", fixed(row.spur.map(|spur| spur.1), 4))
                .with("whole_cycles_mean_mv", fixed(row.whole_mean_mv, 4))
                .with("any_second_mean_mv", fixed(row.second_mean_mv, 4))
        });
        let lines = self.iter().flat_map(|row| {
            let levels = row.levels_dbc().into_iter();
            levels.map(move |(frequency_hz, dbc)| {
                of(row)
                    .with("frequency_hz", short(frequency_hz))
                    .with("level_dbc", fixed(dbc, 2))
            })
        });
        vec![("", csv(rows)), ("-spectra", csv(lines))]
    }

    fn picture(&self) -> String {
        picture::draw(self)
    }

    fn is_met(&self) -> bool {
        self.iter().all(Row::is_met)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim_core::run::recording::{Engine, OutputRecord, TickRecord};

    const RATE: UpdateRate = UpdateRate::Hz2000;

    fn plan() -> Plan {
        Plan {
            rate: RATE,
            mode: Mode::Uniform,
            hands: vec![Hand::Whole],
        }
    }

    /// What a display that rounds sines to words, and adds `offset_v` to channel 3, makes of a stretch.
    fn ideal(stretch: &Stretch, offset_v: f64) -> Recording {
        let ticks: Vec<TickRecord> = (0..10_000u64)
            .map(|tick| {
                let position_mm = stretch.speed_mm_s * tick as f64 / 2_000.0 + 0.002;
                TickRecord {
                    at_ns: tick * 500_000,
                    encoder: hil_sim_core::plant::motion::encoder(position_mm),
                    position_mm,
                }
            })
            .collect();
        let outputs = ticks
            .iter()
            .map(|tick| {
                let travel_mm = (tick.position_mm / MM_PER_COUNT).floor() * MM_PER_COUNT;
                let turns = travel_mm / stretch.wavelength_mm;
                let sine = 5.0 * (std::f64::consts::TAU * turns).sin();
                let word = |v: f64| {
                    (v / hil_sim_core::run::recording::WORD_V + 32_768.0)
                        .round()
                        .clamp(1.0, 65_535.0) as u16
                };
                OutputRecord {
                    at_ns: tick.at_ns,
                    words: std::array::from_fn(|channel| {
                        word(if channel == 3 { sine + offset_v } else { sine })
                    }),
                    skew_ns: 0,
                }
            })
            .collect();
        Recording {
            ticks,
            outputs,
            ..Recording::empty(Engine::Native, 5.0)
        }
    }

    #[test]
    fn an_ideal_display_with_whole_counts_is_as_pure_as_sixteen_bits_allow() {
        let stretch = steady(RATE, Hand::Whole, 40.0);
        let row = row(&plan(), &stretch, &ideal(&stretch, 0.0), (2.5, 4.7));
        assert_eq!(row.uneven_ticks, 0);
        // Rounding of a step q has a power of q²/12 in all, against A²/2 of the sine: −98 dB.
        let (dbc, _) = row.spur.unwrap();
        assert!(dbc < -98.0, "{row:?}");
        assert!((row.stimulus_v.unwrap() - 5.0).abs() < 0.01);
        assert!(row.whole_mean_mv < 0.1, "{}", row.whole_mean_mv);
    }

    #[test]
    fn an_ideal_display_between_counts_shows_the_encoder_s_steps() {
        let stretch = steady(RATE, Hand::Between, 40.0);
        let row = row(&plan(), &stretch, &ideal(&stretch, 0.0), (2.5, 4.7));
        assert!(row.uneven_ticks > 1_000);
        // The phase is rounded down to a count: a saw of 2π · 5 µm / λ, whose first line is 1/π of its
        // height, half of it on either side of the stimulus, 0.382 · 2 kHz away. The hold lets
        // sinc(π f / 2 kHz) of the lower one through.
        let saw_rad = std::f64::consts::TAU * MM_PER_COUNT / stretch.wavelength_mm;
        let side_hz = BETWEEN * 2_000.0 - 40.0;
        let held = std::f64::consts::PI * side_hz / 2_000.0;
        let due_dbc = 20.0 * (saw_rad / std::f64::consts::TAU * held.sin() / held).log10();
        let (dbc, frequency_hz) = row.spur.unwrap();
        assert!(
            (frequency_hz - side_hz).abs() < 0.1,
            "{frequency_hz} {side_hz}"
        );
        assert!((dbc - due_dbc).abs() < 0.1, "{dbc} {due_dbc}");
    }

    #[test]
    fn the_worst_of_the_channels_is_the_one_that_is_told() {
        let stretch = steady(RATE, Hand::Whole, 20.0);
        let row = row(&plan(), &stretch, &ideal(&stretch, -0.006), (2.5, 4.7));
        assert!(
            (row.whole_mean_mv - 6.0).abs() < 0.2,
            "{}",
            row.whole_mean_mv
        );
        assert!(!row.is_met());
    }
}
