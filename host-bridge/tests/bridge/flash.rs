//! `host-bridge flash`: what it refuses and what it plans, without a probe; and how it programs a chip, by
//! a probe that has a model of one behind it.

mod chip;
mod elf;
mod programming;
mod refusals;
