//! The sensor board.

use protocol::{Hold, Role};

use super::{
    BASE, COUNTED_MS, FADED, LINE_WITH_GAPS, PAST_STATUS_S, SENSOR_RESTARTED, STALE_S, WATCHDOG_MS,
};
use crate::scene::fault::Kind;
use crate::scene::fault::catalogue::{Class, Key, Lasts, Needs, Row, Sign};

const GAUGE: Key = Key {
    name: "gauge",
    meaning: "the gauge, 0 to 4",
    default: 2.0,
    low: 0.0,
    high: 4.0,
    whole: true,
    drawn: Some((0.0, 4.0)),
};

pub(super) static ROWS: [Row; 9] = [
    Row {
        kind: Kind::SensorBrownOut,
        name: "sensor-brown-out",
        meaning: "the sensor board's supply dips",
        injected: "as brown-out, of the sensor board",
        lasts: Lasts::For(0.02),
        class: Class::Sensor,
        signs: &[Sign::Greets(Role::Sensor)],
        seen_within_ms: Some(500.0),
        also: &SENSOR_RESTARTED,
        silences: &[Role::Sensor],
        again_within_ms: Some(1_000.0),
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
        signs: &[Sign::Reset(Role::Sensor)],
        seen_within_ms: WATCHDOG_MS,
        also: &SENSOR_RESTARTED,
        silences: &[Role::Sensor],
        again_within_ms: Some(1_350.0),
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
        signs: &[Sign::Reset(Role::Sensor)],
        seen_within_ms: WATCHDOG_MS,
        also: &SENSOR_RESTARTED,
        silences: &[Role::Sensor],
        again_within_ms: Some(1_350.0),
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
        signs: &[Sign::GaugeNotGood],
        seen_within_ms: Some(300.0),
        expected: "the gauge is called saturated or stuck and left out; the display drives on",
        watch_s: 1.4,
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
        signs: &[Sign::GaugeNotGood],
        seen_within_ms: Some(300.0),
        expected: "the gauge is called dead and left out; the display drives on",
        watch_s: 1.4,
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
        signs: &[Sign::NoValidEstimate],
        seen_within_ms: Some(300.0),
        also: &[
            Sign::Fading(Hold::Stale),
            FADED,
            Sign::Counted(Role::Display, "implausible"),
        ],
        again_within_ms: Some(600.0),
        expected: "no valid estimate; the display fades out when the last one is too old",
        watch_s: 1.4,
        ..BASE
    },
    Row {
        kind: Kind::AdcStopped,
        name: "adc-stopped",
        meaning: "the converter no longer converts",
        injected: "ADC3_CR2's ADON is cleared",
        lasts: Lasts::ForGood,
        class: Class::Sensor,
        signs: &[Sign::Reset(Role::Sensor)],
        seen_within_ms: WATCHDOG_MS,
        also: &SENSOR_RESTARTED,
        silences: &[Role::Sensor],
        again_within_ms: Some(1_350.0),
        expected: "the watchdog restarts the sensor; the display fades out, and drives again",
        watch_s: 1.4,
        ..BASE
    },
    Row {
        kind: Kind::UartOverrun,
        name: "uart-overrun",
        meaning: "nobody takes the bytes that the sensor hears",
        injected: "DMA1's clock is taken away (RCC_AHB1ENR, DMA1EN), and given back; what comes meanwhile is lost",
        lasts: Lasts::For(0.02),
        class: Class::Sensor,
        signs: &LINE_WITH_GAPS,
        seen_within_ms: COUNTED_MS,
        silences: &[Role::Sensor],
        expected: "lost or corrupt frames, overruns or line errors counted, no sample lost; the sensor hears and talks again",
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
        class: Class::Holds,
        expected: "nothing: the display goes by its own clock",
        watch_s: 0.5,
        ..BASE
    },
];
