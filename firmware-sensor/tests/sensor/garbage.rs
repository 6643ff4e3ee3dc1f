//! Whatever comes in, what goes out makes sense.

use firmware_sensor::{Scan, Sensor};
use protocol::{Estimate, Method, SensorConfiguration, StreamGauges};

/// Splitmix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn within(&mut self, low: u32, high: u32) -> u32 {
        low + (self.next() % u64::from(high - low + 1)) as u32
    }

    fn configuration(&mut self) -> SensorConfiguration {
        let configuration = SensorConfiguration {
            method: match self.within(0, 5) {
                0 => Method::Counting,
                1 => Method::AdaptedCounting,
                2 => Method::Crossings,
                _ => Method::Spectrum,
            },
            window_ms: self.within(10, 200) as u16,
            counted_gauge: self.within(0, 4) as u8,
            gauges: self.within(1, 31) as u8,
            waves: self.within(2, 8) as u8,
            valid_percent: self.within(50, 99) as u8,
            force_channel: self.within(0, 1) == 1,
            force_mn_per_v: self.within(1, 60_000) as u16,
            stiffness_n_per_m: match self.within(0, 2) {
                0 => 0,
                1 => 10,
                _ => self.within(10, 60_000) as u16,
            },
            arm_full_scale_um_s: self.within(1_000, 2_000_000),
        };
        configuration.check().unwrap();
        configuration
    }
}

fn makes_sense(
    estimate: &Estimate,
    configuration: &SensorConfiguration,
) -> Result<(), &'static str> {
    let sound = |wavelength_mm: Option<f32>| {
        wavelength_mm.is_none_or(|wavelength_mm| wavelength_mm.is_finite() && wavelength_mm > 0.0)
    };
    let checks = [
        (sound(estimate.wavelength_mm), "λ is finite and above 0"),
        (
            sound(estimate.counted_mm),
            "the counted λ is finite and above 0",
        ),
        (
            !estimate.valid || estimate.wavelength_mm.is_some(),
            "valid has a λ",
        ),
        (
            (0.0..=1.0).contains(&estimate.confidence),
            "the confidence is within 0 to 1",
        ),
        (
            estimate.amplitude_lsb.is_finite() && estimate.amplitude_lsb >= 0.0,
            "the amplitude is finite and not below 0",
        ),
        (
            estimate.gauges_used & !configuration.gauges == 0
                || matches!(
                    configuration.method,
                    Method::Counting | Method::AdaptedCounting
                ),
            "gauges that are not allowed are not used",
        ),
        (
            estimate.lag_um.is_none() || configuration.force_channel,
            "no lag without a force channel",
        ),
    ];
    checks
        .iter()
        .find(|check| !check.0)
        .map_or(Ok(()), |check| Err(check.1))
}

#[test]
fn a_million_steps_of_garbage_make_sense() {
    let mut random = Random(1);
    let mut configuration = random.configuration();
    let mut sensor = Sensor::new(configuration);
    let (mut encoder, mut steps, mut valid) = (0_u16, 0_u64, 0_u64);
    while steps < 1_000_000 {
        match random.within(0, 9) {
            0 => {
                configuration = random.configuration();
                sensor = Sensor::new(configuration);
            }
            1..=4 => {
                configuration = random.configuration();
                sensor.configure(configuration);
                sensor.stream_gauges(&StreamGauges {
                    for_ms: random.next() as u16,
                });
            }
            _ => {}
        }
        let (scans_kind, encoder_kind) = (random.within(0, 5), random.within(0, 5));
        let still = random.next() as u16 % 4_096;
        let per_ms = random.within(0, 60) as i16 - 30;
        let wave_places = f64::from(random.within(50, 2_000));
        for _ in 0..random.within(1, 3_000) {
            steps += 1;
            encoder = match encoder_kind {
                0 => random.next() as u16,
                1 => encoder.wrapping_add(if random.within(0, 1) == 0 {
                    32_767
                } else {
                    32_769
                }),
                2 => encoder,
                3 => encoder
                    .wrapping_add(random.within(0, 2) as u16)
                    .wrapping_sub(1),
                _ => encoder.wrapping_add_signed(per_ms),
            };
            let scans: [Scan; 4] = std::array::from_fn(|_| {
                std::array::from_fn(|channel| match scans_kind {
                    0 => random.next() as u16,
                    1 => random.next() as u16 % 4_096,
                    2 => still,
                    3 => [0, 4_095][random.within(0, 1) as usize],
                    _ => {
                        let theta = f64::from(encoder) / wave_places + channel as f64;
                        (2_048.0 + 600.0 * theta.sin()) as u16 + random.within(0, 30) as u16
                    }
                })
            });
            if let Some(estimate) = sensor.step(steps * 1_000, &scans, encoder).estimate {
                valid += u64::from(estimate.valid);
                if let Err(what) = makes_sense(&estimate, &configuration) {
                    panic!("{what}: {estimate:?} with {configuration:?} in step {steps}");
                }
            }
        }
    }
    // Among the garbage there were surfaces, so that valid estimates were looked at as well.
    assert!(valid > 1_000, "{valid}");
}
