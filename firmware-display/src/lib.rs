//! The display board's logic: pure, no hardware.
#![no_std]
