//! The display board: the operator's hand in, fifty actuators out, at 2 kHz and on its own clock.
//!
//! ```text
//! TIM3 ─latch──> TIM4 (hand) ─┐ ┌─ emergency stop, alarm
//!      ├─tick───────────────> output <─SPI1─> 4 × DAC81416
//!      └─LDAC───────────────────┼───────────────┘ │
//!            TIM1 holds CLR off ┘ ───────────────┘
//!                          ^ └─ Motion, Safety ─> report ─> ports ─> USART2, USART3
//!                          └── Estimate, Stop, Configure ────┘
//! ```
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
mod bus;
#[cfg(target_os = "none")]
mod chain;
#[cfg(target_os = "none")]
mod clear;
#[cfg(target_os = "none")]
mod converters;
#[cfg(target_os = "none")]
mod crash;
#[cfg(target_os = "none")]
mod inputs;
#[cfg(target_os = "none")]
mod load;
#[cfg(target_os = "none")]
mod tasks;
#[cfg(target_os = "none")]
mod ticks;

// The log.
#[cfg(target_os = "none")]
use defmt_rtt as _;

#[cfg(target_os = "none")]
nucleo::identify!(protocol::Role::Display);

#[cfg(target_os = "none")]
#[embassy_executor::main]
async fn main(spawner: embassy_executor::Spawner) {
    let board = board::Board::take();
    tasks::start(spawner, board, HELLO);
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!(
        "firmware-display runs on the board: cargo run --release --target thumbv7em-none-eabihf -p firmware-display"
    );
    std::process::exit(2);
}
