//! What a sensor board can do, as it tells who asks.

use protocol::{
    CHANNELS, Capabilities, GAUGES, Method, SensorCapabilities, SensorConfiguration, StreamGauges,
};

use crate::spectrum::{LONGEST_MM, SHORTEST_MM};
use crate::{ESTIMATE_RATE_HZ, MICROMETRES_PER_COUNT, SAMPLE_RATE_HZ, SCAN_RATE_HZ};

/// The ADC's reference, in mV.
const FULL_SCALE_MV: u16 = 3_300;

/// What the board can do.
pub const CAPABILITIES: Capabilities = Capabilities::Sensor(SensorCapabilities {
    gauges: GAUGES as u8,
    channels: CHANNELS as u8,
    scan_rate_hz: SCAN_RATE_HZ as u16,
    sample_rate_hz: SAMPLE_RATE_HZ as u16,
    estimate_rate_hz: ESTIMATE_RATE_HZ as u16,
    full_scale_mv: FULL_SCALE_MV,
    count_um: MICROMETRES_PER_COUNT as u16,
    shortest_um: (SHORTEST_MM * 1_000.0 + 0.5) as u16,
    longest_um: (LONGEST_MM * 1_000.0 + 0.5) as u16,
    // The last one's number, and one for the first.
    methods: Method::Crossings as u8 + 1,
    stream_ms: StreamGauges::LONGEST_MS,
    ranges: SensorConfiguration::RANGES,
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_capabilities_are_those_of_the_paper_and_of_the_estimator() {
        let Capabilities::Sensor(sensor) = CAPABILITIES else {
            panic!("it is a sensor's");
        };
        assert_eq!((sensor.gauges, sensor.channels, sensor.methods), (5, 6, 4));
        assert_eq!((sensor.scan_rate_hz, sensor.sample_rate_hz), (4_000, 1_000));
        assert_eq!((sensor.shortest_um, sensor.longest_um), (600, 8_000));
        for range in CAPABILITIES.ranges() {
            assert_eq!(
                (range.check(range.low), range.check(range.high)),
                (Ok(()), Ok(()))
            );
            assert!(range.check(range.high + 1).is_err());
        }
    }
}
