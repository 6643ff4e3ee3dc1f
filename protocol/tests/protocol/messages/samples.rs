//! A message of each kind.

use protocol::*;

use super::{
    actuator, display_capabilities, display_counters, hello, port, sensor_capabilities,
    sensor_counters,
};

/// One message of each kind, with every role and both outcomes of a configuration.
pub fn samples() -> Vec<(&'static str, Message)> {
    let sensor = Configuration::Sensor(SensorConfiguration {
        method: Method::Counting,
        window_ms: 80,
        counted_gauge: 2,
        gauges: 0b1_0111,
        waves: 5,
        valid_percent: 95,
        force_channel: true,
        force_mn_per_v: 1_500,
        stiffness_n_per_m: 400,
        arm_full_scale_um_s: 200_000,
    });
    let display = Configuration::Display(DisplayConfiguration {
        mode: Mode::Travelling,
        rendering: Rendering::Texture,
        update_rate: UpdateRate::Hz4000,
        max_age_ms: 500,
        fade_in_ms: 20,
        fade_out_ms: 50,
        glide_ms: 20,
        amplitude_mv: 5_000,
        reference_lsb: 300,
        reference_mn: 250,
        full_drive_s: 600,
        actuators: 0x1234_5678,
    });
    let status = |role| {
        Message::Status(Status {
            uptime_us: 5_000_000,
            reset: ResetCause::Watchdog,
            watchdog_resets: 1,
            stack_free_bytes: 90_000,
            peer: port(core::array::from_fn(|i| 1 + i as u32)),
            console: port(core::array::from_fn(|i| 1_000 + i as u32)),
            role,
        })
    };
    vec![
        ("hello", Message::Hello(hello())),
        (
            "estimate",
            Message::Estimate(Estimate {
                sequence: 300,
                instant_us: 3_000_000,
                wavelength_mm: Some(2.0),
                valid: true,
                confidence: 0.75,
                amplitude_lsb: 512.5,
                counted_mm: Some(2.5),
                range: Range::T2,
                contact: Contact::StickSlip,
                velocity_um_s: 70_000,
                lag_um: Some(-150),
                gauges_used: 0b0_0010,
                health: [
                    GaugeHealth::Dead,
                    GaugeHealth::Good,
                    GaugeHealth::Stuck,
                    GaugeHealth::Saturated,
                    GaugeHealth::Hum,
                ],
            }),
        ),
        (
            "estimate without a wavelength",
            Message::Estimate(Estimate {
                sequence: 0,
                instant_us: 10_000,
                wavelength_mm: None,
                valid: false,
                confidence: 0.0,
                amplitude_lsb: 0.0,
                counted_mm: None,
                range: Range::T1,
                contact: Contact::Unknown,
                velocity_um_s: 0,
                lag_um: None,
                gauges_used: 0b1_1111,
                health: [GaugeHealth::Good; GAUGES],
            }),
        ),
        (
            "motion",
            Message::Motion(Motion {
                sequence: 1_500,
                instant_us: 3_000_000,
                position_um: -12_345,
                velocity_um_s: 70_000,
            }),
        ),
        (
            "gauges",
            Message::Gauges(Gauges {
                first_sample: 4_000,
                instant_us: 4_000_000,
                position_um: 20_000,
                samples: core::array::from_fn(|i| GaugeSample {
                    codes: core::array::from_fn(|channel| 32_768 + 100 * i as u16 + channel as u16),
                    travel_um: i as i16 - 4,
                }),
            }),
        ),
        (
            "sensor's status",
            status(RoleCounters::Sensor(sensor_counters([
                5_000, 1, 2, 3, 500, 2_500,
            ]))),
        ),
        (
            "display's status",
            status(RoleCounters::Display(display_counters([
                10_000, 9_000, 1, 500, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11,
            ]))),
        ),
        (
            "configure a sensor",
            Message::Configure(Configure::anyway(sensor)),
        ),
        (
            "configure a display",
            Message::Configure(Configure {
                replaces: Some(0x0102_0304),
                configuration: display,
            }),
        ),
        (
            "configuration taken",
            Message::Configuration(ConfigurationReport {
                refused: None,
                hash: sensor.hash(),
                configuration: sensor,
            }),
        ),
        (
            "configuration refused",
            Message::Configuration(ConfigurationReport {
                refused: Some(Refusal {
                    setting: Setting::ActuatorX,
                    index: 37,
                    low: -20_000,
                    high: 20_000,
                }),
                hash: 0x0102_0304,
                configuration: display,
            }),
        ),
        ("ping", Message::Ping(Ping { sent_us: 1_000 })),
        (
            "pong",
            Message::Pong(Pong {
                sent_us: 1_000,
                received_us: 2_000,
                answered_us: 2_050,
            }),
        ),
        (
            "stop by the operator",
            Message::Stop(Stop {
                reason: StopReason::Operator,
            }),
        ),
        (
            "stop by the host",
            Message::Stop(Stop {
                reason: StopReason::Host,
            }),
        ),
        (
            "actuators",
            Message::Actuators(Actuators {
                first: 20,
                actuators: core::array::from_fn(|i| {
                    let i = i as i16;
                    actuator((-1_500 * i, 700, [0x8000, 0x4000, 900, 70], i % 2 == 1))
                }),
            }),
        ),
        (
            "safety: driving",
            Message::Safety(Safety {
                instant_us: 3_000_000,
                state: DisplayState::Driving,
            }),
        ),
        (
            "safety: stopped",
            Message::Safety(Safety {
                instant_us: 3_000_000,
                state: DisplayState::Stopped(Trip::Converter),
            }),
        ),
        (
            "stopped by the emergency stop",
            Message::Stopped(Stopped::by(Trip::EmergencyStop)),
        ),
        (
            "ask for the configuration",
            Message::Question(Question::Configuration),
        ),
        (
            "ask for the capabilities",
            Message::Question(Question::Capabilities),
        ),
        (
            "a sensor's capabilities",
            Message::Capabilities(Capabilities::Sensor(sensor_capabilities())),
        ),
        (
            "a display's capabilities",
            Message::Capabilities(Capabilities::Display(display_capabilities())),
        ),
        (
            "stream the gauges",
            Message::StreamGauges(StreamGauges { for_ms: 1_000 }),
        ),
        (
            "arm: stopped by the operator",
            Message::Arm(Arm {
                instant_us: 3_000_000,
                state: ArmState::Stopped(Trip::Operator),
            }),
        ),
        (
            "texture",
            Message::Texture(Texture {
                sequence: 60,
                instant_us: 3_000_000,
                valid: true,
                partials: [
                    Partial {
                        ratio: 400,
                        phase: 16_384,
                    },
                    Partial {
                        ratio: 250,
                        phase: 49_152,
                    },
                ],
                repeating_percent: 87,
                bands: [12, 30, 260, 95],
                friction: Some(Friction {
                    mean_mn: 500,
                    fluctuation_mn: 71,
                }),
            }),
        ),
    ]
}
