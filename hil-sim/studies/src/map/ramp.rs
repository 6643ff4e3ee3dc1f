//! Colours for quantities: even steps for the eye, ordered in grey and for the colour-blind too.

/// Colours told apart by a picture; neighbours differ by less than the eye sees.
pub const LEVELS: usize = 64;

/// A row of colours, light where things are good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ramp {
    /// For what should be small: light yellow over red to black.
    Ember,
    /// For what should be large: dark violet over green to yellow.
    Meadow,
}

/// Matplotlib's magma, backwards (CC0).
const EMBER: [u32; 10] = [
    0xfcfdbf, 0xfeca8d, 0xfd9668, 0xf1605d, 0xcd4071, 0x9e2f7f, 0x721f81, 0x440f76, 0x180f3d,
    0x000004,
];
/// Matplotlib's viridis (CC0).
const MEADOW: [u32; 10] = [
    0x440154, 0x482878, 0x3e4989, 0x31688e, 0x26828e, 0x1f9e89, 0x35b779, 0x6ece58, 0xb5de2b,
    0xfde725,
];

/// The level of a share of the way along a ramp; what lies beyond an end is at it.
pub fn level(share: f64) -> usize {
    ((share * LEVELS as f64).max(0.0) as usize).min(LEVELS - 1)
}

impl Ramp {
    /// The colour of a level below [`LEVELS`], as `#rrggbb`.
    pub fn colour(self, level: usize) -> String {
        let stops = match self {
            Ramp::Ember => EMBER,
            Ramp::Meadow => MEADOW,
        };
        let along = level.min(LEVELS - 1) as f64 / (LEVELS - 1) as f64 * (stops.len() - 1) as f64;
        let from = (along as usize).min(stops.len() - 2);
        let share = along - from as f64;
        let mixed = [16, 8, 0].map(|shift| {
            let part = |stop: u32| f64::from((stop >> shift) & 0xff);
            let value = part(stops[from]) + (part(stops[from + 1]) - part(stops[from])) * share;
            value.round() as u8
        });
        format!("#{:02x}{:02x}{:02x}", mixed[0], mixed[1], mixed[2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rec. 709 luma: what is left in grey.
    fn luma(colour: &str) -> f64 {
        let part =
            |from: usize| f64::from(u8::from_str_radix(&colour[from..from + 2], 16).unwrap());
        0.2126 * part(1) + 0.7152 * part(3) + 0.0722 * part(5)
    }

    #[test]
    fn every_ramp_is_ordered_in_grey_and_light_where_things_are_good() {
        for (ramp, sign) in [(Ramp::Ember, -1.0), (Ramp::Meadow, 1.0)] {
            for level in 1..LEVELS {
                let step = luma(&ramp.colour(level)) - luma(&ramp.colour(level - 1));
                assert!(sign * step > 0.0, "{ramp:?} at {level}: {step}");
            }
        }
    }

    #[test]
    fn levels_stay_on_the_ramp() {
        assert_eq!([-1.0, 0.0, 0.999, 1.0, 7.0].map(level), [0, 0, 63, 63, 63]);
        assert_eq!(level(f64::NAN), 0);
    }
}
