//! What the bank promises, against closed forms and a direct solution in f64.

use super::*;
use crate::MICROMETRES_PER_COUNT;
use crate::estimator::{PLACES_PER_MM, Place};

const ALL: u8 = 0b11111;
const TAU: f64 = 2.0 * core::f64::consts::PI;
const GAINS: [f64; GAUGES] = [1.0, 0.8, 1.1, 0.6, 0.9];
const PHASES: [f64; GAUGES] = [0.0, 2.1, -0.7, 4.1, 1.3];
const AMPLITUDE: f64 = 400.0;

/// A bank that is rubbed, with the arm's positions that go with it.
struct Rub {
    bank: Bank,
    travel: Travel,
    x_mm: f64,
    /// Added to every place.
    start: Place,
    touch: Touch,
    ms: u32,
    finding: Finding,
}

impl Rub {
    fn new() -> Self {
        Self::with(&SensorConfiguration::DEFAULT)
    }

    fn with(configuration: &SensorConfiguration) -> Self {
        Self {
            bank: Bank::new(configuration),
            travel: Travel::new(0),
            x_mm: 0.0,
            start: 0,
            touch: Touch {
                usable: ALL,
                ..Touch::default()
            },
            ms: 0,
            finding: Finding::default(),
        }
    }

    /// A millisecond at `speed_mm_s` over what the gauges say of x in mm; a finding every tenth time.
    fn step(
        &mut self,
        speed_mm_s: f64,
        mut signal: impl FnMut(usize, f64) -> f64,
    ) -> Option<Finding> {
        self.x_mm += speed_mm_s * 1e-3;
        let x_um = 1_000.0 * self.x_mm;
        self.travel
            .push(libm::floor(x_um / f64::from(MICROMETRES_PER_COUNT)) as i64 as u16);
        let place = libm::round(x_um * f64::from(PLACES_PER_UM)) as i64 as Place;
        self.touch.place = self.start.wrapping_add(place);
        // The gauges are where the place is, to the quarter of a µm.
        let x_mm = f64::from(place) / f64::from(PLACES_PER_MM);
        self.touch.gauges = core::array::from_fn(|gauge| signal(gauge, x_mm) as f32);
        self.bank.push(&self.touch);
        self.ms += 1;
        self.ms.is_multiple_of(10).then(|| {
            self.finding = self.bank.find(&self.travel);
            self.finding
        })
    }

    /// Goes on for `ms`; the last finding, and how many were valid.
    fn rub(
        &mut self,
        ms: u32,
        speed_mm_s: f64,
        signal: impl Fn(usize, f64) -> f64,
    ) -> (Finding, u32) {
        let mut valid = 0;
        for _ in 0..ms {
            let finding = self.step(speed_mm_s, &signal);
            valid += u32::from(finding.is_some_and(|finding| finding.valid));
        }
        (self.finding, valid)
    }

    /// λ̂ over the long kernel.
    fn wavelength_mm(&self) -> f64 {
        f64::from(self.bank.look(Kernel::Long).wavelength_mm.unwrap())
    }

    fn energies(&self) -> [[f32; MAX_CANDIDATES]; 2] {
        [Kernel::Short, Kernel::Long].map(|kernel| self.bank.spectrum(kernel, ALL).0)
    }
}

fn sine(wavelength_mm: f64) -> impl Fn(usize, f64) -> f64 {
    move |gauge, x_mm| {
        AMPLITUDE * GAINS[gauge] * libm::sin(TAU * x_mm / wavelength_mm + PHASES[gauge])
    }
}

/// A trapezoid's fundamental and harmonics, as far as they matter.
fn trapezoid(wavelength_mm: f64) -> impl Fn(usize, f64) -> f64 {
    move |gauge, x_mm| {
        let theta = TAU * x_mm / wavelength_mm + PHASES[gauge];
        let harmonics =
            libm::sin(theta) + 0.28 * libm::sin(3.0 * theta) + 0.12 * libm::sin(5.0 * theta);
        AMPLITUDE * GAINS[gauge] * harmonics
    }
}

/// Evenly over ±1.
struct Uniform(u64);

impl Uniform {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Determinant of a 3 × 3 matrix.
fn determinant(m: [[f64; 3]; 3]) -> f64 {
    m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
        - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
        + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
}

/// Energy per weight that a cosine, a sine and a constant explain of samples s at phases θ with weights
/// w, beyond what the constant does; and the samples' mean square.
fn explained(samples: &[(f64, f64, f64)]) -> (f64, f64) {
    let (mut matrix, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
    let (mut weight, mut square) = (0.0, 0.0);
    for &(w, theta, s) in samples {
        let row = [1.0, libm::cos(theta), libm::sin(theta)];
        for i in 0..3 {
            for j in 0..3 {
                matrix[i][j] += w * row[i] * row[j];
            }
            right[i] += w * row[i] * s;
        }
        weight += w;
        square += w * s * s;
    }
    let whole = determinant(matrix);
    let mut energy = 0.0;
    for column in 0..3 {
        let mut replaced = matrix;
        for (row, right) in replaced.iter_mut().zip(right) {
            row[column] = right;
        }
        energy += determinant(replaced) / whole * right[column];
    }
    let mean = right[0] / weight;
    (energy / weight - mean * mean, square / weight)
}

#[test]
fn every_candidates_energy_is_that_of_a_direct_least_squares_fit() {
    const MS: usize = 600;
    let mut random = Uniform(3);
    let mut rub = Rub::new();
    let mut taken = [(0, 0.0, [0.0; GAUGES]); MS];
    let (mut speed_mm_s, mut compared) = (0.0, 0);
    for taken in &mut taken {
        // A walk that turns again and again, over noise, a wave and an offset.
        speed_mm_s = 0.98 * speed_mm_s + 12.0 * random.next();
        let mut noise = [0.0; GAUGES];
        noise.fill_with(|| 200.0 * random.next());
        let before = rub.bank.play.at;
        rub.step(speed_mm_s, |gauge, x_mm| {
            sine(1.7)(gauge, x_mm) + noise[gauge] + 150.0 * (gauge as f64 - 2.0)
        });
        let travel = rub.bank.play.at.unwrap() - before.unwrap_or(rub.touch.place);
        *taken = (
            rub.touch.place,
            f64::from(travel.unsigned_abs()),
            rub.touch.gauges.map(f64::from),
        );
    }
    for (number, candidate) in rub.bank.candidates().iter().enumerate() {
        // A block's weight in the short kernel is what it takes and what later ones keep of it, and in the
        // long one that times what it and all later ones take.
        let (mut kept, mut took) = (1.0, 0.0);
        let mut weights = [[0.0; 2]; MS];
        for block in (0..MS / BLOCK).rev() {
            let samples = block * BLOCK..(block + 1) * BLOCK;
            let travel: f64 = taken[samples.clone()].iter().map(|taken| taken.1).sum();
            if travel == 0.0 {
                continue;
            }
            let z = travel * f64::from(candidate.per_place);
            let keep = 1.0 / (1.0 + z + z * z / 2.0);
            took += 1.0 - keep;
            for n in samples {
                let weight = taken[n].1 * kept * (1.0 - keep) / travel;
                weights[n] = [weight, weight * took];
            }
            kept *= keep;
        }
        for (kernel, which) in [(Kernel::Short, 0), (Kernel::Long, 1)] {
            let Some(fit) = Fit::of(candidate.sums(kernel)) else {
                continue;
            };
            for gauge in 0..GAUGES {
                let mut samples = [(0.0, 0.0, 0.0); MS];
                for n in 0..MS {
                    let (place, _, gauges) = taken[n];
                    let cycles = i64::from(place) * i64::from(candidate.increment);
                    let theta = TAU * cycles.rem_euclid(1 << 32) as f64 / 4_294_967_296.0;
                    samples[n] = (weights[n][which], theta, gauges[gauge]);
                }
                let (want, square) = explained(&samples);
                let got = f64::from(rub.bank.spectrum(kernel, 1 << gauge).0[number]);
                // Cosine and sine are within 7.6e-5, and a few hundred roundings of f32 in the sums, which
                // forget: 4e-5 at most. Either enters the energy twice, from both sides of the fit, and
                // is enlarged as the determinant falls.
                let bound = 4.0 * (7.6e-5 + 4e-5) * square / f64::from(fit.determined());
                assert!(
                    (got - want).abs() <= bound,
                    "{got} is not {want} within {bound}: candidate {number}, {kernel:?}, gauge {gauge}"
                );
                compared += 1;
            }
        }
    }
    assert!(compared > 200, "{compared}");
}

/// λ from 0.7 to 6 mm, off the bank's grid, evenly in log λ.
fn wavelengths_mm(count: u32) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| 0.7 * libm::pow(6.0 / 0.7, f64::from(i) / f64::from(count - 1)))
}

#[test]
fn a_sine_of_any_wavelength_is_found_without_bias() {
    let mut worst: f64 = 0.0;
    for wavelength_mm in wavelengths_mm(97) {
        let mut rub = Rub::new();
        // Ten wavelengths, seven of the kernel's constants.
        rub.rub(
            (12.0 * wavelength_mm / 0.04) as u32,
            40.0,
            sine(wavelength_mm),
        );
        // And over the next one, since what is left of the image turns with the phase.
        for _ in 0..(wavelength_mm / 0.04) as u32 {
            rub.step(40.0, sine(wavelength_mm));
            let error = rub.wavelength_mm() / wavelength_mm - 1.0;
            worst = worst.max(error.abs());
        }
    }
    // What the vertex owes to the kernel's steps of 2 ms and to the image at −k; measured 7e-4.
    assert!(worst <= 1e-3, "{worst}");
}

#[test]
fn the_same_surface_has_the_same_wavelength_however_it_is_stroked() {
    let mut worst: f64 = 0.0;
    for wavelength_mm in [0.8, 1.37, 2.71, 4.4] {
        let profiles: [fn(f64) -> f64; 6] = [
            |_| 30.0,
            |_| -30.0,
            |_| 90.0,
            |t_s| 50.0 + 45.0 * libm::sin(TAU * 3.0 * t_s),
            |t_s| 70.0 * libm::sin(TAU * 2.0 * t_s),
            |t_s| -100.0 * libm::sin(TAU * 1.0 * t_s),
        ];
        for profile in profiles {
            let mut rub = Rub::new();
            for ms in 0..4_000 {
                let finding = rub.step(profile(f64::from(ms) * 1e-3), trapezoid(wavelength_mm));
                if let Some(finding) = finding.filter(|finding| finding.valid) {
                    let found_mm = f64::from(finding.wavelength_mm.unwrap());
                    worst = worst.max((found_mm / wavelength_mm - 1.0).abs());
                }
            }
        }
    }
    // Without noise. At constant speed 1e-3 is enough; at a turn the harmonics do not average out over whole
    // waves. Measured 1.2e-2.
    assert!(worst <= 1.5e-2, "{worst}");
}

#[test]
fn offsets_and_gain_do_not_matter() {
    for wavelength_mm in [0.8, 2.71, 4.4] {
        let plain = trapezoid(wavelength_mm);
        let found = [(1.0, 0.0), (1.0, 900.0), (0.1, 0.0), (4.0, -600.0)].map(|(gain, offset)| {
            let mut rub = Rub::new();
            let (finding, _) = rub.rub(1_503, 50.0, |gauge, x_mm| {
                gain * plain(gauge, x_mm) + offset * (gauge as f64 - 2.0)
            });
            assert!(finding.valid);
            (
                f64::from(finding.wavelength_mm.unwrap()),
                f64::from(finding.amplitude_lsb) / gain,
                f64::from(finding.confidence),
            )
        });
        for other in &found[1..] {
            // Rounding of f32: of an offset five times the amplitude, in energies.
            assert!((other.0 / found[0].0 - 1.0).abs() < 1e-6, "{found:?}");
            assert!((other.1 / found[0].1 - 1.0).abs() < 1e-5, "{found:?}");
            assert!((other.2 - found[0].2).abs() < 2e-4, "{found:?}");
        }
    }
}

#[test]
fn places_may_wrap() {
    for speed_mm_s in [40.0, -40.0] {
        // 40 mm, in which the wrap comes 3 mm before the end.
        let edge = if speed_mm_s > 0.0 { i32::MAX } else { i32::MIN };
        let wrapping = edge - (0.925 * speed_mm_s) as i32 * PLACES_PER_MM;
        let found = [0, wrapping].map(|start| {
            let mut rub = Rub::new();
            rub.start = start;
            let (finding, valid) = rub.rub(1_000, speed_mm_s, trapezoid(1.37));
            assert!(finding.valid && valid > 80, "{valid}");
            f64::from(finding.wavelength_mm.unwrap())
        });
        // Phases start elsewhere, and the table's error of 7.6e-5 with them.
        assert!((found[1] / found[0] - 1.0).abs() < 1e-4, "{found:?}");
    }
}

#[test]
fn nothing_changes_at_rest() {
    let mut rub = Rub::new();
    rub.rub(1_000, 50.0, trapezoid(2.0));
    let before = rub.energies();
    let mut random = Uniform(1);
    for _ in 0..10_000 {
        rub.step(0.0, |_, _| 2_000.0 * random.next());
    }
    assert_eq!(rub.energies(), before);
    assert!(!rub.finding.valid);
}

#[test]
fn an_encoder_that_dithers_at_rest_does_not_wash_out_what_was_felt() {
    for sign in [1.0, -1.0] {
        let mut rub = Rub::new();
        rub.rub(1_000, sign * 50.0, trapezoid(2.0));
        let mut random = Uniform(2);
        let mut energies = None;
        for n in 0..10_000 {
            // ±1 count of 5 µm, in a random order.
            let to_mm = sign * 50.0 + 0.005 * libm::round(1.4 * random.next());
            let speed_mm_s = (to_mm - rub.x_mm) * 1e3;
            rub.step(speed_mm_s, |_, _| 2_000.0 * random.next());
            // The first time may take up what the play has left.
            if n == 20 {
                energies = Some(rub.energies());
            }
        }
        assert_eq!(Some(rub.energies()), energies);
        let found_mm = rub.wavelength_mm();
        assert!((found_mm / 2.0 - 1.0).abs() < 5e-3, "{found_mm}");
    }
}

#[test]
fn a_wavelength_beyond_the_banks_ends_is_never_stood_by() {
    for wavelength_mm in [
        0.2, 0.3, 0.4, 0.5, 0.55, 0.6, 7.2, 8.0, 10.0, 13.0, 20.0, 40.0,
    ] {
        for speed_mm_s in [10.0, 50.0, 100.0] {
            let (_, valid) = Rub::new().rub(5_000, speed_mm_s, sine(wavelength_mm));
            assert_eq!(
                valid, 0,
                "a sine of {wavelength_mm} mm at {speed_mm_s} mm/s"
            );
            let (_, valid) = Rub::new().rub(5_000, speed_mm_s, trapezoid(wavelength_mm));
            assert_eq!(
                valid, 0,
                "a trapezoid of {wavelength_mm} mm at {speed_mm_s} mm/s"
            );
        }
    }
}

#[test]
fn noise_alone_is_never_stood_by() {
    for (seed, speed_mm_s) in [(1, 10.0), (2, 30.0), (3, 50.0), (4, 100.0)] {
        let mut random = Uniform(seed);
        let mut rub = Rub::new();
        // As large as the ADC's own, and as a texture.
        for level in [3.0, 500.0] {
            rub.touch.noise = [(level * level / 3.0) as f32; GAUGES];
            let mut valid = 0;
            for _ in 0..60_000 {
                let finding = rub.step(speed_mm_s, |_, _| level * random.next());
                valid += u32::from(finding.is_some_and(|finding| finding.valid));
            }
            assert_eq!(valid, 0, "±{level} at {speed_mm_s} mm/s");
        }
    }
}

#[test]
fn two_wavelengths_on_two_halves_of_the_gauges_are_not_stood_by() {
    for (one_mm, other_mm) in [(2.0, 3.0), (1.0, 4.0), (2.0, 2.4)] {
        // Two that are a fifth apart take a while to come apart: 250 ms are 6 λ.
        let apart_ms = if other_mm == 2.4 { 250 } else { 0 };
        for usable in [0b11111, 0b11011, 0b00101] {
            let mut rub = Rub::new();
            rub.touch.usable = usable;
            let surface = |gauge: usize, x_mm: f64| {
                trapezoid(if gauge < 2 { one_mm } else { other_mm })(gauge, x_mm)
            };
            rub.rub(apart_ms, 50.0, surface);
            let (_, valid) = rub.rub(5_000, 50.0, surface);
            assert_eq!(valid, 0, "{one_mm} and {other_mm} mm on {usable:05b}");
        }
    }
}

#[test]
fn after_a_change_of_surface_the_new_wavelength_is_stood_by_within_two_of_its_waves() {
    for from_mm in [1.0, 2.0, 3.0, 4.0] {
        for to_mm in [1.0, 2.0, 3.0, 4.0] {
            if from_mm == to_mm {
                continue;
            }
            let mut worst_mm: f64 = 0.0;
            for part in 0..8 {
                let boundary_mm = 40.0 + to_mm * f64::from(part) / 8.0;
                let surface = |gauge: usize, x_mm: f64| {
                    let wavelength_mm = if x_mm < boundary_mm { from_mm } else { to_mm };
                    trapezoid(wavelength_mm)(gauge, x_mm)
                };
                let mut rub = Rub::new();
                let mut right_from_mm = f64::INFINITY;
                while rub.x_mm < boundary_mm + 30.0 {
                    let Some(finding) = rub.step(50.0, surface) else {
                        continue;
                    };
                    let right = finding.valid
                        && (f64::from(finding.wavelength_mm.unwrap()) / to_mm - 1.0).abs() < 0.1;
                    if !right {
                        right_from_mm = f64::INFINITY;
                    } else if right_from_mm.is_infinite() {
                        right_from_mm = rub.x_mm;
                    }
                }
                worst_mm = worst_mm.max(right_from_mm - boundary_mm);
            }
            // Measured 1.2 to 1.9 of the new λ, the estimate’s 0.5 mm included.
            let bound_mm = 2.0 * to_mm;
            assert!(worst_mm <= bound_mm, "{from_mm} to {to_mm}: {worst_mm} mm");
        }
    }
}

#[test]
fn the_amplitude_is_the_fundamentals_within_1_percent_at_every_speed() {
    let square: f64 = GAINS.iter().map(|gain| gain * gain).sum::<f64>() / 5.0;
    let want = AMPLITUDE * libm::sqrt(square);
    for wavelength_mm in [1.0, 1.37, 2.0, 4.4] {
        for speed_mm_s in [10.0, 20.0, 50.0, 100.0] {
            let mut rub = Rub::new();
            let mut off: f64 = 0.0;
            for _ in 0..(30.0 * wavelength_mm / speed_mm_s * 1e3) as u32 {
                let finding = rub.step(speed_mm_s, trapezoid(wavelength_mm));
                if let Some(finding) = finding.filter(|_| rub.x_mm > 12.0 * wavelength_mm) {
                    off = off.max((f64::from(finding.amplitude_lsb) / want - 1.0).abs());
                }
            }
            // Measured 0.4 % and below.
            assert!(
                off <= 0.01,
                "{off} of {wavelength_mm} mm at {speed_mm_s} mm/s"
            );
        }
    }
}

#[test]
fn the_gauge_that_says_something_else_is_named_also_when_it_is_left_out() {
    for odd in 0..GAUGES {
        for usable in [ALL, ALL & !(1 << odd)] {
            // The strongest alone holds as much as would be stood against.
            let valid = odd != 2 || usable != ALL;
            let mut rub = Rub::new();
            rub.touch.usable = usable;
            let surface = |gauge: usize, x_mm: f64| {
                trapezoid(if gauge == odd { 2.9 } else { 2.0 })(gauge, x_mm)
            };
            // 25 λ, in which the two have come apart.
            rub.rub(1_000, 50.0, surface);
            for _ in 0..1_000 {
                if let Some(finding) = rub.step(50.0, surface) {
                    assert_eq!(finding.valid, valid, "gauge {odd} of {usable:05b}");
                    assert_eq!(finding.misfits, 1 << odd, "of {usable:05b}");
                    assert_eq!(finding.gauges_used, usable);
                    let error = finding.wavelength_mm.unwrap() / 2.0 - 1.0;
                    assert!(error.abs() < 0.01, "{error}");
                }
            }
        }
    }
}
