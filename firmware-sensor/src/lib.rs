//! The sensor board's logic: pure, no hardware.
#![no_std]
