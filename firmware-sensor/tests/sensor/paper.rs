//! The formulas of Okamoto et al. 2009, section III, in f64: that they follow from one another, where
//! they hold, and the numbers that the paper takes from them.

use std::f64::consts::PI;

use firmware_sensor::adapted;
use firmware_sensor::counting::predicted_mean_mm;

/// A sinusoidal rub over a grating, seen through a window: what equations (3) to (11) are about.
#[derive(Clone, Copy)]
struct Rub {
    /// A in s.
    window_s: f64,
    /// λ in mm.
    wavelength_mm: f64,
    /// α in mm/s.
    peak_mm_s: f64,
    /// fv in Hz.
    strokes_hz: f64,
}

/// The paper's Fig. 5.
const FIG_5: Rub = Rub {
    window_s: 0.2,
    wavelength_mm: 2.0,
    peak_mm_s: 100.0,
    strokes_hz: 1.0,
};
/// Instants at which a stroke is looked at; odd, so that they meet no symmetry of it.
const INSTANTS: u32 = 1_999;

impl Rub {
    /// v(t), equation (7).
    fn velocity_mm_s(&self, t_s: f64) -> f64 {
        self.peak_mm_s * (2.0 * PI * self.strokes_hz * t_s).sin()
    }

    /// T1 as (8) defines it: v(t)·v(t − A) ≥ 0.
    fn is_in_t1(&self, t_s: f64) -> bool {
        self.velocity_mm_s(t_s) * self.velocity_mm_s(t_s - self.window_s) >= 0.0
    }

    /// fe(t), equation (8).
    fn closed_form_hz(&self, t_s: f64) -> f64 {
        let scale = self.peak_mm_s / (self.window_s * self.strokes_hz * self.wavelength_mm * PI);
        let half_window = PI * self.strokes_hz * self.window_s;
        let middle = 2.0 * PI * self.strokes_hz * (t_s - self.window_s / 2.0);
        if self.is_in_t1(t_s) {
            scale * (half_window.sin() * middle.sin()).abs()
        } else {
            scale * (1.0 - (half_window.cos() * middle.cos()).abs())
        }
    }

    /// fe(t), equation (3) with (4): Simpson's rule on each piece between two reversals.
    fn integral_hz(&self, t_s: f64) -> f64 {
        let half_stroke_s = 0.5 / self.strokes_hz;
        let start_s = t_s - self.window_s;
        let mut edges = vec![start_s];
        let mut reversal = (start_s / half_stroke_s).floor() + 1.0;
        while reversal * half_stroke_s < t_s {
            edges.push(reversal * half_stroke_s);
            reversal += 1.0;
        }
        edges.push(t_s);
        let f = |t_s: f64| self.velocity_mm_s(t_s).abs() / self.wavelength_mm;
        edges
            .windows(2)
            .map(|piece| simpson(f, piece[0], piece[1]))
            .sum::<f64>()
            / self.window_s
    }

    /// λe(t), equation (5), X = 0.
    fn wavelength_mm(&self, t_s: f64) -> f64 {
        self.velocity_mm_s(t_s - self.window_s / 2.0).abs() / self.closed_form_hz(t_s)
    }

    fn instants_s(&self) -> impl Iterator<Item = f64> {
        let stroke_s = 1.0 / self.strokes_hz;
        (0..INSTANTS).map(move |i| (f64::from(i) + 0.5) / f64::from(INSTANTS) * stroke_s)
    }
}

fn simpson(f: impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    const INTERVALS: u32 = 1_000;
    let width = (to - from) / f64::from(INTERVALS);
    let inner: f64 = (1..INTERVALS)
        .map(|i| f(from + f64::from(i) * width) * if i % 2 == 1 { 4.0 } else { 2.0 })
        .sum();
    (f(from) + inner + f(to)) * width / 3.0
}

/// The first term of (9), relative to λ: what counting over A makes of a sinusoidal rub.
fn approximation_error(window_s: f64, strokes_hz: f64) -> f64 {
    let x = PI * window_s * strokes_hz;
    (x / x.sin() - 1.0).abs()
}

/// E(|X|) in mm, equation (10).
fn noise_error_mm(window_s: f64, sigma_mm: f64, sample_rate_hz: f64) -> f64 {
    2.0 * sigma_mm / (2.0 * PI * window_s * sample_rate_hz).sqrt()
}

/// The window in s with the least error by equation (11), for σ = 1 mm and fs = 1 kHz: ternary search,
/// since both terms are convex in A up to A·fv = 1/2.
fn best_window_s(wavelength_mm: f64, strokes_hz: f64) -> f64 {
    let error_mm = |window_s: f64| {
        wavelength_mm * approximation_error(window_s, strokes_hz)
            + noise_error_mm(window_s, 1.0, 1_000.0)
    };
    let (mut low, mut high) = (0.001, 0.5 / strokes_hz);
    while high - low > 1e-9 {
        let third = (high - low) / 3.0;
        if error_mm(low + third) < error_mm(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    low
}

#[test]
fn equation_8_is_the_integral_of_equation_3_while_the_window_is_at_most_half_a_stroke() {
    for (window_s, strokes_hz) in [
        (0.02, 1.0),
        (0.08, 0.83),
        (0.2, 1.0),
        (0.08, 2.0),
        (0.25, 2.0),
        (0.5, 1.0),
    ] {
        let rub = Rub {
            window_s,
            strokes_hz,
            ..FIG_5
        };
        for t_s in rub.instants_s() {
            let error_hz = (rub.closed_form_hz(t_s) - rub.integral_hz(t_s)).abs();
            // Simpson's error is at most (2π fv A)⁴ / (180 · 1000⁴) of the integrand's peak, 6e-13 at
            // A fv = 1/2; rounding is less.
            let bound = 1e-12 * rub.peak_mm_s / rub.wavelength_mm;
            assert!(
                error_hz <= bound,
                "{error_hz} Hz off at A = {window_s}, t = {t_s}"
            );
        }
    }
}

#[test]
fn equation_8_fails_for_windows_longer_than_half_a_stroke() {
    // Then two reversals can lie in the window: v(t)·v(t − A) ≥ 0 although v was negative in between.
    for (window_s, strokes_hz) in [(0.6, 1.0), (0.7, 1.0), (0.35, 2.0), (0.9, 1.0)] {
        let rub = Rub {
            window_s,
            strokes_hz,
            ..FIG_5
        };
        let worst = rub
            .instants_s()
            .map(|t_s| (rub.closed_form_hz(t_s) - rub.integral_hz(t_s)).abs())
            .fold(0.0, f64::max);
        assert!(
            worst > 0.1 * rub.peak_mm_s / rub.wavelength_mm,
            "only {worst} Hz at A = {window_s}"
        );
    }
}

#[test]
fn the_error_of_fig_5_is_constant_in_t1() {
    let mut seen = 0;
    for t_s in FIG_5.instants_s().filter(|&t_s| FIG_5.is_in_t1(t_s)) {
        let error_mm = FIG_5.wavelength_mm(t_s) - FIG_5.wavelength_mm;
        assert!((error_mm - 0.1379).abs() < 0.00005, "{error_mm} at {t_s}");
        // Equation (9) without noise: the same, as an equality.
        let bound_mm = FIG_5.wavelength_mm * approximation_error(FIG_5.window_s, FIG_5.strokes_hz);
        assert!(
            (error_mm - bound_mm).abs() < 1e-12,
            "{error_mm} is not {bound_mm}"
        );
        seen += 1;
    }
    assert!(seen > 0);
}

#[test]
fn fig_5_is_in_t1_for_60_percent_of_the_time() {
    let in_t1 = FIG_5
        .instants_s()
        .filter(|&t_s| FIG_5.is_in_t1(t_s))
        .count();
    // Four borders of ranges in a stroke, each placed to within an instant.
    let share = in_t1 as f64 / f64::from(INSTANTS);
    assert!((share - 0.6).abs() <= 4.0 / f64::from(INSTANTS), "{share}");
}

#[test]
fn the_wavelength_of_fig_5_falls_to_0_in_t2() {
    let reversal_s = 0.5 / FIG_5.strokes_hz + FIG_5.window_s / 2.0;
    assert!(!FIG_5.is_in_t1(reversal_s));
    assert!(FIG_5.wavelength_mm(reversal_s) < 1e-12);
    let t2 = FIG_5.instants_s().filter(|&t_s| !FIG_5.is_in_t1(t_s));
    let largest = t2.map(|t_s| FIG_5.wavelength_mm(t_s)).fold(0.0, f64::max);
    // Continuous with T1 at its borders, and nowhere above.
    assert!(
        largest <= FIG_5.wavelength_mm + 0.1379 + 0.00005,
        "{largest}"
    );
}

#[test]
fn equation_10_is_the_mean_magnitude_of_the_mean_of_a_windows_noise() {
    let (window_s, sigma_mm, sample_rate_hz): (f64, f64, f64) = (0.08, 1.0, 1_000.0);
    // A·fs values of N(0, σ²) have a mean of N(0, σ²/(A·fs)).
    let deviation = sigma_mm / (window_s * sample_rate_hz).sqrt();
    let density = |x: f64| (-0.5 * (x / deviation).powi(2)).exp() / (deviation * (2.0 * PI).sqrt());
    let mean = 2.0 * simpson(|x| x * density(x), 0.0, 12.0 * deviation);
    let formula = noise_error_mm(window_s, sigma_mm, sample_rate_hz);
    assert!((mean - formula).abs() < 1e-9, "{mean} is not {formula}");
}

#[test]
fn equation_11_is_least_at_windows_whose_mean_is_the_papers_80_ms() {
    let best = [1.0, 2.0, 3.0, 4.0].map(|wavelength_mm| best_window_s(wavelength_mm, 1.0));
    for (got, want) in best.iter().zip([0.1069, 0.0814, 0.0693, 0.0618]) {
        assert!((got - want).abs() <= 0.00005, "{got} is not {want}");
    }
    let mean = best.iter().sum::<f64>() / 4.0;
    assert!((mean - 0.0798).abs() <= 0.00005, "{mean}");
}

#[test]
fn equation_11_asks_for_shorter_windows_at_2_strokes_a_second() {
    let windows_s = [
        (1.0, 0.06118),
        (2.0, 0.04664),
        (3.0, 0.03975),
        (4.0, 0.03547),
    ];
    for (wavelength_mm, want) in windows_s {
        let got = best_window_s(wavelength_mm, 2.0);
        assert!((got - want).abs() <= 0.000_006, "{got} is not {want}");
    }
}

#[test]
fn table_1_is_mostly_the_counts_quantisation() {
    let wavelengths_mm = [1.0, 2.0, 3.0, 4.0];
    for (speed_mm_s, predicted) in [
        (30.0, [1.008, 2.080, 3.360, 4.320]),
        (50.0, [1.000, 2.000, 3.111, 4.000]),
        (70.0, [1.001, 2.016, 3.049, 4.107]),
    ] {
        for (wavelength_mm, want) in wavelengths_mm.into_iter().zip(predicted) {
            let got = predicted_mean_mm(wavelength_mm, speed_mm_s, 0.08);
            assert!((got - want).abs() <= 0.000_500_001, "{got} is not {want}");
        }
    }
}

#[test]
fn the_boards_window_is_where_equation_11_is_least() {
    for wavelength_mm in [0.5, 1.0, 2.0, 3.0, 4.0, 8.0] {
        for strokes_hz in [0.05, 0.2, 0.5, 0.83, 1.0, 2.0, 3.0] {
            let want = best_window_s(wavelength_mm, strokes_hz);
            let got = f64::from(adapted::best_window_s(
                wavelength_mm as f32,
                strokes_hz as f32,
            ));
            // The series' next terms, in A: less than x⁴/50.
            let x = PI * want * strokes_hz;
            let bound = want * (x.powi(4) / 50.0 + 1e-6);
            assert!(
                (got - want).abs() <= bound,
                "{got} is not {want} at λ = {wavelength_mm}, fv = {strokes_hz}"
            );
        }
    }
}
