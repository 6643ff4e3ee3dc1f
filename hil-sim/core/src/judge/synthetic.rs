//! Recordings of a made-up run whose answers are known, for the tests of whatever reads recordings: a pair of
//! boards without fault, a sine surface.

use protocol::{CHANNELS, Contact, Estimate, GAUGES, GaugeHealth, Range};

use crate::plant::motion::MM_PER_COUNT;
use crate::run::recording::{
    ACTUATORS, Arrival, Engine, EstimateRecord, OutputRecord, Recording, ScanRecord, TickRecord,
};

/// From one output tick to the next, in s.
pub const TICK_S: f64 = 500e-6;
/// The default time in which 1/λ̂ glides, in s.
const GLIDE_S: f64 = 0.02;
/// From one scan to the next, in s.
pub const SCAN_S: f64 = 250e-6;
/// From one estimate to the next, in s.
pub const ESTIMATE_S: f64 = 10e-3;
/// One gauge is left out.
const HEALTH: [GaugeHealth; GAUGES] = [
    GaugeHealth::Good,
    GaugeHealth::Dead,
    GaugeHealth::Good,
    GaugeHealth::Good,
    GaugeHealth::Good,
];
const FADE_IN_S: f64 = 20e-3;

/// A run to be made up. Every closure takes s since the start, [`Run::surface_mm`] takes mm.
pub struct Run {
    /// How long, in s.
    pub duration_s: f64,
    /// Where hand and arm both are, in mm.
    pub position_mm: Box<dyn Fn(f64) -> f64>,
    /// λ at a position, in mm.
    pub surface_mm: Box<dyn Fn(f64) -> f64>,
    /// λ̂ in mm and whether it is valid.
    pub estimate: Box<dyn Fn(f64) -> (f32, bool)>,
    /// From an estimate's instant to its arrival, in s.
    pub transit_s: f64,
    /// From a tick to its LDAC edge, in s.
    pub edge_s: Box<dyn Fn(f64) -> f64>,
    /// What the stimulus is ahead of its due phase, in cycles.
    pub ahead_cycles: Box<dyn Fn(f64) -> f64>,
    /// The sines' amplitude, in V.
    pub amplitude_v: f64,
    /// Added to every actuator's voltage, in V: what goes beyond ± 5 V with it is cut off.
    pub standing_v: Box<dyn Fn(f64) -> f64>,
    /// Added to actuator 7's voltage, in V.
    pub offset_v: f64,
    /// Phase from one actuator to the next, in mm of place.
    pub pitch_mm: f64,
}

impl Run {
    /// `speed_mm_s` on one specimen of `wavelength_mm`, rightly estimated, outputs without delay.
    pub fn steady(speed_mm_s: f64, wavelength_mm: f64) -> Self {
        Self {
            duration_s: 2.0,
            position_mm: Box::new(move |t_s| speed_mm_s * t_s),
            surface_mm: Box::new(move |_| wavelength_mm),
            estimate: Box::new(move |_| (wavelength_mm as f32, true)),
            transit_s: 1e-3,
            edge_s: Box::new(|_| 0.0),
            ahead_cycles: Box::new(|_| 0.0),
            amplitude_v: 5.0,
            standing_v: Box::new(|_| 0.0),
            offset_v: 0.0,
            pitch_mm: 0.0,
        }
    }

    /// A hand that swings, v = peak sin(2π f t), on λ.
    pub fn swinging(peak_mm_s: f64, frequency_hz: f64, wavelength_mm: f64) -> Self {
        let turn = std::f64::consts::TAU * frequency_hz;
        Self {
            position_mm: Box::new(move |t_s| peak_mm_s / turn * (1.0 - (turn * t_s).cos())),
            ..Self::steady(peak_mm_s, wavelength_mm)
        }
    }

    /// A hand that goes to and fro at one speed, `stroke_s` each way, on λ.
    pub fn to_and_fro(speed_mm_s: f64, stroke_s: f64, wavelength_mm: f64) -> Self {
        Self {
            position_mm: Box::new(move |t_s| {
                let into_s = t_s % (2.0 * stroke_s);
                speed_mm_s * into_s.min(2.0 * stroke_s - into_s)
            }),
            ..Self::steady(speed_mm_s, wavelength_mm)
        }
    }

    /// Makes the recording up.
    pub fn record(&self) -> Recording {
        let estimates = self.estimates();
        let ticks: Vec<TickRecord> = instants(TICK_S, self.duration_s)
            .map(|t_s| TickRecord {
                at_ns: nanoseconds(t_s),
                encoder: self.counts(t_s) as u16,
                position_mm: (self.position_mm)(t_s),
            })
            .collect();
        Recording {
            wall_s: 0.001,
            hash: 0x0123_4567_89ab_cdef,
            scans: instants(SCAN_S, self.duration_s)
                .map(|t_s| self.scan(t_s))
                .collect(),
            outputs: self.outputs(&ticks, &estimates),
            ticks,
            arrived: Arrival::of(&estimates),
            estimates,
            ..Recording::empty(Engine::Native, self.duration_s)
        }
    }

    fn counts(&self, t_s: f64) -> i64 {
        ((self.position_mm)(t_s) / MM_PER_COUNT).floor() as i64
    }

    fn scan(&self, t_s: f64) -> ScanRecord {
        let x_mm = (self.position_mm)(t_s);
        let cycles = x_mm / (self.surface_mm)(x_mm);
        let mut codes = [2_048; CHANNELS];
        for (gauge, code) in codes[..GAUGES].iter_mut().enumerate() {
            let phase = std::f64::consts::TAU * cycles + gauge as f64;
            *code = (2_048.0 + 400.0 * phase.sin()) as u16;
        }
        ScanRecord {
            at_ns: nanoseconds(t_s),
            codes,
            encoder: self.counts(t_s) as u16,
            position_mm: x_mm,
        }
    }

    fn estimates(&self) -> Vec<EstimateRecord> {
        instants(ESTIMATE_S, self.duration_s)
            .skip(1)
            .enumerate()
            .map(|(sequence, t_s)| {
                let (wavelength_mm, valid) = (self.estimate)(t_s);
                let received_s = t_s + self.transit_s;
                EstimateRecord {
                    made_ns: nanoseconds(t_s),
                    received_ns: (received_s < self.duration_s).then(|| nanoseconds(received_s)),
                    estimate: Estimate {
                        sequence: sequence as u32,
                        instant_us: nanoseconds(t_s) / 1_000,
                        wavelength_mm: Some(wavelength_mm),
                        valid,
                        confidence: 0.75,
                        amplitude_lsb: 400.0,
                        counted_mm: Some(2.25),
                        range: Range::T1,
                        contact: Contact::Slip,
                        velocity_um_s: 0,
                        lag_um: None,
                        gauges_used: 0b1_1101,
                        health: HEALTH,
                    },
                }
            })
            .collect()
    }

    /// A display as it should be, but for estimates that change while it glides: phase from the encoder's counts and the
    /// last valid λ̂ received, to which 1/λ̂ glides.
    fn outputs(&self, ticks: &[TickRecord], estimates: &[EstimateRecord]) -> Vec<OutputRecord> {
        let mut outputs = Vec::new();
        let mut held = [0x8000; ACTUATORS];
        let (mut cycles, mut on_since_s) = (0.0, None);
        let (mut per_mm, mut target_per_mm, mut ticks_left) = (0.0, 0.0, 0.0);
        for pair in ticks.windows(2) {
            let t_s = pair[1].at_ns as f64 / 1e9;
            let in_force = estimates
                .iter()
                .rfind(|e| e.estimate.valid && e.received_ns.is_some_and(|at| at <= pair[0].at_ns));
            let Some(wavelength_mm) = in_force.and_then(|e| e.estimate.wavelength_mm) else {
                continue;
            };
            if target_per_mm != 1.0 / f64::from(wavelength_mm) {
                target_per_mm = 1.0 / f64::from(wavelength_mm);
                ticks_left = if per_mm == 0.0 { 1.0 } else { GLIDE_S / TICK_S };
            }
            if ticks_left > 0.0 {
                per_mm += (target_per_mm - per_mm) / ticks_left;
                ticks_left -= 1.0;
            }
            let counts = pair[1].encoder.wrapping_sub(pair[0].encoder) as i16;
            cycles += f64::from(counts) * MM_PER_COUNT * per_mm;
            let on_s = t_s - *on_since_s.get_or_insert(t_s);
            let amplitude_v = self.amplitude_v * (on_s / FADE_IN_S).min(1.0);
            let mut words = [0; ACTUATORS];
            for (actuator, word) in words.iter_mut().enumerate() {
                let place = actuator as f64 * self.pitch_mm * per_mm;
                let phase = std::f64::consts::TAU * (cycles + (self.ahead_cycles)(t_s) + place);
                let offset_v = if actuator == 7 { self.offset_v } else { 0.0 };
                let standing_v = (self.standing_v)(t_s) + offset_v;
                *word = word_of(amplitude_v * phase.sin() + standing_v);
            }
            if words != held {
                held = words;
                let at_ns = nanoseconds(t_s + (self.edge_s)(t_s));
                outputs.push(OutputRecord {
                    at_ns,
                    words,
                    skew_ns: 0,
                });
            }
        }
        outputs
    }
}

/// The DAC word of a voltage in the ±5 V range.
pub fn word_of(volts: f64) -> u16 {
    (volts * 6_553.6 + 32_768.0).round().clamp(0.0, 65_535.0) as u16
}

fn instants(step_s: f64, end_s: f64) -> impl Iterator<Item = f64> {
    (0..(end_s / step_s).round() as u32).map(move |i| f64::from(i) * step_s)
}

/// An instant in s as ns.
pub fn nanoseconds(t_s: f64) -> u64 {
    (t_s * 1e9).round() as u64
}
