//! The emulated boards: the converters, and both engines compared.

mod dac81416;
mod dac81416_defects;
mod engines;
