//! Messages for tests, and what carries them: arbitrary ones, the longest and a sample of each kind.
#![allow(
    dead_code,
    unused_imports,
    reason = "each test binary uses its own part of this module"
)]

mod longest;
mod samples;

use proptest::prelude::*;
use protocol::texture::{BANDS, PARTIALS};
use protocol::*;

pub use longest::longest_like;
pub use samples::samples;

/// A compatible Hello that asks for an answer.
pub fn hello() -> Hello {
    Hello::new(Role::Sensor, "STM32F429ZI", [0, 1, 0]).asking(true)
}

/// A Hello of a later protocol version.
pub fn foreign_hello() -> Hello {
    Hello {
        protocol: (PROTOCOL_VERSION + 1).to_le_bytes(),
        ..hello()
    }
}

/// A sender that has been greeted and whose own Hello is still to be said.
pub fn open_sender() -> Sender {
    let mut sender = Sender::new(hello());
    sender.on_greeting(false);
    sender
}

/// One frame's bytes, the closing 0x00 included.
pub fn frame_of(sender: &mut Sender, message: &Message) -> Vec<u8> {
    let mut out = [0; MAX_FRAME];
    sender
        .encode(message, &mut out)
        .expect("the sender is open")
        .to_vec()
}

/// The frame numbered `sequence` around any payload.
pub fn raw_frame(sequence: u16, payload: &[u8]) -> Vec<u8> {
    let mut out = [0; MAX_FRAME];
    frame::encode_payload(sequence, payload, &mut out)
        .expect("the payload fits")
        .to_vec()
}

/// The frame numbered `sequence`, of a message.
pub fn numbered(sequence: u16, message: &Message) -> Vec<u8> {
    let mut out = [0; MAX_FRAME];
    frame::encode(sequence, message, &mut out)
        .expect("every message fits")
        .to_vec()
}

/// Everything a receiver hands on for these bytes.
pub fn events(receiver: &mut Receiver, bytes: &[u8]) -> Vec<Event> {
    let mut events = Vec::new();
    receiver.receive(bytes, |event| events.push(event));
    events
}

/// A receiver that has heard a compatible Hello in frame 0.
pub fn greeted_receiver() -> Receiver {
    let mut receiver = Receiver::new();
    let greeting = events(&mut receiver, &numbered(0, &Message::Hello(hello())));
    assert_eq!(greeting, [Event::Greeted(hello())]);
    receiver
}

/// Any message, its floats finite.
pub fn message() -> impl Strategy<Value = Message> {
    prop_oneof![any_hello().prop_map(Message::Hello), content(),]
}

/// Any message but a Hello, its floats finite.
pub fn content() -> impl Strategy<Value = Message> {
    prop_oneof![
        estimate().prop_map(Message::Estimate),
        motion().prop_map(Message::Motion),
        gauges().prop_map(Message::Gauges),
        status().prop_map(Message::Status),
        (any::<Option<u32>>(), configuration()).prop_map(|(replaces, configuration)| {
            Message::Configure(Configure {
                replaces,
                configuration,
            })
        }),
        (
            proptest::option::of(refusal()),
            any::<u32>(),
            configuration()
        )
            .prop_map(|(refused, hash, configuration)| {
                Message::Configuration(ConfigurationReport {
                    refused,
                    hash,
                    configuration,
                })
            }),
        any::<u64>().prop_map(|sent_us| Message::Ping(Ping { sent_us })),
        any::<[u64; 3]>().prop_map(|[sent_us, received_us, answered_us]| {
            Message::Pong(Pong {
                sent_us,
                received_us,
                answered_us,
            })
        }),
        prop_oneof![Just(StopReason::Operator), Just(StopReason::Host)]
            .prop_map(|reason| Message::Stop(Stop { reason })),
        any::<u8>().prop_map(|cause| Message::Stopped(Stopped { cause })),
        (
            any::<u8>(),
            any::<[(i16, i16, [u16; 4], bool); ACTUATOR_BLOCK]>()
        )
            .prop_map(|(first, actuators)| {
                Message::Actuators(Actuators {
                    first,
                    actuators: actuators.map(actuator),
                })
            }),
        (any::<u64>(), state())
            .prop_map(|(instant_us, state)| Message::Safety(Safety { instant_us, state })),
        prop_oneof![Just(Question::Configuration), Just(Question::Capabilities)]
            .prop_map(Message::Question),
        capabilities().prop_map(Message::Capabilities),
        any::<u16>().prop_map(|for_ms| Message::StreamGauges(StreamGauges { for_ms })),
        (any::<u64>(), arm_state())
            .prop_map(|(instant_us, state)| Message::Arm(Arm { instant_us, state })),
        texture().prop_map(Message::Texture),
    ]
}

/// Any Hello of this build.
pub fn any_hello() -> impl Strategy<Value = Hello> {
    (
        prop_oneof![Just(Role::Sensor), Just(Role::Display), Just(Role::Host)],
        "[ -~]{0,20}",
        any::<[u8; 3]>(),
        any::<bool>(),
    )
        .prop_map(|(role, chip, version, asks)| Hello::new(role, &chip, version).asking(asks))
}

/// Every [`Method`], in the wire's order.
pub const METHODS: [Method; 4] = [
    Method::Spectrum,
    Method::Counting,
    Method::AdaptedCounting,
    Method::Crossings,
];
/// Every [`Contact`], in the wire's order.
pub const CONTACTS: [Contact; 4] = [
    Contact::Unknown,
    Contact::Slip,
    Contact::Stick,
    Contact::StickSlip,
];
/// Every [`GaugeHealth`], in the wire's order.
pub const HEALTHS: [GaugeHealth; 6] = [
    GaugeHealth::Good,
    GaugeHealth::Dead,
    GaugeHealth::Stuck,
    GaugeHealth::Saturated,
    GaugeHealth::Noisy,
    GaugeHealth::Hum,
];

/// Every [`Rendering`], in the wire's order.
pub const RENDERINGS: [Rendering; 3] =
    [Rendering::Fundamental, Rendering::Shape, Rendering::Texture];

/// Every [`Setting`], in the wire's order.
pub const SETTINGS: [Setting; 26] = [
    Setting::Role,
    Setting::WindowMs,
    Setting::CountedGauge,
    Setting::Gauges,
    Setting::Waves,
    Setting::ValidPercent,
    Setting::ForceScale,
    Setting::Stiffness,
    Setting::ArmFullScale,
    Setting::MaxAgeMs,
    Setting::FadeInMs,
    Setting::FadeOutMs,
    Setting::GlideMs,
    Setting::AmplitudeMv,
    Setting::ReferenceLsb,
    Setting::ReferenceMn,
    Setting::FullDriveS,
    Setting::Actuators,
    Setting::ActuatorsFirst,
    Setting::ActuatorX,
    Setting::ActuatorY,
    Setting::ActuatorGain,
    Setting::ActuatorResonance,
    Setting::ActuatorDamping,
    Setting::Replaces,
    Setting::Rendering,
];

fn finite() -> impl Strategy<Value = f32> {
    proptest::num::f32::NORMAL | proptest::num::f32::ZERO | proptest::num::f32::SUBNORMAL
}

fn estimate() -> impl Strategy<Value = Estimate> {
    (
        any::<(u32, u64, bool, u8, i32, Option<i32>)>(),
        [
            proptest::option::of(finite()),
            proptest::option::of(finite()),
        ],
        [finite(), finite()],
        proptest::sample::select(vec![Range::T1, Range::T2]),
        proptest::sample::select(CONTACTS.to_vec()),
        proptest::array::uniform5(proptest::sample::select(HEALTHS.to_vec())),
    )
        .prop_map(
            |(
                (sequence, instant_us, valid, gauges_used, velocity_um_s, lag_um),
                [wavelength_mm, counted_mm],
                [confidence, amplitude_lsb],
                range,
                contact,
                health,
            )| {
                Estimate {
                    sequence,
                    instant_us,
                    wavelength_mm,
                    valid,
                    confidence,
                    amplitude_lsb,
                    counted_mm,
                    range,
                    contact,
                    velocity_um_s,
                    lag_um,
                    gauges_used,
                    health,
                }
            },
        )
}

fn texture() -> impl Strategy<Value = Texture> {
    (
        any::<(u32, u64, bool, u8, [u16; BANDS])>(),
        any::<[(u16, u16); PARTIALS]>(),
        any::<Option<(u16, u16)>>(),
    )
        .prop_map(
            |((sequence, instant_us, valid, repeating_percent, bands), partials, friction)| {
                Texture {
                    sequence,
                    instant_us,
                    valid,
                    partials: partials.map(|(ratio, phase)| Partial { ratio, phase }),
                    repeating_percent,
                    bands,
                    friction: friction.map(|(mean_mn, fluctuation_mn)| Friction {
                        mean_mn,
                        fluctuation_mn,
                    }),
                }
            },
        )
}

fn motion() -> impl Strategy<Value = Motion> {
    any::<(u32, u64, i64, i32)>().prop_map(|(sequence, instant_us, position_um, velocity_um_s)| {
        Motion {
            sequence,
            instant_us,
            position_um,
            velocity_um_s,
        }
    })
}

fn gauges() -> impl Strategy<Value = Gauges> {
    any::<(u32, u64, i64, [([u16; CHANNELS], i16); GAUGE_BLOCK])>().prop_map(
        |(first_sample, instant_us, position_um, samples)| Gauges {
            first_sample,
            instant_us,
            position_um,
            samples: samples.map(|(codes, travel_um)| GaugeSample { codes, travel_um }),
        },
    )
}

/// Port counters from thirteen numbers, in their order.
pub fn port(n: [u32; 13]) -> PortCounters {
    PortCounters {
        sent: n[0],
        dropped: n[1],
        received: n[2],
        lost: n[3],
        corrupt: n[4],
        overlong: n[5],
        late: n[6],
        duplicated: n[7],
        malformed: n[8],
        foreign: n[9],
        unheralded: n[10],
        overruns: n[11],
        line_errors: n[12],
    }
}

fn status() -> impl Strategy<Value = Status> {
    let role = prop_oneof![
        any::<[u32; 6]>().prop_map(|n| RoleCounters::Sensor(sensor_counters(n))),
        any::<[u32; 14]>().prop_map(|n| RoleCounters::Display(display_counters(n))),
    ];
    let reset = prop_oneof![
        Just(ResetCause::Power),
        Just(ResetCause::Pin),
        Just(ResetCause::Watchdog),
        Just(ResetCause::Software)
    ];
    (any::<(u64, [u32; 2], [u32; 13], [u32; 13])>(), reset, role).prop_map(
        |((uptime_us, [watchdog_resets, stack_free_bytes], peer, console), reset, role)| Status {
            uptime_us,
            reset,
            watchdog_resets,
            stack_free_bytes,
            peer: port(peer),
            console: port(console),
            role,
        },
    )
}

/// Sensor counters from six numbers, in their order, and the longest end.
pub fn sensor_counters(n: [u32; 6]) -> SensorCounters {
    SensorCounters {
        samples: n[0],
        adc_overruns: n[1],
        dma_overruns: n[2],
        deadline_misses: n[3],
        estimates: n[4],
        motions: n[5],
        stopped: Some(Trip::Operator),
    }
}

/// Display counters from fourteen numbers, in their order, and the longest state.
pub fn display_counters(n: [u32; 14]) -> DisplayCounters {
    DisplayCounters {
        ticks: n[0],
        updates: n[1],
        deadline_misses: n[2],
        estimates: n[3],
        refused_estimates: n[4],
        fades: n[5],
        spi_errors: n[6],
        implausible: n[7],
        flooded: n[8],
        encoder_jumps: n[9],
        converter_faults: n[10],
        clears: n[11],
        unheard: n[12],
        changes: n[13],
        state: DisplayState::Stopped(Trip::EmergencyStop),
    }
}

fn configuration() -> impl Strategy<Value = Configuration> {
    prop_oneof![
        (
            proptest::sample::select(METHODS.to_vec()),
            any::<([u16; 3], [u8; 4], bool, u32)>()
        )
            .prop_map(
                |(
                    method,
                    (
                        [window_ms, force_mn_per_v, stiffness_n_per_m],
                        [counted_gauge, gauges, waves, valid_percent],
                        force_channel,
                        arm_full_scale_um_s,
                    ),
                )| {
                    Configuration::Sensor(SensorConfiguration {
                        method,
                        window_ms,
                        counted_gauge,
                        gauges,
                        waves,
                        valid_percent,
                        force_channel,
                        force_mn_per_v,
                        stiffness_n_per_m,
                        arm_full_scale_um_s,
                    })
                }
            ),
        (
            prop_oneof![Just(Mode::Uniform), Just(Mode::Travelling)],
            proptest::sample::select(RENDERINGS.to_vec()),
            prop_oneof![Just(UpdateRate::Hz2000), Just(UpdateRate::Hz4000)],
            any::<([u16; 8], u32)>()
        )
            .prop_map(
                |(
                    mode,
                    rendering,
                    update_rate,
                    (
                        [
                            max_age_ms,
                            fade_in_ms,
                            fade_out_ms,
                            glide_ms,
                            amplitude_mv,
                            reference_lsb,
                            reference_mn,
                            full_drive_s,
                        ],
                        actuators,
                    ),
                )| {
                    Configuration::Display(DisplayConfiguration {
                        mode,
                        rendering,
                        update_rate,
                        max_age_ms,
                        fade_in_ms,
                        fade_out_ms,
                        glide_ms,
                        amplitude_mv,
                        reference_lsb,
                        reference_mn,
                        full_drive_s,
                        actuators,
                    })
                }
            ),
    ]
}

fn refusal() -> impl Strategy<Value = Refusal> {
    let setting = proptest::sample::select(SETTINGS.to_vec());
    (setting, any::<(u8, i64, i64)>()).prop_map(|(setting, (index, low, high))| Refusal {
        setting,
        index,
        low,
        high,
    })
}

fn actuator((x_um, y_um, numbers, inverted): (i16, i16, [u16; 4], bool)) -> Actuator {
    let [gain_q15, phase, resonance_dhz, damping_percent] = numbers;
    Actuator {
        x_um,
        y_um,
        gain_q15,
        phase,
        inverted,
        resonance_dhz,
        damping_percent,
    }
}

/// Capabilities of a sensor.
pub fn sensor_capabilities() -> SensorCapabilities {
    SensorCapabilities {
        gauges: GAUGES as u8,
        channels: CHANNELS as u8,
        scan_rate_hz: 4_000,
        sample_rate_hz: 1_000,
        estimate_rate_hz: 100,
        full_scale_mv: 3_300,
        count_um: 5,
        shortest_um: 600,
        longest_um: 8_000,
        methods: METHODS.len() as u8,
        stream_ms: StreamGauges::LONGEST_MS,
        ranges: SensorConfiguration::RANGES,
    }
}

/// Capabilities of a display.
pub fn display_capabilities() -> DisplayCapabilities {
    DisplayCapabilities {
        actuators: ACTUATORS as u8,
        pitch_um: 1_500,
        furthest_um: 20_000,
        modes: 2,
        renderings: 3,
        update_rates_hz: [2_000, 4_000],
        motion_rate_hz: 500,
        count_um: 5,
        full_scale_mv: 5_000,
        slew_mv_per_ms: 10_000,
        energy_v2: 20,
        standing_mv: 3_500,
        ranges: DisplayConfiguration::RANGES,
    }
}

/// A range of a setting whose number on the wire is the longest.
pub fn setting_range((low, high, or_zero): (u32, u32, bool)) -> SettingRange {
    SettingRange {
        setting: Setting::Replaces,
        low,
        high,
        or_zero,
    }
}

fn capabilities() -> impl Strategy<Value = Capabilities> {
    prop_oneof![
        any::<([u8; 3], [u16; 8], [(u32, u32, bool); 8])>().prop_map(
            |([gauges, channels, methods], n, ranges)| {
                Capabilities::Sensor(SensorCapabilities {
                    gauges,
                    channels,
                    scan_rate_hz: n[0],
                    sample_rate_hz: n[1],
                    estimate_rate_hz: n[2],
                    full_scale_mv: n[3],
                    count_um: n[4],
                    shortest_um: n[5],
                    longest_um: n[6],
                    methods,
                    stream_ms: n[7],
                    ranges: ranges.map(setting_range),
                })
            }
        ),
        any::<([u8; 3], [u16; 8], [u16; 2], [(u32, u32, bool); 8])>().prop_map(
            |([actuators, modes, renderings], n, update_rates_hz, ranges)| {
                Capabilities::Display(DisplayCapabilities {
                    actuators,
                    pitch_um: n[0],
                    furthest_um: n[1],
                    modes,
                    renderings,
                    update_rates_hz,
                    motion_rate_hz: n[2],
                    count_um: n[3],
                    full_scale_mv: n[4],
                    slew_mv_per_ms: n[5],
                    energy_v2: n[6],
                    standing_mv: n[7],
                    ranges: ranges.map(setting_range),
                })
            }
        ),
    ]
}

fn arm_state() -> impl Strategy<Value = ArmState> {
    prop_oneof![
        Just(ArmState::Resting),
        Just(ArmState::Following),
        proptest::sample::select(Trip::ALL.to_vec()).prop_map(ArmState::Stopped),
    ]
}

fn state() -> impl Strategy<Value = DisplayState> {
    prop_oneof![
        Just(DisplayState::Boot),
        Just(DisplayState::Ready),
        Just(DisplayState::Driving),
        proptest::sample::select(Hold::ALL.to_vec()).prop_map(DisplayState::Fading),
        proptest::sample::select(Trip::ALL.to_vec()).prop_map(DisplayState::Stopped),
    ]
}
