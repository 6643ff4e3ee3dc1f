//! What the two Nucleo-F429ZI boards of Ridgelink have in common, on the board only: on a host this
//! crate is empty.
#![no_std]
#![cfg(target_os = "none")]

pub mod answer;
pub mod clock;
pub mod console;
pub mod encoder;
pub mod identity;
pub mod kept_configuration;
pub mod ports;
pub mod reset;
pub mod serial;
pub mod side;
pub mod spawn;
pub mod stack;
pub mod stop;
pub mod supervision;
pub mod trip;
