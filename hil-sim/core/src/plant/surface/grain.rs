//! Heights at random: the part of a real surface that never comes again.
//!
//! Three lattices of independent heights, a factor of four apart, smoothed by cubic B-splines and of equal
//! power: about as much in every octave of wavelengths from 0.5 to 10 mm. A height is a hash of its lattice
//! and its number, so the surface has no end, and is the same whenever a gauge comes back.

/// Distances of two lattice points, in mm.
const SPACINGS_MM: [f64; 3] = [0.15, 0.6, 2.4];
/// Mean square of a cubic B-spline through independent heights of power 1: Σ of its weights' squares, over
/// all places between two points.
const SPLINE_POWER: f64 = 151.0 / 315.0;

/// The random heights of a surface.
#[derive(Clone, Copy, Debug)]
pub struct Grain {
    seed: u64,
    weight: f64,
}

impl Grain {
    /// Heights of this RMS.
    pub fn new(rms: f64, seed: u64) -> Self {
        Self {
            seed,
            weight: rms / (SPACINGS_MM.len() as f64 * SPLINE_POWER).sqrt(),
        }
    }

    /// The height at `x_mm`.
    pub fn height(&self, x_mm: f64) -> f64 {
        let lattices = SPACINGS_MM.iter().zip(1u64..);
        let sum: f64 = lattices
            .map(|(spacing_mm, lattice)| {
                let at = x_mm / spacing_mm;
                let point = at.floor();
                let weights = spline(at - point);
                let points = (point as i64 - 1)..;
                weights
                    .into_iter()
                    .zip(points)
                    .map(|(weight, point)| weight * normal(hash(self.seed, lattice, point)))
                    .sum::<f64>()
            })
            .sum();
        self.weight * sum
    }
}

/// Weights of the four points about a place, `t` from 0 to 1 of the way from the second to the third.
fn spline(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        (1.0 - t).powi(3) / 6.0,
        (3.0 * t3 - 6.0 * t2 + 4.0) / 6.0,
        (-3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0) / 6.0,
        t3 / 6.0,
    ]
}

/// 64 even bits of a seed, a kind and a number: SplitMix64's finish, once for each.
pub fn hash(seed: u64, kind: u64, number: i64) -> u64 {
    [kind, number as u64].into_iter().fold(seed, |bits, next| {
        let mut bits = (bits ^ next).wrapping_add(0x9e37_79b9_7f4a_7c15);
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^ (bits >> 31)
    })
}

/// Nearly normal, of mean 0 and power 1: four even numbers of 16 bits, whose sum has the power 4/12.
fn normal(bits: u64) -> f64 {
    let sum: f64 = (0..4)
        .map(|part| (f64::from((bits >> (16 * part)) as u16) + 0.5) / 65_536.0 - 0.5)
        .sum();
    sum * 3f64.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_have_their_rms_and_no_mean() {
        let grain = Grain::new(0.5, 1);
        let places = 200_000;
        let (mut sum, mut squares) = (0.0, 0.0);
        for place in 0..places {
            let height = grain.height(f64::from(place) * 0.05);
            sum += height;
            squares += height * height;
        }
        let (mean, power) = (sum / f64::from(places), squares / f64::from(places));
        // 10 m hold 4 000 heights of the coarsest lattice, a third of the power each: σ of the power about
        // √(2/4000)/3 + … < 2 %; 4 σ. The mean's σ is 0.5/√3/√4000 = 0.5 %.
        assert!((power / 0.25 - 1.0).abs() < 0.08, "{power}");
        assert!(mean.abs() < 0.02, "{mean}");
    }

    #[test]
    fn heights_have_no_period() {
        let grain = Grain::new(1.0, 2);
        let places = 50_000;
        for lag_mm in [10.0, 20.0, 40.0] {
            let product: f64 = (0..places)
                .map(|place| {
                    let x_mm = f64::from(place) * 0.2;
                    grain.height(x_mm) * grain.height(x_mm + lag_mm)
                })
                .sum::<f64>()
                / f64::from(places);
            // As for the mean: correlated over 2.4 mm, so 4 000 independent products; 4 σ.
            assert!(product.abs() < 0.06, "{product} at {lag_mm} mm");
        }
    }

    #[test]
    fn a_place_has_its_height_whenever_it_is_asked_and_a_seed_its_own() {
        let (one, other) = (Grain::new(1.0, 3), Grain::new(1.0, 4));
        assert_eq!(one.height(-17.3), one.height(-17.3));
        assert_ne!(one.height(-17.3), other.height(-17.3));
        // Smooth: splines of the finest lattice rise by at most 3.5 · 2 of their weight a spacing.
        let step = one.height(5.0 + 1e-6) - one.height(5.0);
        assert!(step.abs() < 1e-6 * 3.0 * 7.0 / 0.15, "{step}");
    }
}
