//! Both boards' logic on one core that is neither of them, without a HAL: scans in, fifty DAC words out, and
//! the protocol between. `./test` links it for two cores; nobody runs it.
//!
//! By hand, from this folder (RUSTFLAGS put the boards' linker scripts aside, which cargo finds further up):
//!
//! ```sh
//! RUSTFLAGS= cargo build --locked --target thumbv7em-none-eabihf
//! ```
#![no_std]
#![no_main]

use core::hint::{black_box, spin_loop};

use firmware_display::{Display, Senses, Settings, TICK_RATE_HZ};
use firmware_sensor::{MID_RAIL_CODE, SAMPLE_RATE_HZ, SCANS_PER_SAMPLE, Sensor};
use protocol::{CHANNELS, Hello, MAX_FRAME, Message, Port, Role, SensorConfiguration};

/// Output ticks while the gauges give one sample.
const TICKS_PER_SAMPLE: u32 = TICK_RATE_HZ / SAMPLE_RATE_HZ;
const MICROSECONDS_PER_SAMPLE: u64 = 1_000_000 / SAMPLE_RATE_HZ as u64;

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut sensor = Sensor::new(SensorConfiguration::DEFAULT);
    let mut display = Display::new(&Settings::DEFAULT, None);
    display.started(Ok(()));
    let mut sensors_end = Port::new(Hello::new(Role::Sensor, "any", [0; 3]));
    let mut displays_end = Port::new(Hello::new(Role::Display, "any", [0; 3]));
    let mut now_us = 0;
    loop {
        // A board would wait for its timer here, and read its ADC and its encoders.
        now_us += MICROSECONDS_PER_SAMPLE;
        let scans = black_box([[MID_RAIL_CODE; CHANNELS]; SCANS_PER_SAMPLE]);
        let (arm, hand) = black_box((0, 0));

        let felt = sensor.step(now_us, &scans, arm);
        black_box(felt.drive);
        if let Some(estimate) = felt.estimate {
            sensors_end.post(&Message::Estimate(estimate));
        }
        if let Some(gauges) = felt.gauges {
            sensors_end.post(&Message::Gauges(gauges));
        }
        for _ in 0..TICKS_PER_SAMPLE {
            black_box(display.tick(hand, &Senses::default()));
            black_box(display.words());
            if let Some(motion) = display.motion(now_us) {
                displays_end.post(&Message::Motion(motion));
            }
        }
        carry(&mut sensors_end, &mut displays_end, now_us, |message| {
            if let Message::Estimate(estimate) = message {
                display.on_estimate(&estimate);
            }
        });
        carry(&mut displays_end, &mut sensors_end, now_us, |message| {
            if let Message::Motion(motion) = message {
                sensor.on_motion(&motion);
            }
        });
    }
}

/// What waits in one port, by way of a wire, into the other.
fn carry(from: &mut Port, to: &mut Port, now_us: u64, mut hear: impl FnMut(Message)) {
    from.poll(now_us);
    let mut wire = [0; MAX_FRAME];
    loop {
        let taken = from.take(&mut wire);
        if taken == 0 {
            return;
        }
        to.receive(now_us, &wire[..taken], &mut hear);
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {
        spin_loop();
    }
}
