//! The kinds of faults.

/// What breaks; its [row](super::catalogue) in the catalogue says how, and what is expected then.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs, reason = "the catalogue's rows say what each of them is")]
pub enum Kind {
    Nothing,
    PowerCycle,
    // The link.
    LinkDown,
    LinkGarbage,
    LinkCorrupt,
    LinkFlood,
    LinkReplay,
    LinkLate,
    WireStuckLow,
    // What the sensor says.
    EstimateOutOfRange,
    EstimateNan,
    EstimateJumping,
    EstimateContradictory,
    SensorSilent,
    // The operator's hand and commands.
    HandEncoderDead,
    HandEncoderJump,
    EmergencyStop,
    StopFromConsole,
    StopFromPeer,
    WrongConfiguration,
    ConsoleFlood,
    // The converters and the way to them.
    DacIgnoresWords,
    DacPowerLost,
    DacAlarm,
    LdacStuck,
    ClearStuckLow,
    SpiStall,
    DmaStall,
    // The display board's processor.
    TickStopped,
    OutputTaskStall,
    ThreadStall,
    BoardHang,
    Panic,
    HardFault,
    StackOverflow,
    MemoryChanged,
    BrownOut,
    // The sensor board.
    SensorBrownOut,
    SensorHang,
    SensorPanic,
    GaugeOpen,
    GaugeShort,
    AdcStuck,
    AdcStopped,
    ArmEncoderDead,
    ArmEncoderJump,
    UartOverrun,
    ClockDrift,
}

impl Kind {
    /// Whether nothing that is said towards the display arrives while it lasts.
    pub fn cuts_wire(self) -> bool {
        matches!(self, Self::LinkDown | Self::WireStuckLow)
    }

    /// Whether it is of what the link brings, and shows by what arrives.
    pub fn is_on_link(self) -> bool {
        matches!(
            self,
            Self::LinkGarbage
                | Self::LinkCorrupt
                | Self::LinkFlood
                | Self::LinkReplay
                | Self::LinkLate
                | Self::EstimateOutOfRange
                | Self::EstimateNan
                | Self::EstimateJumping
                | Self::EstimateContradictory
        )
    }

    /// Whether it is of the arm's encoder, for which the sensor stops the arm for good.
    pub fn is_of_arm(self) -> bool {
        matches!(self, Self::ArmEncoderDead | Self::ArmEncoderJump)
    }

    /// Whether a host on the display's console does it.
    pub fn is_of_host(self) -> bool {
        matches!(
            self,
            Self::StopFromConsole | Self::WrongConfiguration | Self::ConsoleFlood
        )
    }
}
