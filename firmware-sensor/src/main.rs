//! The sensor board: gauges and arm encoder in, λ out, the operator's motion to the arm's drive.
//!
//! ```text
//! TIM3 ─trigger─> ADC3 ─DMA─> sample ── Estimate, Gauges ──> report ─> ports ─> USART2, USART3
//!      └─latch──> TIM4 ─────>   │ ^                                      │
//!                       arm PWM <┘ └────── Motion, Configure, Stop ──────┘
//! ```
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
mod tasks;

// The log, and what is logged when all else fails; a panic ends in the watchdog's reset.
#[cfg(target_os = "none")]
use {defmt_rtt as _, panic_probe as _};

#[cfg(target_os = "none")]
nucleo::identify!(protocol::Role::Sensor);

#[cfg(target_os = "none")]
#[embassy_executor::main]
async fn main(spawner: embassy_executor::Spawner) {
    let board = board::Board::take();
    tasks::start(spawner, board, HELLO);
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!(
        "firmware-sensor runs on the board: cargo run --release --target thumbv7em-none-eabihf -p firmware-sensor"
    );
    std::process::exit(2);
}
