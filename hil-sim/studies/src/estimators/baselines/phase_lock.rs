//! The phase-locked loop of the crate `idsp` (a loop of the third order, second type, in integers) on the
//! phase of one gauge's band-passed signal, with a lock detector.
//!
//! The crate's loop follows a phase, not a voltage. The phase is that of the analytic signal, from a pair of
//! all-pass filters a quarter of a turn apart: the poles are O. Niemitalo's (Hilbert transform, 1999), for
//! 0.45 to 499 Hz here, within 0.7°.

use core::f32::consts::PI;

use dsp_process::SplitProcess;
use firmware_sensor::bandpass::{BAND, BandPass, Lane, ORDER};
use idsp::{Complex, PLL, PLLState};
use protocol::GAUGES;

use super::{HEARD, LOWEST_HZ, Rival};

const DT_S: f32 = 1.0 / firmware_sensor::SAMPLE_RATE_HZ as f32;
/// Ratio of the loop's pole and zero to its crossover: 62° of phase margin, as the crate says.
const SPLIT: f32 = 4.0;
/// Time constant of the lock detector, in s.
const WATCH_S: f32 = 0.1;
/// Mean cosine of the phase error above which the loop counts as locked.
const LOCKED: f32 = 0.6;
/// A mean of the band-pass' delay over its band, in half ms.
const BAND_PASS_DELAY_HALF_MS: f32 = 8.0;
/// The all-pass filters' delay, in cycles of the tone: 0.28 to 0.31 from 5 to 100 Hz.
const SPLITTER_DELAY_CYCLES: f32 = 0.29;
/// Integer steps of an ADC step: 4096 of them stay below 2³¹.
const FINE: f32 = (1 << 18) as f32;

/// Poles of the two branches, on the real axis in z².
const BRANCHES: [[f32; 4]; 2] = [
    [0.402_192_12, 0.856_171_1, 0.972_290_95, 0.995_288_5],
    [0.692_387_8, 0.936_065_4, 0.988_229_5, 0.998_748_84],
];

/// The phase splitter: its outputs are a quarter of a turn apart.
#[derive(Clone, Debug, Default)]
struct Splitter {
    branches: [[AllPass; 4]; 2],
    /// The second branch's output is a sample late.
    late: f32,
}

/// (p² − z⁻²)/(1 − p² z⁻²).
#[derive(Clone, Copy, Debug, Default)]
struct AllPass {
    inputs: [f32; 2],
    outputs: [f32; 2],
}

impl AllPass {
    fn step(&mut self, pole: f32, x: f32) -> f32 {
        let y = pole * pole * (x + self.outputs[1]) - self.inputs[1];
        self.inputs = [x, self.inputs[0]];
        self.outputs = [y, self.outputs[0]];
        y
    }
}

impl Splitter {
    /// Cosine and sine of the tone that x is.
    fn step(&mut self, x: f32) -> (f32, f32) {
        let mut through = [x; 2];
        for (x, (filters, poles)) in through
            .iter_mut()
            .zip(self.branches.iter_mut().zip(BRANCHES))
        {
            for (filter, pole) in filters.iter_mut().zip(poles) {
                *x = filter.step(pole, *x);
            }
        }
        let [cosine, sine] = through;
        (cosine, core::mem::replace(&mut self.late, sine))
    }
}

/// The loop.
#[derive(Clone, Debug)]
pub struct PhaseLock {
    band_pass: BandPass<ORDER>,
    lane: Lane<ORDER>,
    splitter: Splitter,
    filter: PLL,
    state: PLLState,
    /// Mean cosine of the phase error.
    in_phase: f32,
}

impl PhaseLock {
    /// A loop of this bandwidth in Hz, 0.1 to 20.
    pub fn new(bandwidth_hz: f32) -> Self {
        let band_pass = BandPass::new(BAND);
        let lane = band_pass.settled(0.0);
        Self {
            band_pass,
            lane,
            splitter: Splitter::default(),
            filter: PLL::from_bandwidth(bandwidth_hz * DT_S, SPLIT),
            state: PLLState::default(),
            in_phase: 0.0,
        }
    }

    /// The loop's phase goes against the signal's.
    fn followed_hz(&self) -> f32 {
        const TURN: f32 = 4_294_967_296.0;
        -(self.state.frequency().0 as f32) / TURN / DT_S
    }
}

impl Rival for PhaseLock {
    fn push(&mut self, sample: &[f32; GAUGES]) {
        let x = self.band_pass.step(&mut self.lane, sample[HEARD]);
        let (cosine, sine) = self.splitter.step(x);
        let phase = Complex::new((FINE * cosine) as i32, (FINE * sine) as i32).arg();
        let opposite = self.filter.process(&mut self.state, phase);
        let error = (phase + opposite).0 as f32 / 2_147_483_648.0 * PI;
        self.in_phase += (libm::cosf(error) - self.in_phase) * (DT_S / WATCH_S);
    }

    fn frequency_hz(&mut self) -> Option<f32> {
        let frequency_hz = self.followed_hz();
        (self.in_phase > LOCKED && frequency_hz >= LOWEST_HZ).then_some(frequency_hz)
    }

    /// A loop of the second type follows a slowly changing frequency without delay; what is before it does
    /// not.
    fn age_half_ms(&self) -> usize {
        let cycle_half_ms = 2_000.0 / self.followed_hz().max(LOWEST_HZ);
        (SPLITTER_DELAY_CYCLES * cycle_half_ms + BAND_PASS_DELAY_HALF_MS) as usize
    }
}
