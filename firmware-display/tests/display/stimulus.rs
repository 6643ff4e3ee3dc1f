//! The stimulus through its public face: what the actuators get for what the hand does.

mod amplitude;
mod following;
mod purity;
mod rest;
mod rig;
mod standing;
mod steps;
