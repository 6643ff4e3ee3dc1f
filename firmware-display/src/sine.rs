//! The sine of an integer phase, without floating point and without a table.
//!
//! A quarter wave is sin(π/2 x) = 2 Σ (−1)ᵏ J₂ₖ₊₁(π/2) T₂ₖ₊₁(x), with Bessel's functions and Chebyshev's
//! polynomials. Its terms up to T₇ are x (c₁ − x² (c₃ − x² (c₅ − x² c₇))) for x from 0 to 1; the rest of
//! the wave follows by symmetry. Every parenthesis is positive, so that unsigned arithmetic does, which
//! both a Cortex-M4 (`umull`) and a computer's vector unit (`pmuludq`) have in one instruction.
//!
//! Error: no T is beyond 1, so the terms left out are less than 2 (J₉ + J₁₁ + …)(π/2) = 5.9·10⁻⁷, a 50th
//! of a step of the DAC at full scale; cutting products off adds 2⁻²⁶ = 1.5·10⁻⁸ at most. At the crest
//! the first term left out is positive, so that no sine is beyond 1.

/// One, in the sine's Q28.
pub const ONE: i32 = 1 << 28;

/// Jₙ(π/2) by its series: Σ (−1)ᵐ (π/4)²ᵐ⁺ⁿ / (m! (m+n)!).
const fn bessel(n: u32) -> f64 {
    let z = core::f64::consts::FRAC_PI_4;
    let mut term = 1.0;
    let mut i = 1;
    while i <= n {
        term *= z / i as f64;
        i += 1;
    }
    let mut sum = 0.0;
    let mut m = 1;
    // The last of these terms is less than 2⁻⁵³ of the first.
    while m <= 12 {
        sum += term;
        term *= -z * z / (m * (m + n)) as f64;
        m += 1;
    }
    sum
}

const J1: f64 = bessel(1);
const J3: f64 = bessel(3);
const J5: f64 = bessel(5);
const J7: f64 = bessel(7);

/// In Q28.
const fn fixed(coefficient: f64) -> u32 {
    (coefficient * ONE as f64 + 0.5) as u32
}

// T₃ = 4x³ − 3x, T₅ = 16x⁵ − 20x³ + 5x, T₇ = 64x⁷ − 112x⁵ + 56x³ − 7x.
const C1: u32 = fixed(2.0 * (J1 + 3.0 * J3 + 5.0 * J5 + 7.0 * J7));
const C3: u32 = fixed(2.0 * (4.0 * J3 + 20.0 * J5 + 56.0 * J7));
const C5: u32 = fixed(2.0 * (16.0 * J5 + 112.0 * J7));
const C7: u32 = fixed(2.0 * 64.0 * J7);

/// The sine of `turns` / 2³² turns, in Q28. Half a turn on it is exactly the opposite.
#[inline]
pub const fn sine(turns: u32) -> i32 {
    // The half wave's own phase, folded at its middle, is the quarter's x in Q32.
    let half = turns << 1;
    let x = (half ^ (half as i32 >> 31) as u32) << 1;
    let x2 = upper(x, x);
    let series = C5 - upper(x2, C7);
    let series = C3 - upper(x2, series);
    let series = C1 - upper(x2, series);
    let sign = turns as i32 >> 31;
    (upper(x, series) as i32 ^ sign) - sign
}

/// The upper word of a product.
#[inline]
const fn upper(a: u32, b: u32) -> u32 {
    ((a as u64 * b as u64) >> 32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(turns: u32) -> f64 {
        f64::from(sine(turns)) / f64::from(ONE)
    }

    fn exact(turns: u32) -> f64 {
        (f64::from(turns) / crate::phase::TURN * core::f64::consts::TAU).sin()
    }

    #[test]
    fn differs_from_the_sine_by_less_than_the_terms_left_out_and_the_bits_cut_off() {
        let left_out: f64 = (4..9).map(|k| 2.0 * bessel(2 * k + 1)).sum();
        // A unit of each of the three products and of the result, none amplified since x is not beyond 1; the
        // coefficients' half units have either sign, and x² is finer by 2⁴.
        let cut_off = 4.0 / f64::from(ONE);
        let bound = left_out + cut_off;
        assert!(bound < 6.1e-7);
        // An odd stride visits all residues; 2²² of them leave no gap wider than 2¹¹ units.
        let worst = (0..1_u32 << 22)
            .map(|i| i.wrapping_mul(1_025))
            .map(|turns| (value(turns) - exact(turns)).abs())
            .fold(0.0, f64::max);
        assert!(worst <= bound, "worst error {worst:e}, bound {bound:e}");
        assert!(
            worst > 0.9 * left_out,
            "the bound is not idle: worst error {worst:e}"
        );
    }

    #[test]
    fn is_the_opposite_half_a_turn_on() {
        for i in 0..100_000_u32 {
            let turns = i.wrapping_mul(42_949);
            let there = sine(turns.wrapping_add(1 << 31));
            assert_eq!(sine(turns), -there, "{turns}");
        }
    }

    #[test]
    fn stays_within_one_and_comes_within_a_millionth_of_it() {
        for offset in 0..10_000_u32 {
            for quarter in 0..4_u32 {
                let turns = (quarter << 30).wrapping_add(offset).wrapping_sub(5_000);
                assert!(sine(turns).abs() < ONE);
            }
        }
        assert!(value(1 << 30) > 1.0 - 1e-6);
        assert!(value(3 << 30) < -1.0 + 1e-6);
        assert_eq!(sine(0), 0);
    }
}
