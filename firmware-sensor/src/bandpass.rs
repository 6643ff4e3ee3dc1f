//! The paper's band-pass, 5–100 Hz, as a Butterworth filter in f32.
//!
//! An analog prototype of order N becomes a band-pass of order 2N (s → (s² + ω₀²)/(Bs)) and is sampled
//! by the bilinear transform, both edges prewarped. All its zeros lie at z = ±1, N each, so every
//! section has the numerator 1 − z⁻², which needs no multiplication; the gain is applied once, up front.

use crate::SAMPLE_RATE_HZ;

/// The order of the prototype; the band-pass has twice as many poles.
pub const ORDER: usize = 2;
/// The paper's band, after the frequency response of Meissner's corpuscles.
pub const BAND: Band = Band::new(5.0, 100.0, SAMPLE_RATE_HZ as f64);

/// A pass band: the frequencies between two −3.01 dB edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    low_hz: f64,
    high_hz: f64,
    sample_rate_hz: f64,
}

impl Band {
    /// The band from `low_hz` to `high_hz` of a signal sampled at `sample_rate_hz`.
    ///
    /// # Panics
    /// Unless 0 < `low_hz` < `high_hz` < `sample_rate_hz` / 2. For constants, where that is an error of
    /// compilation.
    pub const fn new(low_hz: f64, high_hz: f64, sample_rate_hz: f64) -> Self {
        assert!(0.0 < low_hz && low_hz < high_hz && high_hz < sample_rate_hz / 2.0);
        Self {
            low_hz,
            high_hz,
            sample_rate_hz,
        }
    }

    /// The lower edge in Hz.
    pub const fn low_hz(self) -> f64 {
        self.low_hz
    }

    /// The upper edge in Hz.
    pub const fn high_hz(self) -> f64 {
        self.high_hz
    }

    /// The analog frequency, in units of twice the sample rate, that the bilinear transform maps to
    /// `frequency_hz`.
    fn warped(self, frequency_hz: f64) -> f64 {
        libm::tan(core::f64::consts::PI * frequency_hz / self.sample_rate_hz)
    }
}

/// The coefficients of a Butterworth band-pass of prototype order `N`, for any number of [`Lane`]s.
#[derive(Clone, Debug)]
pub struct BandPass<const N: usize> {
    gain: f32,
    /// Poles nearest to z = 1 first: what rounding leaves there, the zeros that follow take away.
    sections: [Section; N],
}

/// (1 − z⁻²) / (1 + a₁ z⁻¹ + a₂ z⁻²)
#[derive(Clone, Copy, Debug, Default)]
struct Section {
    a1: f32,
    a2: f32,
}

/// The state of one signal's filter: transposed direct form II, two words a section.
#[derive(Clone, Copy, Debug)]
pub struct Lane<const N: usize> {
    sections: [[f32; 2]; N],
}

impl<const N: usize> BandPass<N> {
    /// Derives the coefficients; the gain is 1 at the middle of the band, √(ω_low ω_high) before the
    /// bilinear transform.
    pub fn new(band: Band) -> Self {
        const { assert!(N > 0) };
        let (low, high) = (band.warped(band.low_hz), band.warped(band.high_hz));
        let middle_squared = low * high;
        let width = high - low;
        let mut denominators = [[0.0; 2]; N];
        let mut place = |k: usize, [p, q]: [Complex; 2]| {
            denominators[k] = [-p.plus(q).re, p.times(q).re];
        };
        // The prototype's poles lie on the left half of the unit circle. Of each conjugate pair one is
        // enough: the band-pass poles of the other are the conjugates of its own.
        for k in 0..N / 2 {
            let angle = core::f64::consts::PI * (2 * k + 1 + N) as f64 / (2 * N) as f64;
            let pole = Complex {
                re: libm::cos(angle),
                im: libm::sin(angle),
            };
            let [slow, fast] = band_pass_poles(pole, middle_squared, width).map(bilinear);
            place(k, [slow, slow.conjugate()]);
            place(N - 1 - k, [fast, fast.conjugate()]);
        }
        if !N.is_multiple_of(2) {
            let pole = Complex { re: -1.0, im: 0.0 };
            place(
                N / 2,
                band_pass_poles(pole, middle_squared, width).map(bilinear),
            );
        }
        let middle = 2.0 * libm::atan(libm::sqrt(middle_squared));
        let unscaled: f64 = denominators
            .iter()
            .map(|a| section_gain(*a, middle))
            .product();
        Self {
            gain: (1.0 / unscaled) as f32,
            sections: denominators.map(|[a1, a2]| Section {
                a1: a1 as f32,
                a2: a2 as f32,
            }),
        }
    }

    /// The state that a signal that was always `x` would have left: starting with it is no step.
    pub fn settled(&self, x: f32) -> Lane<N> {
        let mut sections = [[0.0; 2]; N];
        sections[0] = [-(self.gain * x); 2];
        Lane { sections }
    }

    /// Filters the next sample.
    pub fn step(&self, lane: &mut Lane<N>, x: f32) -> f32 {
        let mut x = self.gain * x;
        for (section, [s1, s2]) in self.sections.iter().zip(&mut lane.sections) {
            let y = x + *s1;
            *s1 = *s2 - section.a1 * y;
            *s2 = -x - section.a2 * y;
            x = y;
        }
        x
    }

    /// The sections as biquads, {b₀, b₁, b₂, a₁, a₂} of H(z) = (b₀ + b₁ z⁻¹ + b₂ z⁻²) / (1 + a₁ z⁻¹ +
    /// a₂ z⁻²), the gain in the first: for other implementations of the same filter.
    pub fn biquads(&self) -> [[f32; 5]; N] {
        let mut gain = self.gain;
        self.sections.map(|Section { a1, a2 }| {
            let b0 = core::mem::replace(&mut gain, 1.0);
            [b0, 0.0, -b0, a1, a2]
        })
    }
}

/// |1 − z⁻²| / |1 + a₁ z⁻¹ + a₂ z⁻²| at z = exp(jω).
fn section_gain([a1, a2]: [f64; 2], omega: f64) -> f64 {
    // Both multiplied by z, which leaves 2j sin ω above and takes a₂ to the mirror image of 1 below.
    let re = (1.0 + a2) * libm::cos(omega) + a1;
    let im = (1.0 - a2) * libm::sin(omega);
    2.0 * libm::sin(omega) / libm::hypot(re, im)
}

/// The two band-pass poles of a prototype's pole p, the solutions of s² − pBs + ω₀² = 0, the one
/// nearer to 0 first.
fn band_pass_poles(pole: Complex, middle_squared: f64, width: f64) -> [Complex; 2] {
    let half = pole.scaled(width / 2.0);
    let root = half
        .times(half)
        .plus(Complex {
            re: -middle_squared,
            im: 0.0,
        })
        .root();
    let pair = [half.plus(root), half.plus(root.scaled(-1.0))];
    if pair[0].magnitude() <= pair[1].magnitude() {
        pair
    } else {
        [pair[1], pair[0]]
    }
}

/// z = (1 + s) / (1 − s)
fn bilinear(s: Complex) -> Complex {
    let above = Complex {
        re: 1.0 + s.re,
        im: s.im,
    };
    let below = Complex {
        re: 1.0 - s.re,
        im: -s.im,
    };
    let squared = below.re * below.re + below.im * below.im;
    above.times(below.conjugate()).scaled(1.0 / squared)
}

#[derive(Clone, Copy, Debug)]
struct Complex {
    re: f64,
    im: f64,
}

impl Complex {
    fn plus(self, other: Self) -> Self {
        Self {
            re: self.re + other.re,
            im: self.im + other.im,
        }
    }

    fn times(self, other: Self) -> Self {
        Self {
            re: self.re * other.re - self.im * other.im,
            im: self.re * other.im + self.im * other.re,
        }
    }

    fn scaled(self, by: f64) -> Self {
        Self {
            re: self.re * by,
            im: self.im * by,
        }
    }

    fn conjugate(self) -> Self {
        Self {
            re: self.re,
            im: -self.im,
        }
    }

    fn magnitude(self) -> f64 {
        libm::hypot(self.re, self.im)
    }

    /// The root with a real part of 0 or above.
    fn root(self) -> Self {
        let re = libm::sqrt(((self.magnitude() + self.re) / 2.0).max(0.0));
        let im = libm::sqrt(((self.magnitude() - self.re) / 2.0).max(0.0));
        Self {
            re,
            im: libm::copysign(im, self.im),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;

    const UNIT_ROUNDOFF: f64 = 1.0 / (1 << 24) as f64;

    /// |H| of the ideal: 1 / √(1 + ((W² − W₀²)/(BW))²ᴺ), W the prewarped frequency.
    fn ideal_gain(order: usize, band: Band, frequency_hz: f64) -> f64 {
        let (low, high) = (band.warped(band.low_hz), band.warped(band.high_hz));
        let w = band.warped(frequency_hz);
        let prototype = (w * w - low * high) / ((high - low) * w);
        1.0 / libm::sqrt(1.0 + prototype.abs().powi(2 * order as i32))
    }

    fn gain<const N: usize>(filter: &BandPass<N>, omega: f64) -> f64 {
        let sections = filter.sections.iter();
        f64::from(filter.gain)
            * sections
                .map(|s| section_gain([f64::from(s.a1), f64::from(s.a2)], omega))
                .product::<f64>()
    }

    fn check_gains<const N: usize>(band: Band, bound: f64) {
        let filter = BandPass::<N>::new(band);
        for tenths in 1..5_000 {
            let frequency_hz = f64::from(tenths) / 10.0;
            let got = gain(&filter, 2.0 * PI * frequency_hz / 1_000.0);
            let want = ideal_gain(N, band, frequency_hz);
            assert!(
                (got - want).abs() <= bound,
                "order {N}, {frequency_hz} Hz: {got}, not {want}"
            );
        }
    }

    #[test]
    fn has_butterworths_response_in_every_order() {
        // A coefficient's rounding moves a denominator by at most 3u, relative to a smallest value of
        // about 2(1 − r)·sin ω₁ in the slowest section: 1e-3 at r = 0.978, so 2e-4 in the response.
        check_gains::<1>(BAND, 2e-4);
        check_gains::<2>(BAND, 2e-4);
        check_gains::<3>(BAND, 1e-3);
        check_gains::<4>(BAND, 1e-3);
        check_gains::<2>(Band::new(200.0, 210.0, 1_000.0), 2e-4);
    }

    #[test]
    fn is_3_db_down_at_both_edges_and_passes_nothing_at_0_hz_and_at_half_the_rate() {
        let filter = BandPass::<ORDER>::new(BAND);
        for edge_hz in [BAND.low_hz(), BAND.high_hz()] {
            let got = gain(&filter, 2.0 * PI * edge_hz / 1_000.0);
            assert!(
                (got - libm::sqrt(0.5)).abs() < 2e-4,
                "{got} at {edge_hz} Hz"
            );
        }
        assert_eq!(gain(&filter, 0.0), 0.0);
        assert!(gain(&filter, PI) < 1e-15);
    }

    /// The filter in f64 with the same coefficients, and the sum of the absolute values of the response
    /// to an impulse put into each section's state, which is what its rounding errors pass through.
    struct Reference {
        gain: f64,
        sections: [[f64; 2]; ORDER],
    }

    impl Reference {
        fn of(filter: &BandPass<ORDER>) -> Self {
            Self {
                gain: f64::from(filter.gain),
                sections: filter.sections.map(|s| [f64::from(s.a1), f64::from(s.a2)]),
            }
        }

        /// One sample, and the largest magnitude that was rounded in each section on the way.
        fn step(&self, lane: &mut [[f64; 2]; ORDER], x: f64) -> (f64, [f64; ORDER]) {
            let mut x = self.gain * x;
            let mut largest = [0.0; ORDER];
            for ((&[a1, a2], [s1, s2]), largest) in self.sections.iter().zip(lane).zip(&mut largest)
            {
                let y = x + *s1;
                // Everything that is rounded: x, which goes two ways, y, both products and both sums.
                let rounded = [2.0 * x, y, a1 * y, *s2 - a1 * y, a2 * y, -x - a2 * y];
                *largest = rounded.iter().map(|v: &f64| v.abs()).sum();
                *s1 = *s2 - a1 * y;
                *s2 = -x - a2 * y;
                x = y;
            }
            (x, largest)
        }

        fn noise_gain(&self, section: usize) -> f64 {
            let mut lane = [[0.0; 2]; ORDER];
            lane[section][0] = 1.0;
            (0..5_000).map(|_| self.step(&mut lane, 0.0).0.abs()).sum()
        }
    }

    #[test]
    fn stays_within_the_rounding_bound_of_the_same_filter_in_f64() {
        let filter = BandPass::<ORDER>::new(BAND);
        let reference = Reference::of(&filter);
        let x = |ms: u32| {
            let t_s = f64::from(ms) / 1_000.0;
            (700.0
                + 900.0 * libm::sin(2.0 * PI * 17.3 * t_s)
                + 400.0 * libm::sin(2.0 * PI * 91.7 * t_s)) as f32
        };
        let mut lane = filter.settled(x(0));
        let mut lane64 = lane.sections.map(|s| s.map(f64::from));
        let (mut largest_error, mut largest) = (0.0_f64, [0.0_f64; ORDER]);
        for ms in 0..20_000 {
            let got = f64::from(filter.step(&mut lane, x(ms)));
            let (want, rounded) = reference.step(&mut lane64, f64::from(x(ms)));
            largest_error = largest_error.max((got - want).abs());
            for (largest, rounded) in largest.iter_mut().zip(rounded) {
                *largest = largest.max(rounded);
            }
        }
        let bound: f64 = (0..ORDER)
            .map(|k| UNIT_ROUNDOFF * largest[k] * reference.noise_gain(k))
            .sum();
        assert!(largest_error <= bound, "{largest_error} exceeds {bound}");
        assert!(
            bound < 0.5,
            "{bound} ADC steps are more than the ADC's own rounding"
        );
    }

    #[test]
    fn is_silent_from_the_first_sample_of_a_constant() {
        let filter = BandPass::<ORDER>::new(BAND);
        let mut lane = filter.settled(-1_234.567);
        for _ in 0..1_000 {
            assert_eq!(filter.step(&mut lane, -1_234.567), 0.0);
        }
    }

    #[test]
    fn delays_textures_by_4_ms_give_or_take_1_4() {
        // What travel::ALIGNMENT_MS allows for the band-pass: the group delay, −dφ/dω.
        let filter = BandPass::<ORDER>::new(BAND);
        let phase = |frequency_hz: f64| -> f64 {
            let omega = 2.0 * PI * frequency_hz / 1_000.0;
            filter
                .sections
                .iter()
                .map(|s| {
                    let (a1, a2) = (f64::from(s.a1), f64::from(s.a2));
                    let re = (1.0 + a2) * libm::cos(omega) + a1;
                    let im = (1.0 - a2) * libm::sin(omega);
                    PI / 2.0 - libm::atan2(im, re)
                })
                .sum()
        };
        for frequency_hz in 20..=100 {
            let f = f64::from(frequency_hz);
            let delay_ms = -(phase(f + 0.01) - phase(f - 0.01)) / (2.0 * PI * 0.02) * 1_000.0;
            assert!((delay_ms - 4.0).abs() < 1.4, "{delay_ms} ms at {f} Hz");
        }
    }
}
