//! The stimulus through its public face: what the actuators get for what the hand does.

mod amplitude;
mod following;
mod purity;
mod rendering;
mod rest;
mod rig;
mod skin;
mod standing;
mod steps;
