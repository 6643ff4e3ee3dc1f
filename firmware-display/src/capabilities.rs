//! What a display board can do, as it tells who asks.

use protocol::actuators::{DEFAULT_PITCH_UM, FURTHEST_UM};
use protocol::{
    ACTUATORS, Capabilities, DisplayCapabilities, DisplayConfiguration, Mode, Rendering, UpdateRate,
};

use crate::limits::{MOST_ENERGY_V2, MOST_SLEW_V_PER_MS, MOST_STANDING_V};
use crate::{MICROMETRES_PER_COUNT, MOTION_RATE_HZ};

/// What the board can do.
pub const CAPABILITIES: Capabilities = Capabilities::Display(DisplayCapabilities {
    actuators: ACTUATORS as u8,
    pitch_um: DEFAULT_PITCH_UM,
    furthest_um: FURTHEST_UM as u16,
    // The last one's number, and one for the first.
    modes: Mode::Travelling as u8 + 1,
    renderings: Rendering::Texture as u8 + 1,
    update_rates_hz: [
        UpdateRate::Hz2000.hz() as u16,
        UpdateRate::Hz4000.hz() as u16,
    ],
    motion_rate_hz: MOTION_RATE_HZ as u16,
    count_um: MICROMETRES_PER_COUNT as u16,
    full_scale_mv: DisplayConfiguration::MOST_AMPLITUDE_MV,
    slew_mv_per_ms: MOST_SLEW_V_PER_MS as u16 * 1_000,
    energy_v2: MOST_ENERGY_V2 as u16,
    standing_mv: (MOST_STANDING_V * 1_000.0) as u16,
    ranges: DisplayConfiguration::RANGES,
});

#[cfg(test)]
mod tests {
    use protocol::Setting;

    use super::*;

    #[test]
    fn the_capabilities_are_those_of_the_limits_and_of_the_settings() {
        let Capabilities::Display(display) = CAPABILITIES else {
            panic!("it is a display's");
        };
        assert_eq!(
            (display.actuators, display.modes, display.renderings),
            (50, 2, 3)
        );
        assert_eq!(display.update_rates_hz, [2_000, 4_000]);
        assert_eq!(
            (display.slew_mv_per_ms, display.standing_mv),
            (10_000, 3_500)
        );
        let amplitude = CAPABILITIES
            .ranges()
            .iter()
            .find(|range| range.setting == Setting::AmplitudeMv);
        let most = amplitude.map(|range| range.high);
        assert_eq!(most, Some(display.full_scale_mv.into()));
    }
}
