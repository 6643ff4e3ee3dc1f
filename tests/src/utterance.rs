//! Whatever a board might say, drawn from a seed.

use protocol::{
    ACTUATOR_BLOCK, Actuator, Actuators, CHANNELS, Configuration, ConfigurationReport, Configure,
    Contact, DisplayConfiguration, DisplayCounters, DisplayState, Estimate, GAUGES, GaugeHealth,
    GaugeSample, Gauges, Hold, Message, Method, Mode, Motion, Pong, PortCounters, Range, Refusal,
    Rendering, ResetCause, Role, RoleCounters, Safety, SensorConfiguration, SensorCounters,
    Setting, Status, Stop, StopReason, Trip, UpdateRate,
};

/// Says things, each different.
pub struct Speaker {
    state: u64,
    sequence: u32,
}

impl Speaker {
    /// Equal seeds say the same.
    pub const fn new(seed: u64) -> Self {
        Self {
            state: seed,
            sequence: 0,
        }
    }

    /// Knuth's MMIX generator, its better bits.
    fn draw(&mut self) -> u64 {
        self.state = self
            .state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        self.state >> 16
    }

    fn below(&mut self, count: usize) -> usize {
        (self.draw() % count as u64) as usize
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }

    fn u32(&mut self) -> u32 {
        self.draw() as u32
    }

    fn i32(&mut self) -> i32 {
        self.u32().cast_signed()
    }

    fn chance(&mut self) -> bool {
        self.below(2) == 0
    }

    /// Of any size, above 0 and finite.
    fn f32(&mut self) -> f32 {
        f32::from_bits(self.u32() % f32::INFINITY.to_bits())
    }

    fn some<T>(&mut self, draw: impl FnOnce(&mut Self) -> T) -> Option<T> {
        self.chance().then(|| draw(self))
    }

    /// Anything that the board of `role` may say, numbered without a gap.
    pub fn message(&mut self, role: Role) -> Message {
        let kinds: &[fn(&mut Self) -> Message] = match role {
            Role::Display => &[
                Self::motion,
                Self::safety,
                Self::display_status,
                Self::display_report,
                Self::pong,
            ],
            Role::Sensor | Role::Host => &[
                Self::estimate,
                Self::sensor_status,
                Self::sensor_report,
                Self::pong,
            ],
        };
        let kind = self.below(kinds.len());
        kinds[kind](self)
    }

    /// What no board of this version says.
    pub fn oddity(&mut self) -> Message {
        match self.below(3) {
            0 => Message::Stop(Stop {
                reason: self.one(&[StopReason::Operator, StopReason::Host]),
            }),
            1 => Message::Actuators(Actuators {
                first: 10,
                actuators: [Actuator::at(3, -4); ACTUATOR_BLOCK],
            }),
            _ => Message::Configure(Configure::anyway(Configuration::Sensor(
                self.sensor_configuration(),
            ))),
        }
    }

    /// An estimate.
    pub fn estimate(&mut self) -> Message {
        let sequence = self.sequence;
        self.sequence += 1;
        Message::Estimate(Estimate {
            sequence,
            instant_us: self.draw(),
            wavelength_mm: self.some(Self::f32),
            valid: self.chance(),
            confidence: self.f32(),
            amplitude_lsb: self.f32(),
            counted_mm: self.some(Self::f32),
            range: self.one(&[Range::T1, Range::T2]),
            contact: self.one(&[
                Contact::Unknown,
                Contact::Slip,
                Contact::Stick,
                Contact::StickSlip,
            ]),
            velocity_um_s: self.i32(),
            lag_um: self.some(Self::i32),
            gauges_used: self.u32() as u8,
            health: [(); GAUGES].map(|()| {
                self.one(&[
                    GaugeHealth::Good,
                    GaugeHealth::Dead,
                    GaugeHealth::Stuck,
                    GaugeHealth::Saturated,
                    GaugeHealth::Noisy,
                    GaugeHealth::Hum,
                ])
            }),
        })
    }

    /// A motion.
    pub fn motion(&mut self) -> Message {
        let sequence = self.sequence;
        self.sequence += 1;
        Message::Motion(Motion {
            sequence,
            instant_us: self.draw(),
            position_um: self.draw().cast_signed() - (1 << 47),
            velocity_um_s: self.i32(),
        })
    }

    /// A block of samples from `first_sample` on, taken a millisecond apart.
    pub fn gauges(&mut self, first_sample: u32) -> Message {
        Message::Gauges(Gauges {
            first_sample,
            instant_us: 5_000_000 + u64::from(first_sample) * 1_000,
            position_um: i64::from(self.i32()),
            samples: std::array::from_fn(|_| GaugeSample {
                codes: [(); CHANNELS].map(|()| self.u32() as u16),
                travel_um: self.u32() as i16,
            }),
        })
    }

    fn pong(&mut self) -> Message {
        let received_us = self.draw();
        Message::Pong(Pong {
            sent_us: self.draw(),
            received_us,
            answered_us: received_us + 20,
        })
    }

    fn safety(&mut self) -> Message {
        Message::Safety(Safety {
            instant_us: self.draw(),
            state: self.display_state(),
        })
    }

    fn display_state(&mut self) -> DisplayState {
        match self.below(5) {
            0 => DisplayState::Boot,
            1 => DisplayState::Ready,
            2 => DisplayState::Driving,
            3 => DisplayState::Fading(self.one(&Hold::ALL)),
            _ => DisplayState::Stopped(self.one(&Trip::ALL)),
        }
    }

    fn port(&mut self) -> PortCounters {
        PortCounters {
            sent: self.u32(),
            dropped: self.u32(),
            received: self.u32(),
            lost: self.u32(),
            corrupt: self.u32(),
            overlong: self.u32(),
            late: self.u32(),
            duplicated: self.u32(),
            malformed: self.u32(),
            foreign: self.u32(),
            unheralded: self.u32(),
            overruns: self.u32(),
            line_errors: self.u32(),
        }
    }

    fn status(&mut self, role: RoleCounters) -> Message {
        self.sequence += 1;
        Message::Status(Status {
            // Going on: a clock that goes back is a restart.
            uptime_us: u64::from(self.sequence) * 1_000_000,
            reset: self.one(&[
                ResetCause::Power,
                ResetCause::Pin,
                ResetCause::Watchdog,
                ResetCause::Software,
            ]),
            watchdog_resets: self.u32(),
            stack_free_bytes: self.sequence,
            peer: self.port(),
            console: self.port(),
            role,
        })
    }

    fn sensor_status(&mut self) -> Message {
        let sensor = SensorCounters {
            samples: self.u32(),
            adc_overruns: self.u32(),
            dma_overruns: self.u32(),
            deadline_misses: self.u32(),
            estimates: self.u32(),
            motions: self.u32(),
            stopped: None,
        };
        // Not an estimate's number.
        let sequence = self.sequence;
        let status = self.status(RoleCounters::Sensor(sensor));
        self.sequence = sequence;
        status
    }

    fn display_status(&mut self) -> Message {
        let display = DisplayCounters {
            ticks: self.u32(),
            updates: self.u32(),
            deadline_misses: self.u32(),
            estimates: self.u32(),
            refused_estimates: self.u32(),
            fades: self.u32(),
            spi_errors: self.u32(),
            implausible: self.u32(),
            flooded: self.u32(),
            encoder_jumps: self.u32(),
            converter_faults: self.u32(),
            clears: self.u32(),
            unheard: self.u32(),
            changes: self.u32(),
            state: self.display_state(),
        };
        let sequence = self.sequence;
        let status = self.status(RoleCounters::Display(display));
        self.sequence = sequence;
        status
    }

    fn sensor_configuration(&mut self) -> SensorConfiguration {
        SensorConfiguration {
            method: self.one(&[
                Method::Spectrum,
                Method::Counting,
                Method::AdaptedCounting,
                Method::Crossings,
            ]),
            window_ms: self.u32() as u16,
            counted_gauge: self.u32() as u8,
            gauges: self.u32() as u8,
            waves: self.u32() as u8,
            valid_percent: self.u32() as u8,
            force_channel: self.chance(),
            force_mn_per_v: self.u32() as u16,
            stiffness_n_per_m: self.u32() as u16,
            arm_full_scale_um_s: self.u32(),
        }
    }

    fn report(&mut self, configuration: Configuration) -> Message {
        Message::Configuration(ConfigurationReport {
            refused: self.some(|speaker| Refusal {
                setting: speaker.one(&[Setting::Role, Setting::WindowMs, Setting::ActuatorGain]),
                index: speaker.u32() as u8,
                low: i64::from(speaker.i32()),
                high: i64::MAX,
            }),
            hash: self.u32(),
            configuration,
        })
    }

    fn sensor_report(&mut self) -> Message {
        let configuration = self.sensor_configuration();
        self.report(Configuration::Sensor(configuration))
    }

    fn display_report(&mut self) -> Message {
        let configuration = DisplayConfiguration {
            mode: self.one(&[Mode::Uniform, Mode::Travelling]),
            rendering: self.one(&[Rendering::Fundamental, Rendering::Shape, Rendering::Texture]),
            update_rate: self.one(&[UpdateRate::Hz2000, UpdateRate::Hz4000]),
            max_age_ms: self.u32() as u16,
            fade_in_ms: self.u32() as u16,
            fade_out_ms: self.u32() as u16,
            glide_ms: self.u32() as u16,
            amplitude_mv: self.u32() as u16,
            reference_lsb: self.u32() as u16,
            reference_mn: self.u32() as u16,
            full_drive_s: self.u32() as u16,
            actuators: self.u32(),
        };
        self.report(Configuration::Display(configuration))
    }
}
