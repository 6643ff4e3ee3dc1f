//! Every estimator on the same samples of every scene.
//!
//! A scene is run once, by the native engine; the scans that its sensor board was given are then given to
//! every contestant, and what it says of λ every tenth millisecond is judged as the board's estimates are.

use firmware_sensor::{SCANS_PER_SAMPLE, Scan, Sensor};
use protocol::{Contact, Estimate, GAUGES, GaugeHealth, Range, SensorConfiguration};

use hil_sim_core::judge::truth::Truth;
use hil_sim_core::judge::{Summary, estimates};
use hil_sim_core::native;
use hil_sim_core::plant::surface::Surface;
use hil_sim_core::run::recording::{EstimateRecord, Recording};
use hil_sim_core::scene::{Scene, SceneError};

use super::baselines::Rival;
use super::baselines::adapter::{Answer, Entrant};
use super::baselines::registry::{Visitor, show_all};
use super::parts::{RIVALS_FROM, SETTINGS_FROM};
use super::pitch::{mcleod, operations_of_mcleod, operations_of_yin, yin};
use super::settings::{SETTINGS, Setting};
use crate::study::Progress;

pub struct Contestant {
    pub method: &'static str,
    pub knob: &'static str,
    pub value: u16,
    pub setting: Option<Setting>,
    pub work: Work,
    start: Box<dyn Fn(SensorConfiguration) -> Box<dyn Run> + Send + Sync>,
}

/// How its cost is known.
#[derive(Clone, Copy, Debug)]
pub enum Work {
    /// It runs on the board: the part of this number there.
    Part(u32),
    /// It does not: operations of an answer on the host.
    Operations(fn() -> u64),
}

trait Run {
    fn step(&mut self, scans: &[Scan; SCANS_PER_SAMPLE], encoder: u16) -> Option<Answer>;
}

impl<R: Rival> Run for Entrant<R> {
    fn step(&mut self, scans: &[Scan; SCANS_PER_SAMPLE], encoder: u16) -> Option<Answer> {
        Entrant::step(self, scans, encoder)
    }
}

struct Board {
    sensor: Sensor,
    instant_us: u64,
}

impl Run for Board {
    fn step(&mut self, scans: &[Scan; SCANS_PER_SAMPLE], encoder: u16) -> Option<Answer> {
        self.instant_us += 1_000;
        let output = self.sensor.step(self.instant_us, scans, encoder);
        output.estimate.map(|estimate| Answer {
            wavelength_mm: estimate.wavelength_mm,
            valid: estimate.valid,
        })
    }
}

impl Contestant {
    /// The firmware's sensor with a setting, whose cost is that of a part.
    pub fn ours(setting: Setting, part: u32) -> Self {
        Self {
            method: setting.method_name(),
            knob: setting.knob_name(),
            value: setting.value,
            setting: Some(setting),
            work: Work::Part(part),
            start: Box::new(move |scene| {
                Box::new(Board {
                    sensor: Sensor::new(setting.on(scene)),
                    instant_us: 0,
                })
            }),
        }
    }

    fn rival<R: Rival + 'static>(
        method: &'static str,
        value: u16,
        work: Work,
        rival: fn() -> R,
    ) -> Self {
        Self {
            method,
            knob: match method {
                "PLL" => "bandwidth_hz",
                "Pei–Tseng notch" => "memory_ms",
                _ => "window_ms",
            },
            value,
            setting: None,
            work,
            start: Box::new(move |_| Box::new(Entrant::new(rival()))),
        }
    }
}

pub fn contestants() -> Vec<Contestant> {
    let ours = (SETTINGS_FROM..).zip(SETTINGS);
    let mut field = Field(ours.map(|(part, of)| Contestant::ours(of, part)).collect());
    show_all(&mut field);
    let [yin_160, yin_320] = [operations_of_yin::<160>, operations_of_yin::<320>];
    let mcleod_160 = Work::Operations(operations_of_mcleod::<160, 256>);
    let mcleod_320 = Work::Operations(operations_of_mcleod::<320, 512>);
    field.0.extend([
        Contestant::rival("YIN", 160, Work::Operations(yin_160), yin::<160>),
        Contestant::rival("YIN", 320, Work::Operations(yin_320), yin::<320>),
        Contestant::rival("McLeod", 160, mcleod_160, mcleod::<160, 256>),
        Contestant::rival("McLeod", 320, mcleod_320, mcleod::<320, 512>),
    ]);
    field.0
}

struct Field(Vec<Contestant>);

impl Visitor for Field {
    fn visit<R: Rival + 'static>(&mut self, method: &'static str, value: u16, rival: fn() -> R) {
        let before = (self.0.len() - SETTINGS.len()) as u32;
        let work = Work::Part(RIVALS_FROM + before);
        self.0.push(Contestant::rival(method, value, work, rival));
    }
}

/// Runs every contestant over every scene: for each scene, in the order given, a summary
/// for each contestant, in theirs. What is said before `from_s` of a scene is not judged.
pub fn run(
    contestants: &[Contestant],
    scenes: &[&Scene],
    from_s: impl Fn(&Scene) -> f64 + Sync,
    progress: &impl Progress,
) -> Result<Vec<Vec<Summary>>, SceneError> {
    progress.begin(scenes.len());
    progress.each(scenes, |scene| run_scene(contestants, scene, from_s(scene)))
}

fn run_scene(
    contestants: &[Contestant],
    scene: &Scene,
    from_s: f64,
) -> Result<Vec<Summary>, SceneError> {
    let mut recording = native::run(scene)?;
    let surface = Surface::new(&scene.surface, 0.0);
    let wavelength_mm = |x_mm| surface.wavelength_mm(x_mm);
    let truth = Truth::new(&scene.name, "", &wavelength_mm);
    let summary = |contestant: &Contestant| {
        let mut started = (contestant.start)(scene.sensor_configuration());
        let mut answers = answers(&mut *started, &recording);
        answers.retain(|record| record.made_ns as f64 * 1e-9 >= from_s);
        recording.estimates = answers;
        estimates::judge(&truth, &recording).1
    };
    Ok(contestants.iter().map(summary).collect())
}

fn answers(contestant: &mut dyn Run, recording: &Recording) -> Vec<EstimateRecord> {
    let mut records = Vec::with_capacity(recording.estimates.len());
    for scans in recording.scans.as_chunks::<SCANS_PER_SAMPLE>().0 {
        let last = &scans[SCANS_PER_SAMPLE - 1];
        let codes = scans.map(|scan| scan.codes);
        if let Some(answer) = contestant.step(&codes, last.encoder) {
            records.push(EstimateRecord {
                made_ns: last.at_ns,
                received_ns: None,
                estimate: estimate(answer, records.len() as u32, last.at_ns / 1_000),
            });
        }
    }
    records
}

/// An answer, as the board would send it.
fn estimate(answer: Answer, sequence: u32, instant_us: u64) -> Estimate {
    Estimate {
        sequence,
        instant_us,
        wavelength_mm: answer.wavelength_mm,
        valid: answer.valid,
        confidence: f32::from(u8::from(answer.valid)),
        amplitude_lsb: 0.0,
        counted_mm: None,
        range: Range::T1,
        contact: Contact::Unknown,
        velocity_um_s: 0,
        lag_um: None,
        gauges_used: 0,
        health: [GaugeHealth::Good; GAUGES],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimators::baselines::HEARD;

    /// What a rival hears of a clean sine, and how far off it may be by its own documentation, in Hz, once
    /// its longest window is full.
    fn error_hz(rival: &mut dyn Rival, frequency_hz: f64) -> Option<f64> {
        let mut worst: Option<f64> = None;
        for ms in 0..8_000 {
            let sine = (std::f64::consts::TAU * frequency_hz * f64::from(ms) / 1_000.0).sin();
            let mut sample = [0.0; GAUGES];
            sample[HEARD] = 300.0 * sine as f32;
            rival.push(&sample);
            if ms > 7_000 && ms % 10 == 9 {
                let error = (f64::from(rival.frequency_hz()?) - frequency_hz).abs();
                worst = Some(worst.map_or(error, |worst| worst.max(error)));
            }
        }
        worst
    }

    /// What is left of AR(2)'s closed form when the window holds no whole number of half waves: with
    /// θ = ωτ, τ = 3 ms, the mean c of cos 2φ over it is at most 1/(N' sin ω), which moves θ by
    /// c · sin θ cos θ / (cos² θ + ½), to first order (a tenth for the second).
    fn ripple_hz(frequency_hz: f64, window_ms: f64) -> f64 {
        let omega = std::f64::consts::TAU * frequency_hz / 1_000.0;
        let theta = 3.0 * omega;
        let mean = 1.0 / ((window_ms - 6.0) * omega.sin());
        let moved = mean * theta.sin() * theta.cos().abs() / (theta.cos().powi(2) + 0.5);
        1.1 * moved * 1_000.0 / (std::f64::consts::TAU * 3.0)
    }

    /// By how much the tone's image at −f, and the mean that the swing is without, move the peak of a
    /// Hann window's spectrum. In the window's own lines the main lobe is 1 − 0.645 x², the slope of the
    /// side lobes x away at most 1/(x (x² − 1)), and what is moved is their sum over 2 · 0.645 (a tenth
    /// for the second order). The mean of a sine over the window is at most 1/(π cycles). Goertzel's
    /// recursion in f32 leaves some hundred roundings in each of the three powers of the last parabola,
    /// 1/24 of a Fourier line apart.
    fn image_hz(frequency_hz: f64, window_ms: f64) -> f64 {
        let cycles = frequency_hz * window_ms / 1_000.0;
        let slope = |lines: f64| 1.0 / (lines * (lines * lines - 1.0));
        let mean = 2.0 / (std::f64::consts::PI * cycles);
        let moved = (slope(2.0 * cycles) + mean * slope(cycles)) / 1.29;
        let step_hz = 1_000.0 / 512.0 / 24.0;
        let bend = 2.0 * 1.29 * (step_hz * window_ms / 1_000.0).powi(2);
        let rounded_hz = step_hz * 100.0 * f64::from(f32::EPSILON) / (2.0 * bend);
        1.1 * moved * 1_000.0 / window_ms + rounded_hz
    }

    struct Check;

    impl Visitor for Check {
        fn visit<R: Rival + 'static>(
            &mut self,
            method: &'static str,
            value: u16,
            rival: fn() -> R,
        ) {
            for frequency_hz in [20.0, 33.3, 47.0, 71.0] {
                let window = f64::from(value);
                let bound = match method {
                    // Half of the distance of two filters, half of the window's own line.
                    "Goertzel" => 0.25 * 1_000.0 / window,
                    "FFT" => 0.5 * 1_000.0 / window,
                    "AR(2)" => ripple_hz(frequency_hz, window),
                    "harmonic NLS" => image_hz(frequency_hz, window),
                    // It takes the tone out wholly, so only rounding is left: of the coefficient's
                    // 2⁻²³, say a hundred, at df = dc / (2 sin ω).
                    "Pei–Tseng notch" => {
                        let omega = std::f64::consts::TAU * frequency_hz / 1_000.0;
                        100.0 * f64::from(f32::EPSILON) / (2.0 * omega.sin()) * 1_000.0
                            / std::f64::consts::TAU
                    }
                    // The PLL's quadrature is off by 0.7°, which swings the phase by half of that at
                    // twice the frequency: so much frequency if the loop followed all of it.
                    _ => 2.0 * frequency_hz * 0.5 * 0.7f64.to_radians(),
                };
                let error = error_hz(&mut rival(), frequency_hz);
                assert!(
                    error.is_some_and(|error| error <= bound),
                    "{method} {value}: {error:?} Hz off at {frequency_hz} Hz, {bound} allowed"
                );
            }
        }
    }

    #[test]
    fn each_rival_on_the_board_finds_a_clean_sine_within_its_resolution() {
        show_all(&mut Check);
    }

    #[test]
    fn yin_and_mcleod_find_a_clean_sine_within_half_a_lag() {
        // McLeod's correlation falls as 1 − τ/N (see `crate::estimators::pitch`), which moves its peak at the
        // period T by T²/(4π² (N − T)).
        let moved_ms =
            |window_ms: f64, period_ms: f64| period_ms.powi(2) / (39.5 * (window_ms - period_ms));
        let mut detectors: [(&str, f64, Box<dyn Rival>); 4] = [
            ("YIN", 160.0, Box::new(yin::<160>())),
            ("YIN", 320.0, Box::new(yin::<320>())),
            ("McLeod", 160.0, Box::new(mcleod::<160, 256>())),
            ("McLeod", 320.0, Box::new(mcleod::<320, 512>())),
        ];
        for (name, window_ms, detector) in &mut detectors {
            for frequency_hz in [20.0, 33.3, 47.0, 71.0] {
                let own_ms = match *name {
                    "McLeod" => moved_ms(*window_ms, 1_000.0 / frequency_hz),
                    _ => 0.0,
                };
                // df = f² dT.
                let bound = frequency_hz * frequency_hz * (0.5 + own_ms) * 1e-3;
                let error = error_hz(&mut **detector, frequency_hz);
                assert!(
                    error.is_some_and(|error| error <= bound),
                    "{name} {window_ms}: {error:?} Hz off at {frequency_hz} Hz, {bound} allowed"
                );
            }
        }
    }

    #[test]
    fn the_board_takes_every_setting() {
        for setting in SETTINGS {
            let configuration = setting.on(SensorConfiguration::DEFAULT);
            assert_eq!(configuration.check(), Ok(()), "{setting:?}");
        }
    }

    #[test]
    fn a_contest_is_the_same_each_time_and_in_the_order_given() {
        let scenes = [Scene::constant(2.0, 50.0), Scene::constant(3.0, 70.0)];
        let scenes: Vec<&Scene> = scenes.iter().collect();
        let field = contestants();
        let first = run(&field, &scenes, |_| 0.0, &()).unwrap();
        assert_eq!(first, run(&field, &scenes, |_| 0.0, &()).unwrap());
        assert_eq!(first.len(), 2);
        let backwards: Vec<&Scene> = scenes.iter().rev().copied().collect();
        let second = run(&field, &backwards, |_| 0.0, &()).unwrap();
        assert_eq!(first[0], second[1]);
        assert_eq!(first[0].len(), field.len());
    }
}
