//! The Fourier transform of the crate `realfft`.

use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{RealFftPlanner, RealToComplex};

use super::baselines::spectrum::{LENGTH, LINES, Transform};
use super::tally::{Tally, operations};

/// `realfft`'s, without vector instructions.
pub struct RealFft {
    transform: Arc<dyn RealToComplex<f32>>,
    lines: Vec<Complex<f32>>,
    scratch: Vec<Complex<f32>>,
}

impl Default for RealFft {
    fn default() -> Self {
        let transform = RealFftPlanner::new().plan_fft_forward(LENGTH);
        let (lines, scratch) = (transform.make_output_vec(), transform.make_scratch_vec());
        Self {
            transform,
            lines,
            scratch,
        }
    }
}

impl Transform for RealFft {
    fn add_power(&mut self, samples: &mut [f32; LENGTH], power: &mut [f32; LINES]) {
        let lengths_agree =
            self.transform
                .process_with_scratch(samples, &mut self.lines, &mut self.scratch);
        if lengths_agree.is_ok() {
            for (power, line) in power.iter_mut().zip(&self.lines) {
                *power += line.norm_sqr();
            }
        }
    }
}

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
