//! What the bank promises, against closed forms and a direct solution in f64.

use super::*;
use crate::MICROMETRES_PER_COUNT;

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
        self.travel.push(libm::floor(x_um / f64::from(MICROMETRES_PER_COUNT)) as i64 as u16);
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
        let harmonics = libm::sin(theta)
            + 0.28 * libm::sin(3.0 * theta)
            + 0.12 * libm::sin(5.0 * theta);
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
