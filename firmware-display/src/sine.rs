//! The sine of an integer phase, without floating point and without a table.
//!
//! A quarter wave by the Taylor polynomial of degree 9 in Horner's form,
//! sin(π/2 x) = x (c₁ − x² (c₃ − x² (c₅ − x² (c₇ − x² c₉)))), the rest by symmetry.
//! For 0 ≤ x ≤ 1 every parenthesis is positive, so that unsigned arithmetic does, which both a
//! Cortex-M4 (`umull`) and a computer's vector unit (`pmuludq`) have in one instruction.
//!
//! Error: the series' first term left out, (π/2)¹¹/11! = 3.6·10⁻⁶, plus six roundings of 2⁻³¹:
//! less than 2⁻¹⁸ of the amplitude, a quarter of the 16-bit DAC's rounding.

/// One, in the magnitude's Q31.
pub const ONE: u32 = 1 << 31;

/// (π/2)ⁿ/n! in Q31.
const fn coefficient(n: u32) -> u32 {
    let mut c = 1.0;
    let mut i = 1;
    while i <= n {
        c *= core::f64::consts::FRAC_PI_2 / i as f64;
        i += 1;
    }
    (c * ONE as f64 + 0.5) as u32
}

const C1: u32 = coefficient(1);
const C3: u32 = coefficient(3);
const C5: u32 = coefficient(5);
const C7: u32 = coefficient(7);
const C9: u32 = coefficient(9);

/// A sine, as magnitude and sign: so that what is scaled and rounded is the same above and below 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sine {
    /// |sin|, 0 to [`ONE`].
    pub magnitude: u32,
    /// 0 where the sine is positive, −1 (all bits set) where it is negative.
    pub sign: i32,
}

impl Sine {
    /// The sine of `turns` / 2³² turns. Half a turn on it is exactly the opposite.
    #[inline]
    pub const fn of(turns: u32) -> Self {
        // The half wave's own phase, folded at its middle, is the quarter's x in Q32.
        let half = turns << 1;
        let x = (half ^ ((half as i32 >> 31) as u32)) << 1;
        let x2 = high(x, x);
        let series = C7 - high(x2, C9);
        let series = C5 - high(x2, series);
        let series = C3 - high(x2, series);
        let series = C1 - high(x2, series);
        let magnitude = high(x, series);
        Self {
            // The series overshoots 1 by what it leaves out.
            magnitude: if magnitude < ONE { magnitude } else { ONE },
            sign: turns as i32 >> 31,
        }
    }

    /// The sine in Q30, −2³⁰ to 2³⁰, cut towards 0.
    #[inline]
    pub const fn q30(self) -> i32 {
        ((self.magnitude >> 1) as i32 ^ self.sign) - self.sign
    }
}

/// The product of a Q32 fraction and a number, in the number's own scale.
#[inline]
const fn high(fraction: u32, number: u32) -> u32 {
    ((fraction as u64 * number as u64) >> 32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(turns: u32) -> f64 {
        let sine = Sine::of(turns);
        let magnitude = f64::from(sine.magnitude) / f64::from(ONE);
        if sine.sign == 0 {
            magnitude
        } else {
            -magnitude
        }
    }

    fn exact(turns: u32) -> f64 {
        (f64::from(turns) / crate::phase::TURN * core::f64::consts::TAU).sin()
    }

    #[test]
    fn differs_from_the_sine_by_less_than_the_series_bound() {
        let left_out = (1..=11).fold(1.0, |c, n| c * core::f64::consts::FRAC_PI_2 / f64::from(n));
        // Truncations of x², of each product and of the result, none amplified beyond itself.
        let bound = left_out + 8.0 / f64::from(ONE);
        assert!(bound < 2.0_f64.powi(-18));
        // An odd stride visits all residues; 2²² of them leave no gap wider than 2¹¹ units.
        let worst = (0..1_u32 << 22)
            .map(|i| i.wrapping_mul(1_025))
            .map(|turns| (value(turns) - exact(turns)).abs())
            .fold(0.0, f64::max);
        assert!(worst <= bound, "worst error {worst:e}, bound {bound:e}");
        assert!(
            worst > left_out / 2.0,
            "the bound is not idle: worst error {worst:e}"
        );
    }

    #[test]
    fn is_the_opposite_half_a_turn_on() {
        for i in 0..100_000_u32 {
            let turns = i.wrapping_mul(42_949);
            let (here, there) = (Sine::of(turns), Sine::of(turns.wrapping_add(1 << 31)));
            assert_eq!(here.magnitude, there.magnitude);
            assert_eq!(here.sign, !there.sign);
        }
    }

    #[test]
    fn stays_within_one_and_reaches_it() {
        for offset in 0..10_000_u32 {
            for quarter in 0..4_u32 {
                let turns = (quarter << 30).wrapping_add(offset).wrapping_sub(5_000);
                assert!(Sine::of(turns).magnitude <= ONE);
            }
        }
        assert_eq!(
            Sine::of(1 << 30),
            Sine {
                magnitude: ONE,
                sign: 0
            }
        );
        assert_eq!(
            Sine::of(3 << 30),
            Sine {
                magnitude: ONE,
                sign: -1
            }
        );
        assert_eq!(Sine::of(0).magnitude, 0);
    }
}
