//! `host-bridge` without boards: its commands, what it makes of facts, what it draws.

mod cli;
mod completions;
mod doctor;
mod flash;
mod monitor_draw;
mod monitor_model;
