//! What of the surface does not repeat, drawn at random, but always the same at the same place.
//!
//! Each octave band of [`protocol::texture`] is one-dimensional gradient noise (Perlin 1985, 2002): it is 0 at the
//! points of an even lattice, with a slope of +1 or −1 there that an integer hash of the point's number decides, and
//! between two points a, the line of the one, goes over into b, that of the other:
//!
//! n = a + s (b − a), a = g₀ t, b = g₁ (t − 1), s = 6t⁵ − 15t⁴ + 10t³, t from 0 to 1
//!
//! So it is a function of the place alone. A stroke that is reversed plays it back to the bit, and nothing is stored.
//! It is smooth up to its second derivative. Its RMS is [`RMS`], it is never beyond [`PEAK`], and its integral over the
//! place never leaves a band of [`CHARGE`] spacings. Half of its power is above, and half below, [`CENTRE`] waves to
//! a spacing, and 60 % of it within the octave around that: the spacing puts it into the middle of the band. All these
//! numbers are checked by tests.
//!
//! The lattices have 2¹⁶ points or less and then begin anew, after 24 m of travel: longer than any stage.

use protocol::texture::{BANDS, LOWEST_BAND_PER_MM};

/// RMS of a band at unit slope, in spacings of its lattice.
pub const RMS: f32 = 0.243_63;
/// The largest value, in the same.
pub const PEAK: f32 = 0.5;
/// By how much the integral over the place varies at most, in squared spacings: twice ∫ t (1 − s) dt.
pub const CHARGE: f32 = 2.0 / 7.0;
/// The median of the power's wavenumber, in waves to a spacing.
const CENTRE: f32 = 0.52;
/// The largest slope of any order over what a sine of the peak has whose wavenumber is the band's upper end: of the
/// first, second and third derivative.
pub const STEEPEST: [f32; 3] = [0.59, 0.71, 1.23];

/// Lattice points of the finest band in 2¹⁶ µm.
const POINTS: u32 = {
    // √2 times the lower end of a band is its middle.
    let middle_per_um = core::f32::consts::SQRT_2 * upper_end_per_mm(BANDS - 2) / 1_000.0;
    (65_536.0 * middle_per_um / CENTRE + 0.5) as u32
};
/// What a band's points are hashed with.
const SEEDS: [u32; BANDS] = [0x243F_6A88, 0x85A3_08D3, 0x1319_8A2E, 0x0370_7344];

/// The upper end of a band, in waves per mm.
pub const fn upper_end_per_mm(band: usize) -> f32 {
    LOWEST_BAND_PER_MM * (2_u32 << band) as f32
}

/// The spacing of a band's lattice, in mm.
pub const fn spacing_mm(band: usize) -> f32 {
    (1_u32 << (BANDS - 1 - band)) as f32 * 65.536 / POINTS as f32
}

/// A place between two points of a band's lattice.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cell {
    t: f32,
    /// The sign bit of the slope at the first point, and whether that at the second is the same.
    sign: u32,
    same: bool,
}

impl Cell {
    /// Where `place_um`, which may wrap, is in the lattice of a band.
    #[inline]
    fn at(place_um: i32, band: usize) -> Self {
        const FRACTION: u32 = 16;
        let shift = (BANDS - 1 - band) as u32;
        let places = (place_um as u32).wrapping_mul(POINTS);
        let next = places.wrapping_add(1 << (FRACTION + shift));
        let within = (places >> shift) & ((1 << FRACTION) - 1);
        let [first, second] =
            [places, next].map(|places| mixed(places >> (FRACTION + shift), SEEDS[band]));
        Self {
            t: within as f32 * (1.0 / (1 << FRACTION) as f32),
            sign: first & SIGN,
            same: (first ^ second) & SIGN == 0,
        }
    }

    #[inline]
    fn signed(self, value: f32) -> f32 {
        f32::from_bits(value.to_bits() ^ self.sign)
    }

    /// n = g₀ (t − s) where both slopes are the same, and g₀ (t + s − 2ts) where they are opposite.
    #[inline]
    fn value(self) -> f32 {
        let t = self.t;
        let s = step(t);
        self.signed(if self.same {
            t - s
        } else {
            t + s * (1.0 - 2.0 * t)
        })
    }

    /// Value, first and second derivative by t.
    #[inline]
    fn derivatives(self) -> [f32; 3] {
        let t = self.t;
        let p = t * (1.0 - t);
        let around = 1.0 - 2.0 * t;
        let (s, s1, s2) = (step(t), 30.0 * p * p, 60.0 * p * around);
        let [slope, bend] = if self.same {
            [1.0 - s1, -s2]
        } else {
            [1.0 + s1 * around - 2.0 * s, s2 * around - 4.0 * s1]
        };
        [self.value(), self.signed(slope), self.signed(bend)]
    }
}

/// s = 6t⁵ − 15t⁴ + 10t³
#[inline]
fn step(t: f32) -> f32 {
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}

/// The bit that is a float's sign.
const SIGN: u32 = 1 << 31;

/// A lattice point's number, mixed as if at random: its [`SIGN`] is the slope's.
#[inline]
const fn mixed(point: u32, seed: u32) -> u32 {
    let mixed = point.wrapping_mul(0x9E37_79B1).wrapping_add(seed);
    (mixed ^ (mixed >> 15)).wrapping_mul(0x85EB_CA77)
}

/// The value at a place in µm, which may wrap, of bands with these RMS levels over [`RMS`]. A band of 0 costs nothing.
#[inline]
pub fn value(levels: &[f32; BANDS], place_um: i32) -> f32 {
    let mut sum = 0.0;
    for (band, level) in levels.iter().enumerate() {
        if *level != 0.0 {
            sum += level * Cell::at(place_um, band).value();
        }
    }
    sum
}

/// The same with its first and second derivative by the place, per mm and per mm².
#[inline]
pub fn derivatives(levels: &[f32; BANDS], place_um: i32) -> [f32; 3] {
    let mut sums = [0.0; 3];
    for (band, level) in levels.iter().enumerate() {
        if *level != 0.0 {
            let mut factor = *level;
            for (sum, of_t) in sums.iter_mut().zip(Cell::at(place_um, band).derivatives()) {
                *sum += factor * of_t;
                factor *= 1.0 / spacing_mm(band);
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;
    use std::vec::Vec;

    use super::*;

    /// One band alone, at unit slope.
    fn only(band: usize) -> [f32; BANDS] {
        let mut levels = [0.0; BANDS];
        levels[band] = 1.0;
        levels
    }

    #[test]
    fn a_band_has_the_rms_the_peak_and_the_slopes_that_are_said_of_it() {
        for band in 0..BANDS {
            let levels = only(band);
            let places = 0..8_000_000 / (1 << band);
            let (mut square, mut most) = (0.0_f64, [0.0_f32; 3]);
            for place_um in places.clone() {
                let found = derivatives(&levels, place_um);
                assert_eq!(found[0].to_bits(), value(&levels, place_um).to_bits());
                square += f64::from(found[0]).powi(2);
                for (most, found) in most.iter_mut().zip(found) {
                    *most = most.max(found.abs());
                }
            }
            let rms = (square / f64::from(places.end)).sqrt();
            // Of some 2 700 points, of which neighbours agree or not: 2 % of the mean square is one standard error.
            assert!((rms / f64::from(RMS) - 1.0).abs() < 0.03, "{band}: {rms}");
            assert!(
                most[0] <= PEAK && most[0] > 0.999 * PEAK,
                "{band}: {most:?}"
            );
            // A sine of the upper end.
            let omega = core::f32::consts::TAU * upper_end_per_mm(band);
            let first = most[1] / (omega * PEAK) / STEEPEST[0];
            let second = most[2] / (omega * omega * PEAK) / STEEPEST[1];
            assert!((0.97..1.0).contains(&first), "{band}: {first}");
            assert!((0.97..1.0).contains(&second), "{band}: {second}");
        }
    }

    #[test]
    fn no_band_changes_its_bend_by_more_than_its_third_derivative_says() {
        for band in 0..BANDS {
            let omega = core::f32::consts::TAU * upper_end_per_mm(band);
            // In 16 µm, which are whole steps of every lattice's fraction.
            let most = STEEPEST[2] * omega.powi(3) * PEAK * 16.0 / 1_000.0;
            let levels = only(band);
            let mut found = 0.0_f32;
            for place_um in (0..1_000_000).step_by(16) {
                let [before, after] =
                    [place_um, place_um + 16].map(|place| derivatives(&levels, place)[2]);
                found = found.max((after - before).abs());
            }
            assert!(
                found <= 1.01 * most && found > 0.9 * most,
                "{band}: {found} {most}"
            );
        }
    }

    #[test]
    fn the_integral_over_the_place_never_leaves_its_band() {
        for band in 0..BANDS {
            let (mut sum, mut low, mut high) = (0.0_f64, 0.0_f64, 0.0_f64);
            for place_um in 0..4_000_000 {
                sum += f64::from(value(&only(band), place_um)) * 1e-3;
                (low, high) = (low.min(sum), high.max(sum));
            }
            let spacings = (high - low) / f64::from(spacing_mm(band));
            let most = f64::from(CHARGE);
            assert!(
                (0.99..1.01).contains(&(spacings / most)),
                "{band}: {spacings}"
            );
        }
    }

    #[test]
    fn half_of_the_power_is_on_either_side_of_the_bands_middle() {
        for band in 0..BANDS {
            // A 32nd of the shortest wave.
            let step_um = (1_000.0 / upper_end_per_mm(band) / 32.0) as i32;
            const LENGTH: usize = 4_096;
            let mut powers = std::vec![0.0; LENGTH / 8];
            for piece in 0..16 {
                let samples: Vec<f64> = (0..LENGTH)
                    .map(|i| {
                        let place = (piece * LENGTH + i) as i32 * step_um;
                        let window = (TAU / 2.0 * i as f64 / LENGTH as f64).sin().powi(2);
                        window * f64::from(value(&only(band), place))
                    })
                    .collect();
                for (bin, power) in powers.iter_mut().enumerate() {
                    let turn = bin as f64 / LENGTH as f64;
                    let [mut re, mut im] = [0.0; 2];
                    for (i, sample) in samples.iter().enumerate() {
                        let angle = TAU * (turn * i as f64).fract();
                        re += sample * angle.cos();
                        im += sample * angle.sin();
                    }
                    *power += re * re + im * im;
                }
            }
            let per_mm = 1_000.0 / f64::from(step_um) / LENGTH as f64;
            let middle = f64::from(upper_end_per_mm(band)) / 2_f64.sqrt();
            let share = |low: f64, high: f64| {
                let bins = powers.iter().enumerate();
                let within = bins.filter(|(bin, _)| (low..high).contains(&(*bin as f64 * per_mm)));
                within.map(|(_, power)| power).sum::<f64>() / powers.iter().sum::<f64>()
            };
            let below = share(0.0, middle);
            let root = 2_f64.sqrt();
            let octave = share(middle / root, middle * root);
            assert!((0.47..0.53).contains(&below), "{band}: {below}");
            assert!((0.56..0.64).contains(&octave), "{band}: {octave}");
        }
    }

    #[test]
    fn bands_and_places_have_nothing_to_do_with_each_other() {
        const PLACES: i32 = 200_000;
        let mean = |of: &dyn Fn(i32) -> f64| {
            (0..PLACES).map(|i| of(i * 40)).sum::<f64>() / f64::from(PLACES)
        };
        let at = |band: usize, place: i32| f64::from(value(&only(band), place) / RMS);
        for band in 0..BANDS {
            let far = (10.0 * spacing_mm(band) * 1_000.0) as i32;
            let apart = mean(&|place| at(band, place) * at(band, place + far));
            assert!(apart.abs() < 0.05, "{band}: {apart}");
            for other in 0..band {
                let alike = mean(&|place| at(band, place) * at(other, place));
                assert!(alike.abs() < 0.05, "{band} {other}: {alike}");
            }
        }
    }

    #[test]
    fn it_goes_on_smoothly_where_the_place_or_the_lattice_wraps() {
        // 2³² / POINTS µm are once around.
        let around_um = ((1_u64 << 32) / u64::from(POINTS)) as i32;
        for middle in [0, around_um, i32::MAX, -around_um] {
            for band in 0..BANDS {
                // The steepest slope, and a step of the lattice's fraction.
                let most = 1.36 * (1.0 / (spacing_mm(band) * 1_000.0) + 1.0 / 65_536.0);
                for off in -1_000..1_000 {
                    let place = middle.wrapping_add(off);
                    let step =
                        value(&only(band), place.wrapping_add(1)) - value(&only(band), place);
                    assert!(step.abs() <= most, "{band} {place}: {step}");
                }
            }
        }
    }
}
