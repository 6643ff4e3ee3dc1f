//! A number that counts what is done with it: so the work of a crate that cannot run on the board is
//! measured, in operations, on the host.
//!
//! It is an `f32` in every other respect. Generic crates have no vector code for it, as there is none on a
//! Cortex-M4F.

use std::cell::Cell;
use std::fmt;
use std::num::FpCategory;
use std::ops::{Add, Div, Mul, Neg, Rem, Sub};

use realfft::num_traits::float::FloatCore;
use realfft::num_traits::{FromPrimitive, Num, NumCast, One, Signed, ToPrimitive, Zero};

thread_local! {
    static OPERATIONS: Cell<u64> = const { Cell::new(0) };
}

/// A number whose additions, subtractions, multiplications, divisions and changes of sign are counted.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Tally(pub f32);

/// Operations on [`Tally`]s during `work`, in this thread.
pub fn operations(work: impl FnOnce()) -> u64 {
    let before = OPERATIONS.get();
    work();
    OPERATIONS.get() - before
}

fn counted(value: f32) -> Tally {
    OPERATIONS.set(OPERATIONS.get() + 1);
    Tally(value)
}

macro_rules! operator {
    ($($operator:ident $method:ident),*) => {
        $(impl $operator for Tally {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                counted(self.0.$method(other.0))
            }
        })*
    };
}

operator!(Add add, Sub sub, Mul mul, Div div, Rem rem);

impl Neg for Tally {
    type Output = Self;
    fn neg(self) -> Self {
        counted(-self.0)
    }
}

impl std::iter::Sum for Tally {
    fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
        terms.fold(Self(0.0), Add::add)
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Zero for Tally {
    fn zero() -> Self {
        Self(0.0)
    }
    fn is_zero(&self) -> bool {
        self.0 == 0.0
    }
}

impl One for Tally {
    fn one() -> Self {
        Self(1.0)
    }
}

impl Num for Tally {
    type FromStrRadixErr = <f32 as Num>::FromStrRadixErr;
    fn from_str_radix(text: &str, radix: u32) -> Result<Self, Self::FromStrRadixErr> {
        <f32 as Num>::from_str_radix(text, radix).map(Self)
    }
}

impl Signed for Tally {
    fn abs(&self) -> Self {
        counted(self.0.abs())
    }
    fn abs_sub(&self, other: &Self) -> Self {
        counted((self.0 - other.0).max(0.0))
    }
    fn signum(&self) -> Self {
        Self(self.0.signum())
    }
    fn is_positive(&self) -> bool {
        self.0.is_sign_positive()
    }
    fn is_negative(&self) -> bool {
        self.0.is_sign_negative()
    }
}

impl ToPrimitive for Tally {
    fn to_i64(&self) -> Option<i64> {
        self.0.to_i64()
    }
    fn to_u64(&self) -> Option<u64> {
        self.0.to_u64()
    }
    fn to_f64(&self) -> Option<f64> {
        self.0.to_f64()
    }
}

impl FromPrimitive for Tally {
    fn from_i64(value: i64) -> Option<Self> {
        Some(Self(value as f32))
    }
    fn from_u64(value: u64) -> Option<Self> {
        Some(Self(value as f32))
    }
    fn from_f64(value: f64) -> Option<Self> {
        Some(Self(value as f32))
    }
}

impl NumCast for Tally {
    fn from<T: ToPrimitive>(value: T) -> Option<Self> {
        value.to_f32().map(Self)
    }
}

impl FloatCore for Tally {
    fn infinity() -> Self {
        Self(f32::INFINITY)
    }
    fn neg_infinity() -> Self {
        Self(f32::NEG_INFINITY)
    }
    fn nan() -> Self {
        Self(f32::NAN)
    }
    fn neg_zero() -> Self {
        Self(-0.0)
    }
    fn min_value() -> Self {
        Self(f32::MIN)
    }
    fn min_positive_value() -> Self {
        Self(f32::MIN_POSITIVE)
    }
    fn epsilon() -> Self {
        Self(f32::EPSILON)
    }
    fn max_value() -> Self {
        Self(f32::MAX)
    }
    fn classify(self) -> FpCategory {
        self.0.classify()
    }
    fn to_degrees(self) -> Self {
        Self(self.0.to_degrees())
    }
    fn to_radians(self) -> Self {
        Self(self.0.to_radians())
    }
    fn integer_decode(self) -> (u64, i16, i8) {
        FloatCore::integer_decode(self.0)
    }
    fn is_sign_negative(self) -> bool {
        self.0.is_sign_negative()
    }
    fn is_sign_positive(self) -> bool {
        self.0.is_sign_positive()
    }
}

impl pitch_detection::float::Float for Tally {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_operation_is_counted_once_and_is_f32s() {
        let mut result = Tally(0.0);
        let count = operations(|| {
            result = (Tally(3.0) * Tally(0.1) - Tally(1.0)) / Tally(7.0) + -Tally(2.0);
        });
        assert_eq!(count, 5);
        assert_eq!(result.0, (3.0f32 * 0.1 - 1.0) / 7.0 + -2.0);
    }
}
