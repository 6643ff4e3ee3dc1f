//! The longest message of each kind.

use protocol::texture::{BANDS, PARTIALS};
use protocol::*;

use super::{actuator, display_counters, port, sensor_capabilities, setting_range};

/// The longest message of the same kind: every number where its varint is longest. The match names
/// every variant, so that a new one does not compile until it stands here too.
pub fn longest_like(message: &Message) -> Message {
    match message {
        Message::Hello(hello) => Message::Hello(*hello),
        Message::Estimate(_) => Message::Estimate(Estimate {
            sequence: u32::MAX,
            instant_us: u64::MAX,
            wavelength_mm: Some(f32::MAX),
            valid: true,
            confidence: f32::MAX,
            amplitude_lsb: f32::MAX,
            counted_mm: Some(f32::MAX),
            range: Range::T2,
            contact: Contact::StickSlip,
            velocity_um_s: i32::MIN,
            lag_um: Some(i32::MIN),
            gauges_used: u8::MAX,
            health: [GaugeHealth::Hum; GAUGES],
        }),
        Message::Motion(_) => Message::Motion(Motion {
            sequence: u32::MAX,
            instant_us: u64::MAX,
            position_um: i64::MIN,
            velocity_um_s: i32::MIN,
        }),
        Message::Gauges(_) => Message::Gauges(Gauges {
            first_sample: u32::MAX,
            instant_us: u64::MAX,
            position_um: i64::MIN,
            samples: [GaugeSample {
                codes: [u16::MAX; CHANNELS],
                travel_um: i16::MIN,
            }; GAUGE_BLOCK],
        }),
        Message::Status(_) => Message::Status(Status {
            uptime_us: u64::MAX,
            reset: ResetCause::Software,
            watchdog_resets: u32::MAX,
            stack_free_bytes: u32::MAX,
            peer: port([u32::MAX; 13]),
            console: port([u32::MAX; 13]),
            role: RoleCounters::Display(display_counters([u32::MAX; 14])),
        }),
        Message::Configure(_) => Message::Configure(Configure {
            replaces: Some(u32::MAX),
            configuration: longest_configuration(),
        }),
        Message::Configuration(_) => Message::Configuration(ConfigurationReport {
            refused: Some(Refusal {
                setting: Setting::ActuatorGain,
                index: u8::MAX,
                low: i64::MIN,
                high: i64::MIN,
            }),
            hash: u32::MAX,
            configuration: longest_configuration(),
        }),
        Message::Ping(_) => Message::Ping(Ping { sent_us: u64::MAX }),
        Message::Pong(_) => Message::Pong(Pong {
            sent_us: u64::MAX,
            received_us: u64::MAX,
            answered_us: u64::MAX,
        }),
        Message::Stop(_) => Message::Stop(Stop {
            reason: StopReason::Host,
        }),
        Message::Actuators(_) => Message::Actuators(Actuators {
            first: u8::MAX,
            actuators: [actuator((i16::MIN, i16::MIN, [u16::MAX; 4], true)); ACTUATOR_BLOCK],
        }),
        Message::Safety(_) => Message::Safety(Safety {
            instant_us: u64::MAX,
            state: DisplayState::Stopped(Trip::StackOverflow),
        }),
        Message::Stopped(_) => Message::Stopped(Stopped { cause: u8::MAX }),
        Message::Question(_) => Message::Question(Question::Capabilities),
        Message::Capabilities(_) => {
            Message::Capabilities(Capabilities::Sensor(SensorCapabilities {
                scan_rate_hz: u16::MAX,
                sample_rate_hz: u16::MAX,
                estimate_rate_hz: u16::MAX,
                full_scale_mv: u16::MAX,
                count_um: u16::MAX,
                shortest_um: u16::MAX,
                longest_um: u16::MAX,
                stream_ms: u16::MAX,
                ranges: [setting_range((u32::MAX, u32::MAX, true)); 8],
                ..sensor_capabilities()
            }))
        }
        Message::StreamGauges(_) => Message::StreamGauges(StreamGauges { for_ms: u16::MAX }),
        Message::Arm(_) => Message::Arm(Arm {
            instant_us: u64::MAX,
            state: ArmState::Stopped(Trip::StackOverflow),
        }),
        Message::Texture(_) => Message::Texture(Texture {
            sequence: u32::MAX,
            instant_us: u64::MAX,
            valid: true,
            partials: [Partial {
                ratio: u16::MAX,
                phase: u16::MAX,
            }; PARTIALS],
            repeating_percent: u8::MAX,
            bands: [u16::MAX; BANDS],
            friction: Some(Friction {
                mean_mn: u16::MAX,
                fluctuation_mn: u16::MAX,
            }),
        }),
    }
}

fn longest_configuration() -> Configuration {
    Configuration::Sensor(SensorConfiguration {
        method: Method::Crossings,
        window_ms: u16::MAX,
        counted_gauge: u8::MAX,
        gauges: u8::MAX,
        waves: u8::MAX,
        valid_percent: u8::MAX,
        force_channel: true,
        force_mn_per_v: u16::MAX,
        stiffness_n_per_m: u16::MAX,
        arm_full_scale_um_s: u32::MAX,
    })
}
