//! YIN and McLeod's method, of the crate `pitch-detection`, on one gauge. They work with the number that counts,
//! here as well as where their work is counted: each kind of number has the whole of a Fourier transform compiled.

use pitch_detection::detector::PitchDetector;
use pitch_detection::detector::mcleod::McLeodDetector;
use pitch_detection::detector::yin::YINDetector;
use protocol::GAUGES;
use realfft::RealFftPlanner;

use super::baselines::spectrum::LENGTH;
use super::baselines::{HEARD, Rival, Window};
use super::tally::{Tally, operations};

/// YIN answers at the first dip of its normalised difference below 1 less this: 0.2.
const YIN_CLARITY: f32 = 0.8;
/// McLeod's method answers at the first peak of its normalised correlation above this. The crate's (0.3.0)
/// is not normalised as meant, since its inverse transform leaves a factor of the length: it falls as
/// 1 − τ/N, so that the 0.7 or so which is usual would leave only the periods below 0.3 N.
const MCLEOD_CLARITY: f32 = 0.4;

/// A detector over the last `N` ms. It finds periods up to N/2 (YIN), 0.6 N (McLeod). Their resolution is a
/// lag of 1 ms, parted by a parabola.
pub struct Pitch<const N: usize, D> {
    window: Window<N>,
    detector: D,
    clarity: f32,
}

/// YIN.
pub fn yin<const N: usize>() -> Pitch<N, YINDetector<Tally>> {
    Pitch {
        window: Window::default(),
        detector: YINDetector::new(N, 0),
        clarity: YIN_CLARITY,
    }
}

/// McLeod's method, the window filled up with zeros to `LENGTH`.
pub fn mcleod<const N: usize, const LENGTH: usize>() -> Pitch<N, McLeodDetector<Tally>> {
    Pitch {
        window: Window::default(),
        detector: McLeodDetector::new(N, LENGTH - N),
        clarity: MCLEOD_CLARITY,
    }
}

impl<const N: usize, D: PitchDetector<Tally>> Rival for Pitch<N, D> {
    fn push(&mut self, sample: &[f32; GAUGES]) {
        self.window.push(sample);
    }

    fn frequency_hz(&mut self) -> Option<f32> {
        if !self.window.is_full() {
            return None;
        }
        let signal = self.window.swing(HEARD).map(Tally);
        let rate_hz = firmware_sensor::SAMPLE_RATE_HZ as usize;
        // Silence has no pitch.
        let power = Tally(f32::MIN_POSITIVE);
        let pitch = self
            .detector
            .get_pitch(&signal, rate_hz, power, Tally(self.clarity))?;
        let Tally(frequency_hz) = pitch.frequency;
        (frequency_hz.is_finite() && frequency_hz > 0.0).then_some(frequency_hz)
    }

    fn age_half_ms(&self) -> usize {
        Window::<N>::middle_half_ms()
    }
}

pub fn operations_of_yin<const N: usize>() -> u64 {
    operations_of::<N>(YINDetector::new(N, 0), YIN_CLARITY)
}

pub fn operations_of_mcleod<const N: usize, const LENGTH: usize>() -> u64 {
    operations_of::<N>(McLeodDetector::new(N, LENGTH - N), MCLEOD_CLARITY)
}

fn operations_of<const N: usize>(mut detector: impl PitchDetector<Tally>, clarity: f32) -> u64 {
    let tone: Vec<Tally> = (0..N)
        .map(|ms| Tally((std::f32::consts::TAU * 0.025 * ms as f32).sin()))
        .collect();
    operations(|| {
        let mean = tone.iter().copied().sum::<Tally>() / Tally(N as f32);
        let swing: Vec<Tally> = tone.iter().map(|x| *x - mean).collect();
        let rate_hz = firmware_sensor::SAMPLE_RATE_HZ as usize;
        detector.get_pitch(&swing, rate_hz, Tally(0.0), Tally(clarity));
    })
}

/// Of `realfft`'s transform of [`LENGTH`] samples.
pub fn operations_of_transform() -> u64 {
    let transform = RealFftPlanner::<Tally>::new().plan_fft_forward(LENGTH);
    let (mut samples, mut lines, mut scratch) = (
        vec![Tally(1.0); LENGTH],
        transform.make_output_vec(),
        transform.make_scratch_vec(),
    );
    operations(|| {
        let _ = transform.process_with_scratch(&mut samples, &mut lines, &mut scratch);
    })
}
