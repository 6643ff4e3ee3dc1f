//! What Ridgelink's system tests share. The tests themselves, one idea a file, are in the `tests`
//! folder of this package: they run scenes on the two ELFs that a user would flash, through the same
//! library as the `hil-sim` command.

#[cfg(target_os = "linux")]
pub mod bench;
pub mod bridge;
pub mod browser;
pub mod certificates;
pub mod elves;
pub mod fake_bench;
pub mod fake_board;
pub mod history;
pub mod other_processor;
pub mod pty;
pub mod recorded;
pub mod relay;
pub mod run;
pub mod sensing;
pub mod stack;
pub mod swift_board;
pub mod terminal;
pub mod utterance;
pub mod virtual_boards;
pub mod virtual_clock;
pub mod virtual_desk;
pub mod virtual_network;
pub mod virtual_ports;
pub mod virtual_relay;
pub mod weather;
