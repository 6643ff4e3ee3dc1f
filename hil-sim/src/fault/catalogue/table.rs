//! The rows themselves.

use super::{Class, Key, Lasts, Needs, Row};
use crate::fault::Kind;

/// All kinds, in the order in which they are listed.
pub fn rows() -> &'static [Row] {
    &ROWS
}

/// All outputs at 0 V (the display's goal for any fault).
const SOON: Option<f64> = Some(20.0);
/// The same, for a stop that somebody asks for.
const AT_ONCE: Option<f64> = Some(5.0);
/// Until a watchdog that is no longer fed has bitten (0.5 s at most) and the board has started again
/// and had the time to drive, which it must not.
const PAST_WATCHDOG_S: f64 = 1.2;
/// Until the counters have come: once a second.
const PAST_STATUS_S: f64 = 1.1;
/// Until an estimate is too old (0.5 s), the stimulus has faded, and a fault of 0.7 s has ended.
const PAST_STALE_S: f64 = 0.9;
const STALE_S: f64 = 0.7;

const BASE: Row = Row {
    kind: Kind::Nothing,
    name: "",
    meaning: "",
    injected: "",
    lasts: Lasts::Once,
    keys: &[],
    needs: Needs::Boards,
    safe_within_ms: None,
    is_to_be_seen: true,
    class: Class::Stops,
    resets: 0,
    expected: "",
    watch_s: 0.25,
};
const LINK: Row = Row {
    needs: Needs::Nothing,
    class: Class::Fades,
    lasts: Lasts::For(STALE_S),
    watch_s: PAST_STALE_S,
    ..BASE
};
const FORGED: Row = Row {
    needs: Needs::Nothing,
    class: Class::Fades,
    lasts: Lasts::For(0.3),
    watch_s: 0.5,
    ..BASE
};
const DANGEROUS: Row = Row {
    safe_within_ms: SOON,
    ..BASE
};
const CHIP: Key = Key {
    name: "chip",
    meaning: "the chip on the bus, 0 to 3",
    default: 1.0,
    low: 0.0,
    high: 3.0,
    whole: true,
    drawn: Some((0.0, 3.0)),
};
const GAUGE: Key = Key {
    name: "gauge",
    meaning: "the gauge, 0 to 4",
    default: 2.0,
    low: 0.0,
    high: 4.0,
    whole: true,
    drawn: Some((0.0, 4.0)),
};

static ROWS: [Row; 46] = [
    Row {
        kind: Kind::Nothing,
        name: "nothing",
        meaning: "nothing breaks: a campaign's control",
        injected: "nothing",
        needs: Needs::Nothing,
        is_to_be_seen: false,
        class: Class::Holds,
        expected: "no sign of a fault, no change of the supervisor's state",
        watch_s: PAST_STATUS_S,
        ..BASE
    },
    Row {
        kind: Kind::PowerCycle,
        name: "power-cycle",
        meaning: "both boards and the converters lose their power, and get it back",
        injected: "both cores held, every peripheral at its power-on value, all RAM overwritten with \
                   random words, the DACs reset, CLR pulled low; after for_s they start",
        lasts: Lasts::For(0.005),
        class: Class::Fades,
        resets: 1,
        expected: "0 V at once; the boards start, and drive when there is a fresh estimate",
        watch_s: 0.7,
        ..DANGEROUS
    },
    Row {
        kind: Kind::LinkDown,
        name: "link-down",
        meaning: "the link between the boards is cut",
        injected: "no byte arrives, either way",
        expected: "drives on by the last λ for max_age_ms, then fades out; drives again with the link",
        ..LINK
    },
    Row {
        kind: Kind::LinkGarbage,
        name: "link-garbage",
        meaning: "noise on the link in place of what is said",
        injected: "random bytes at line rate in place of every byte, either way",
        expected: "corrupt and overlong frames counted; as link-down once the last λ is too old",
        watch_s: PAST_STATUS_S,
        ..LINK
    },
    Row {
        kind: Kind::LinkCorrupt,
        name: "link-corrupt",
        meaning: "bits on the link are turned",
        injected: "one bit of a share of the bytes, either way",
        lasts: Lasts::For(0.3),
        keys: &[Key {
            name: "share",
            meaning: "share of the bytes, 0 to 1",
            default: 0.05,
            low: 0.0,
            high: 1.0,
            whole: false,
            drawn: None,
        }],
        class: Class::Holds,
        expected: "corrupt frames counted and none followed; drives on as long as good ones come",
        watch_s: PAST_STATUS_S,
        ..LINK
    },
    Row {
        kind: Kind::LinkFlood,
        name: "link-flood",
        meaning: "the sensor, or somebody in its place, talks without a pause",
        injected: "the last estimate again and again, each with the next number and a right CRC, at \
                   line rate, in place of all that the sensor says",
        lasts: Lasts::For(0.3),
        expected: "fades out within 110 ms, counted; drives again when it is over",
        watch_s: 0.6,
        ..LINK
    },
    Row {
        kind: Kind::LinkReplay,
        name: "link-replay",
        meaning: "old frames come again in place of new ones",
        injected: "in place of each frame one of the back_ms before the fault, again and again, either way",
        keys: &[Key {
            name: "back_ms",
            meaning: "how much is replayed, in ms, 20 to 1000",
            default: 200.0,
            low: 20.0,
            high: 1_000.0,
            whole: false,
            drawn: None,
        }],
        expected: "late and repeated frames counted and not followed; as link-down once the last λ is \
                   too old",
        watch_s: PAST_STATUS_S,
        ..LINK
    },
    Row {
        kind: Kind::LinkLate,
        name: "link-late",
        meaning: "the network holds frames up",
        injected: "each frame arrives delay_ms later, either way; those sent after the fault are not \
                   held up and overtake",
        keys: &[Key {
            name: "delay_ms",
            meaning: "delay in ms, 1 to 10 000",
            default: 600.0,
            low: 1.0,
            high: 10_000.0,
            whole: false,
            drawn: None,
        }],
        expected: "drives on for max_age_ms, then fades out until frames come; overtaken ones are \
                   counted late and not followed",
        ..LINK
    },
    Row {
        kind: Kind::WireStuckLow,
        name: "wire-stuck-low",
        meaning: "the wire into the display is held low: a break that does not end",
        injected: "zero bytes at line rate, on the boards each with a framing error, in place of all \
                   that the sensor says",
        expected: "line errors counted; as link-down once the last λ is too old",
        watch_s: PAST_STATUS_S,
        ..LINK
    },
    Row {
        kind: Kind::EstimateOutOfRange,
        name: "estimate-out-of-range",
        meaning: "estimates with a λ that no surface has",
        injected: "wavelength_mm in each estimate on the wire, valid, with a right CRC",
        keys: &[Key {
            name: "wavelength_mm",
            meaning: "λ in mm, 0 to 1 000 000",
            default: 1_000.0,
            low: 0.0,
            high: 1e6,
            whole: false,
            drawn: None,
        }],
        expected: "none is followed; fades out after five in half a second; drives again half a second \
                   after the last",
        ..FORGED
    },
    Row {
        kind: Kind::EstimateNan,
        name: "estimate-nan",
        meaning: "estimates that are not numbers",
        injected: "λ, confidence and amplitude of each estimate on the wire are NaN, valid, with a \
                   right CRC",
        expected: "as estimate-out-of-range",
        ..FORGED
    },
    Row {
        kind: Kind::EstimateJumping,
        name: "estimate-jumping",
        meaning: "estimates that jump to and fro",
        injected: "λ of each estimate on the wire times factor and by factor in turn, with a right CRC",
        keys: &[Key {
            name: "factor",
            meaning: "factor, 1.6 to 100",
            default: 3.0,
            low: 1.6,
            high: 100.0,
            whole: false,
            drawn: None,
        }],
        expected: "none is followed, since none is confirmed by the next; as estimate-out-of-range",
        ..FORGED
    },
    Row {
        kind: Kind::EstimateContradictory,
        name: "estimate-contradictory",
        meaning: "estimates that contradict themselves",
        injected: "each estimate on the wire is called valid and has no λ, and no gauge took part, with \
                   a right CRC",
        expected: "as estimate-out-of-range",
        ..FORGED
    },
    Row {
        kind: Kind::SensorSilent,
        name: "sensor-silent",
        meaning: "the sensor says all but estimates",
        injected: "estimates are taken out of what the sensor says, and its frames numbered anew",
        expected: "as link-down",
        ..LINK
    },
    Row {
        kind: Kind::HandEncoderDead,
        name: "hand-encoder-dead",
        meaning: "the hand's encoder stands still while the hand moves",
        injected: "TIM4's counter stays at its last value",
        lasts: Lasts::For(3.5),
        needs: Needs::Nothing,
        class: Class::Fades,
        expected: "0 V within 19 ms, as for a hand at rest, which it can't be told from; called a \
                   contradiction if the arm is said to move for 3 s; drives again when it counts",
        watch_s: 3.8,
        ..DANGEROUS
    },
    Row {
        kind: Kind::HandEncoderJump,
        name: "hand-encoder-jump",
        meaning: "the hand's encoder jumps further than a hand moves",
        injected: "so many counts more in TIM4's counter from one tick on",
        keys: &[Key {
            name: "counts",
            meaning: "the jump in counts of 5 µm, 1 to 30 000",
            default: 2_000.0,
            low: 1.0,
            high: 30_000.0,
            whole: true,
            drawn: Some((500.0, 30_000.0)),
        }],
        needs: Needs::Nothing,
        expected: "stopped: hand encoder",
        ..DANGEROUS
    },
    Row {
        kind: Kind::EmergencyStop,
        name: "emergency-stop",
        meaning: "the emergency-stop button is pressed, or its wire breaks",
        injected: "D4 is released to its pull-up",
        lasts: Lasts::For(0.1),
        safe_within_ms: AT_ONCE,
        expected: "stopped: emergency stop; stays so when the button comes back",
        ..BASE
    },
    Row {
        kind: Kind::StopFromConsole,
        name: "stop-from-console",
        meaning: "a host on the console asks for a stop",
        injected: "Stop on USART3; the time counts from its first bit",
        safe_within_ms: AT_ONCE,
        expected: "stopped: operator",
        ..BASE
    },
    Row {
        kind: Kind::StopFromPeer,
        name: "stop-from-peer",
        meaning: "a host on the link asks for a stop",
        injected: "Stop on USART2 between two frames of the sensor, which are numbered anew; the time \
                   counts from at_s",
        needs: Needs::Nothing,
        safe_within_ms: AT_ONCE,
        expected: "stopped: host",
        ..BASE
    },
    Row {
        kind: Kind::WrongConfiguration,
        name: "wrong-configuration",
        meaning: "a host asks for settings that can't be",
        injected: "Configure on USART3 with an amplitude of 60 V, everything else as it is",
        class: Class::Holds,
        expected: "refused with the setting's name and range; nothing changes, it drives on",
        ..BASE
    },
    Row {
        kind: Kind::ConsoleFlood,
        name: "console-flood",
        meaning: "a host on the console talks without a pause",
        injected: "Pings on USART3 at line rate",
        lasts: Lasts::For(0.3),
        class: Class::Holds,
        expected: "drives on; what is not answered is counted",
        watch_s: PAST_STATUS_S,
        ..BASE
    },
    Row {
        kind: Kind::DacIgnoresWords,
        name: "dac-ignores-words",
        meaning: "a converter no longer takes words",
        injected: "the chip hears no frame and says nothing on SDO: its outputs stay as they are",
        lasts: Lasts::ForGood,
        keys: &[CHIP],
        expected: "readback differs; stopped: converter, by CLR, which the chip still obeys",
        ..DANGEROUS
    },
    Row {
        kind: Kind::DacPowerLost,
        name: "dac-power-lost",
        meaning: "a converter loses its power for a moment and its settings with it",
        injected: "the chip is reset to its power-on state",
        keys: &[CHIP],
        expected: "its own outputs at 0 V at once; readback differs; stopped: converter",
        ..DANGEROUS
    },
    Row {
        kind: Kind::DacAlarm,
        name: "dac-alarm",
        meaning: "a converter raises its alarm",
        injected: "the chip is too hot: its STATUS says so and it pulls ALMOUT (D3) low",
        lasts: Lasts::For(0.05),
        keys: &[CHIP],
        expected: "stopped: converter",
        ..DANGEROUS
    },
    Row {
        kind: Kind::LdacStuck,
        name: "ldac-stuck",
        meaning: "LDAC's wire is held high: the chips take words and don't play them",
        injected: "LDAC (D16) is high whatever TIM3 drives, at the chips and at the pin",
        lasts: Lasts::ForGood,
        expected: "stopped: transfer or converter",
        ..DANGEROUS
    },
    Row {
        kind: Kind::ClearStuckLow,
        name: "clear-stuck-low",
        meaning: "CLR's wire is at ground",
        injected: "CLR is low at the chips whatever the pin says",
        lasts: Lasts::ForGood,
        expected: "0 V at once; readback differs; stopped: converter",
        ..DANGEROUS
    },
    Row {
        kind: Kind::SpiStall,
        name: "spi-stall",
        meaning: "SPI1 sends no more",
        injected: "its clock is taken away (RCC_APB2ENR, SPI1EN)",
        lasts: Lasts::ForGood,
        expected: "stopped: transfer",
        ..DANGEROUS
    },
    Row {
        kind: Kind::DmaStall,
        name: "dma-stall",
        meaning: "DMA2 moves no more",
        injected: "its clock is taken away (RCC_AHB1ENR, DMA2EN)",
        lasts: Lasts::ForGood,
        expected: "stopped: transfer",
        ..DANGEROUS
    },
    Row {
        kind: Kind::TickStopped,
        name: "tick-stopped",
        meaning: "the output tick stops",
        injected: "TIM3_CR1 is written 0",
        lasts: Lasts::ForGood,
        resets: 1,
        expected: "CLR falls after four ticks, the watchdog bites; stopped: watchdog",
        watch_s: PAST_WATCHDOG_S,
        ..DANGEROUS
    },
    Row {
        kind: Kind::OutputTaskStall,
        name: "output-task-stall",
        meaning: "the output task never ends",
        injected: "its entry in RAM, by which its executor calls it, leads to an endless loop",
        resets: 1,
        expected: "CLR falls after four ticks, the watchdog bites; stopped: watchdog",
        watch_s: PAST_WATCHDOG_S,
        ..DANGEROUS
    },
    Row {
        kind: Kind::ThreadStall,
        name: "thread-stall",
        meaning: "a task of the thread never ends, so that nobody hears a Stop",
        injected: "the reporting task's entry in RAM leads to an endless loop",
        resets: 1,
        expected: "fades out within 20 ms, the watchdog bites; stopped: watchdog",
        watch_s: PAST_WATCHDOG_S,
        ..DANGEROUS
    },
    Row {
        kind: Kind::BoardHang,
        name: "board-hang",
        meaning: "the display's processor hangs",
        injected: "the output task's entry leads to an endless loop with interrupts disabled",
        resets: 1,
        expected: "CLR falls after four ticks, the watchdog bites; stopped: watchdog",
        watch_s: PAST_WATCHDOG_S,
        ..DANGEROUS
    },
    Row {
        kind: Kind::Panic,
        name: "panic",
        meaning: "the firmware panics",
        injected: "the output task's entry leads to core's panic for an index out of bounds",
        resets: 1,
        expected: "CLR falls; stopped: panic, also after the reset",
        watch_s: PAST_WATCHDOG_S,
        ..DANGEROUS
    },
    Row {
        kind: Kind::HardFault,
        name: "hard-fault",
        meaning: "the processor meets an instruction that is none",
        injected: "the output task's entry leads to UDF",
        resets: 1,
        expected: "CLR falls; stopped: fault, also after the reset",
        watch_s: PAST_WATCHDOG_S,
        ..DANGEROUS
    },
    Row {
        kind: Kind::StackOverflow,
        name: "stack-overflow",
        meaning: "a recursion without an end",
        injected: "the output task's entry leads to code that pushes registers and calls itself",
        resets: 1,
        expected: "CLR falls; stopped: stack overflow, also after the reset",
        watch_s: PAST_WATCHDOG_S,
        ..DANGEROUS
    },
    Row {
        kind: Kind::MemoryChanged,
        name: "memory-changed",
        meaning: "a bit of the settings in RAM turns",
        injected: "one bit of the amplitude, in one of the places where the output task holds the settings",
        keys: &[
            Key {
                name: "copy",
                meaning: "which of the places, from the lowest address on, 0 to 7; beyond the last it \
                          begins anew",
                default: 0.0,
                low: 0.0,
                high: 7.0,
                whole: true,
                drawn: Some((0.0, 7.0)),
            },
            Key {
                name: "bit",
                meaning: "the bit, 0 to 15",
                default: 12.0,
                low: 0.0,
                high: 15.0,
                whole: true,
                drawn: Some((0.0, 15.0)),
            },
        ],
        expected: "stopped: memory",
        ..DANGEROUS
    },
    Row {
        kind: Kind::BrownOut,
        name: "brown-out",
        meaning: "the display board's supply dips",
        injected: "as power-cycle, of the display's processor alone: the DACs keep their registers",
        lasts: Lasts::For(0.02),
        class: Class::Fades,
        resets: 1,
        expected: "CLR is pulled low at once; the board starts and drives when there is a fresh estimate",
        watch_s: 0.7,
        ..DANGEROUS
    },
    Row {
        kind: Kind::SensorBrownOut,
        name: "sensor-brown-out",
        meaning: "the sensor board's supply dips",
        injected: "as brown-out, of the sensor board",
        lasts: Lasts::For(0.02),
        class: Class::Sensor,
        expected: "the sensor greets anew; the display drives on, or fades until it hears from it",
        watch_s: PAST_STATUS_S,
        ..BASE
    },
    Row {
        kind: Kind::SensorHang,
        name: "sensor-hang",
        meaning: "the sensor's processor hangs",
        injected: "the sampling task's entry leads to an endless loop with interrupts disabled",
        class: Class::Sensor,
        expected: "the watchdog restarts the sensor; the display fades out after max_age_ms, and drives \
                   again",
        watch_s: 1.4,
        ..BASE
    },
    Row {
        kind: Kind::SensorPanic,
        name: "sensor-panic",
        meaning: "the sensor's firmware panics",
        injected: "the sampling task's entry leads to core's panic for an index out of bounds",
        class: Class::Sensor,
        expected: "as sensor-hang",
        watch_s: 1.4,
        ..BASE
    },
    Row {
        kind: Kind::GaugeOpen,
        name: "gauge-open",
        meaning: "a wire of a gauge's bridge breaks",
        injected: "the gauge's ADC pin goes to 3.3 V",
        lasts: Lasts::For(STALE_S),
        keys: &[GAUGE],
        needs: Needs::Nothing,
        class: Class::Sensor,
        expected: "the gauge is called saturated or stuck and left out; the display drives on",
        watch_s: PAST_STALE_S,
        ..BASE
    },
    Row {
        kind: Kind::GaugeShort,
        name: "gauge-short",
        meaning: "a gauge's bridge is shorted",
        injected: "the gauge's ADC pin stays at mid-rail",
        lasts: Lasts::For(STALE_S),
        keys: &[GAUGE],
        needs: Needs::Nothing,
        class: Class::Sensor,
        expected: "the gauge is called dead and left out; the display drives on",
        watch_s: PAST_STALE_S,
        ..BASE
    },
    Row {
        kind: Kind::AdcStuck,
        name: "adc-stuck",
        meaning: "the converter gives the same codes for ever",
        injected: "all six ADC pins stay at their last voltage",
        lasts: Lasts::For(STALE_S),
        needs: Needs::Nothing,
        class: Class::Sensor,
        expected: "no valid estimate; the display fades out when the last one is too old",
        watch_s: PAST_STALE_S,
        ..BASE
    },
    Row {
        kind: Kind::AdcStopped,
        name: "adc-stopped",
        meaning: "the converter no longer converts",
        injected: "ADC3_CR2's ADON is cleared",
        lasts: Lasts::ForGood,
        class: Class::Sensor,
        expected: "the watchdog restarts the sensor; the display fades out, and drives again",
        watch_s: 1.4,
        ..BASE
    },
    Row {
        kind: Kind::UartOverrun,
        name: "uart-overrun",
        meaning: "nobody takes the bytes that the sensor hears",
        injected: "DMA1's clock is taken away (RCC_AHB1ENR, DMA1EN), and given back",
        lasts: Lasts::For(0.02),
        class: Class::Sensor,
        expected: "overruns, line errors or corrupt frames counted; the sensor hears and talks again",
        watch_s: PAST_STATUS_S,
        ..BASE
    },
    Row {
        kind: Kind::ClockDrift,
        name: "clock-drift",
        meaning: "the sensor's quartz is off",
        injected: "the sensor board's clock runs faster by so much, from at_s on",
        lasts: Lasts::ForGood,
        keys: &[Key {
            name: "ppm",
            meaning: "in parts per million, −1000 to 1000",
            default: 200.0,
            low: -1_000.0,
            high: 1_000.0,
            whole: false,
            drawn: Some((-200.0, 200.0)),
        }],
        needs: Needs::Nothing,
        is_to_be_seen: false,
        class: Class::Holds,
        expected: "nothing: the display goes by its own clock",
        watch_s: 0.5,
        ..BASE
    },
];
