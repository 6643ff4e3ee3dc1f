//! What a stimulus really presents: the hand's travel for each wave of the voltage.
//!
//! A wave goes from crest to crest. A crest is where the hand is halfway between the upward and the next
//! downward crossing of 0 V: a voltage that stands under the sine after a reversal moves the two apart and
//! leaves their middle. Crossings are taken between LDAC edges, places between ticks. Only whole waves
//! within one stroke of the hand count, and only where the voltage comes up to half of its full swing: what
//! fades is not felt.

use hil_sim_core::judge::seconds;
use hil_sim_core::judge::track::Track;
use hil_sim_core::run::recording::{Recording, volts};

/// Voltage that a wave must reach either way to be felt, in V: half of the paper's 5 V.
const FELT_V: f64 = 2.5;
/// The actuator that is felt: in the middle of the array. All of them have one phase.
pub const ACTUATOR: usize = 24;

/// One wave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    /// When its first crest was, and its last.
    pub from_s: f64,
    pub to_s: f64,
    /// How far the hand went meanwhile: the wavelength presented.
    pub wavelength_mm: f64,
    /// The hand's stroke that it is of, counted from the first.
    pub stroke: usize,
}

impl Wave {
    fn lasts_s(&self) -> f64 {
        self.to_s - self.from_s
    }
}

/// The waves of a stimulus, in order, at least one.
#[derive(Clone, Debug, PartialEq)]
pub struct Felt {
    pub waves: Vec<Wave>,
    /// When each wave ends, in s of waves alone.
    ends_s: Vec<f64>,
}

/// For how long a sensation is gathered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum IntegrationWindow {
    Wave,
    /// So many s, or until the stroke ends.
    Seconds(f64),
    Stroke,
}

impl Felt {
    /// What an actuator of a run presents between two instants, in s; none if not one wave is felt.
    pub fn of(recording: &Recording, actuator: usize, from_s: f64, to_s: f64) -> Option<Self> {
        let hand = Track::of_hand(recording);
        let outputs = recording.outputs.iter();
        let points = outputs.map(|output| (seconds(output.at_ns), volts(output.words[actuator])));
        let points: Vec<(f64, f64)> = points.collect();
        let mut waves = Vec::new();
        for (stroke, (first_s, last_s)) in hand.strokes().into_iter().enumerate() {
            let first = points.partition_point(|point| point.0 < first_s.max(from_s));
            let end = points.partition_point(|point| point.0 <= last_s.min(to_s));
            if first < end {
                waves.extend(of_stroke(&points[first..end], &hand, stroke));
            }
        }
        Self::new(waves)
    }

    pub(super) fn new(waves: Vec<Wave>) -> Option<Self> {
        let mut end_s = 0.0;
        let ends_s = waves.iter().map(|wave| {
            end_s += wave.lasts_s();
            end_s
        });
        let ends_s = ends_s.collect();
        (!waves.is_empty()).then_some(Self { waves, ends_s })
    }

    /// A stimulus without any error.
    pub fn steady(wavelength_mm: f64) -> Self {
        let wave = Wave {
            from_s: 0.0,
            to_s: 1.0,
            wavelength_mm,
            stroke: 0,
        };
        Self {
            waves: vec![wave],
            ends_s: vec![1.0],
        }
    }

    fn lasts_s(&self) -> f64 {
        self.ends_s.last().copied().unwrap_or(0.0)
    }

    pub fn mean_mm(&self) -> f64 {
        self.mean(|mm| mm)
    }

    /// Root of the mean square over time of the distance from the mean, relative to it, in %.
    pub fn scatter_percent(&self) -> f64 {
        let mean_mm = self.mean_mm();
        100.0 * self.mean(|mm| (mm / mean_mm - 1.0).powi(2)).sqrt()
    }

    /// Root of the mean square over time of the distance from the truth, relative to it, in %.
    pub fn error_percent(&self, truth_mm: f64) -> f64 {
        100.0 * self.mean(|mm| (mm / truth_mm - 1.0).powi(2)).sqrt()
    }

    fn mean(&self, value: impl Fn(f64) -> f64) -> f64 {
        let waves = self.waves.iter();
        let all = waves.map(|wave| wave.lasts_s() * value(wave.wavelength_mm));
        all.sum::<f64>() / self.lasts_s()
    }

    /// What is felt from a share of the time on, 0 to 1, of a glimpse: travel over waves, in mm.
    pub fn glimpse_mm(&self, share: f64, glimpse: IntegrationWindow) -> f64 {
        let at_s = share * self.lasts_s();
        let met = self.ends_s.partition_point(|&end_s| end_s <= at_s);
        let met = met.min(self.waves.len() - 1);
        let Wave { stroke, .. } = self.waves[met];
        let of_stroke = |wave: &&Wave| wave.stroke == stroke;
        let (mut travel_mm, mut waves, mut time_s) = (0.0, 0.0, 0.0);
        let mut gather = |wave: &Wave| {
            travel_mm += wave.wavelength_mm;
            waves += 1.0;
            time_s += wave.lasts_s();
            time_s
        };
        match glimpse {
            IntegrationWindow::Wave => {
                gather(&self.waves[met]);
            }
            IntegrationWindow::Seconds(seconds) => {
                for wave in self.waves[met..].iter().take_while(of_stroke) {
                    if gather(wave) >= seconds {
                        break;
                    }
                }
            }
            IntegrationWindow::Stroke => {
                for wave in self.waves.iter().filter(of_stroke) {
                    gather(wave);
                }
            }
        }
        travel_mm / waves
    }
}

#[derive(Clone, Copy, Debug)]
struct Crossing {
    t_s: f64,
    x_mm: f64,
    upward: bool,
    /// The highest voltage of either sign since the one before, in V.
    peak_v: f64,
}

fn of_stroke(points: &[(f64, f64)], hand: &Track, stroke: usize) -> Vec<Wave> {
    let mut crossings = Vec::new();
    let mut peak_v = 0.0f64;
    for pair in points.windows(2) {
        let [(from_s, from_v), (to_s, to_v)] = [pair[0], pair[1]];
        peak_v = peak_v.max(from_v.abs());
        let upward = from_v < 0.0 && to_v >= 0.0;
        if upward || from_v > 0.0 && to_v <= 0.0 {
            let t_s = from_s + (to_s - from_s) * from_v / (from_v - to_v);
            if let Some(x_mm) = hand.position_mm(t_s) {
                crossings.push(Crossing {
                    t_s,
                    x_mm,
                    upward,
                    peak_v,
                });
            }
            peak_v = 0.0;
        }
    }
    // Up, down, up, down: the first two are flanks of a crest, the last two of the next.
    let flanks = crossings.windows(4).filter(|flanks| {
        let whole = flanks[0].upward && !flanks[1].upward && flanks[2].upward && !flanks[3].upward;
        whole && flanks[1..].iter().all(|flank| flank.peak_v >= FELT_V)
    });
    flanks
        .map(|flanks| Wave {
            from_s: 0.5 * (flanks[0].t_s + flanks[1].t_s),
            to_s: 0.5 * (flanks[2].t_s + flanks[3].t_s),
            wavelength_mm: 0.5
                * (flanks[2].x_mm + flanks[3].x_mm - flanks[0].x_mm - flanks[1].x_mm).abs(),
            stroke,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim_core::judge::synthetic::Run;
    use hil_sim_core::plant::motion::MM_PER_COUNT;

    /// A stimulus follows the hand's encoder: a count, 5 µm, at either end of a wave. What straight lines
    /// between ticks miss is far less: of a crossing (2π · 35 Hz · 0.5 ms)³/16π = 2.6e-5 of a wave.
    const WAVE_MM: f64 = 2.0 * MM_PER_COUNT;

    fn felt(run: &Run) -> Felt {
        Felt::of(&run.record(), ACTUATOR, 0.0, f64::INFINITY).unwrap()
    }

    #[test]
    fn a_clean_stimulus_presents_its_wavelength_at_every_wave() {
        let felt = felt(&Run::swinging(70.0, 0.83, 2.0));
        for wave in &felt.waves {
            assert!((wave.wavelength_mm - 2.0).abs() < WAVE_MM, "{wave:?}");
        }
        assert!((felt.mean_mm() - 2.0).abs() < WAVE_MM);
        assert!(felt.error_percent(2.0) < 100.0 * WAVE_MM / 2.0);
    }

    #[test]
    fn a_voltage_that_stands_under_the_sine_moves_nothing() {
        let clean = felt(&Run::to_and_fro(50.0, 0.6, 2.0));
        let lifted = felt(&Run {
            amplitude_v: 4.0,
            standing_v: Box::new(|_| 0.5),
            ..Run::to_and_fro(50.0, 0.6, 2.0)
        });
        assert!((clean.mean_mm() - lifted.mean_mm()).abs() < WAVE_MM);
        assert!(lifted.scatter_percent() < 100.0 * WAVE_MM / 2.0);
    }

    #[test]
    fn a_glimpse_is_of_a_wave_of_a_stretch_or_of_a_stroke() {
        let wave = |from: u32, wavelength_mm: f64, stroke: usize| Wave {
            from_s: f64::from(from),
            to_s: f64::from(from + 1),
            wavelength_mm,
            stroke,
        };
        let felt = Felt::new(vec![
            wave(0, 1.0, 0),
            wave(1, 2.0, 0),
            wave(2, 6.0, 0),
            wave(5, 9.0, 1),
        ])
        .unwrap();
        assert_eq!(felt.glimpse_mm(0.3, IntegrationWindow::Wave), 2.0);
        assert_eq!(felt.glimpse_mm(0.3, IntegrationWindow::Seconds(1.5)), 4.0);
        assert_eq!(felt.glimpse_mm(0.3, IntegrationWindow::Seconds(9.0)), 4.0);
        assert_eq!(felt.glimpse_mm(0.3, IntegrationWindow::Stroke), 3.0);
        assert_eq!(felt.glimpse_mm(0.99, IntegrationWindow::Stroke), 9.0);
        assert_eq!(felt.glimpse_mm(1.0, IntegrationWindow::Wave), 9.0);
        assert_eq!(felt.mean_mm(), 4.5);
    }

    #[test]
    fn silence_is_not_felt() {
        let run = Run {
            amplitude_v: 1.0,
            ..Run::steady(50.0, 2.0)
        };
        assert_eq!(Felt::of(&run.record(), ACTUATOR, 0.0, f64::INFINITY), None);
    }
}
