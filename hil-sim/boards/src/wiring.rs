//! Wires that are put wrong: what a person may have done to a bench, and finds by bringing it up.
//!
//! A mistake stays until it is put right. Unlike a scene's fault, it is there when the boards start.

use protocol::Role;
use strum::{EnumString, IntoStaticStr, VariantArray};

/// The gauge that [`Mistake::GaugeOpen`] and [`Mistake::GaugeShort`] are of.
pub const GAUGE: usize = 2;
/// The chip, the first being 0, that [`Mistake::SelectOpen`] is of.
pub const CHIP: usize = 1;

/// A wire that is open, at a level, or in another's place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum Mistake {
    /// The boards' TX are joined, and their RX: neither hears the other.
    LinkStraight,
    /// The sensor board's TX is open: the display hears nothing.
    SensorTxOpen,
    /// The display board's TX is open: the sensor hears nothing.
    DisplayTxOpen,
    /// No common ground: every byte from the other board has a framing error.
    NoGround,
    /// A and B of the hand's encoder are exchanged: it counts backwards.
    HandSwapped,
    /// A of the hand's encoder is open: it counts nothing.
    HandOpen,
    /// A and B of the arm's encoder are exchanged.
    ArmSwapped,
    /// A of the arm's encoder is open.
    ArmOpen,
    /// The arm's PWM (D6) is open: the drive is asked for no speed.
    PwmOpen,
    /// The arm's motor turns the other way than its direction pin (D7) says.
    ArmBackwards,
    /// Gauge [`GAUGE`]'s amplifier is driven to 3.3 V.
    GaugeOpen,
    /// Gauge [`GAUGE`]'s pin is held at mid-rail.
    GaugeShort,
    /// The emergency stop's contact (D4) is open.
    StopOpen,
    /// The converters' SDI (D11) is open: they hear ones.
    SdiOpen,
    /// The converters' SDO (D12) is open: the board hears ones.
    SdoOpen,
    /// The chip select of chip [`CHIP`] is open: it hears no frame.
    SelectOpen,
    /// ALMOUT (D3) is at ground.
    AlarmLow,
    /// LDAC (D16) is held high.
    #[strum(serialize = "ldac-high")]
    LoadHigh,
    /// CLR (D6 of the display board) is at ground.
    #[strum(serialize = "clr-low")]
    ClearLow,
}

impl Mistake {
    /// All of them.
    pub const ALL: [Self; 19] = *Self::VARIANTS.as_array().unwrap();

    /// Its name in commands.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// The mistake of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        name.parse().ok()
    }

    /// Whether the wire is one between the boards.
    pub const fn is_of_link(self) -> bool {
        matches!(
            self,
            Self::LinkStraight | Self::SensorTxOpen | Self::DisplayTxOpen | Self::NoGround
        )
    }

    /// Whether the board of `role` gets to feel it: what it hears, reads or drives is another then.
    pub const fn is_at(self, role: Role) -> bool {
        match self {
            Self::LinkStraight | Self::NoGround => true,
            Self::DisplayTxOpen
            | Self::ArmSwapped
            | Self::ArmOpen
            | Self::PwmOpen
            | Self::ArmBackwards
            | Self::GaugeOpen
            | Self::GaugeShort => matches!(role, Role::Sensor),
            _ => matches!(role, Role::Display),
        }
    }
}

/// The two lines of a quadrature encoder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EncoderWires {
    /// As they should be.
    #[default]
    Sound,
    /// A is B, and B is A.
    Exchanged,
    /// One of them is open: the other's edges count up and down in turn.
    Open,
}

impl EncoderWires {
    /// The counter where a sound encoder's has `counts`.
    pub const fn counts(self, counts: u16) -> u16 {
        match self {
            Self::Sound => counts,
            Self::Exchanged => counts.wrapping_neg(),
            Self::Open => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mistake_has_a_name_of_its_own_and_a_board_that_feels_it() {
        for mistake in Mistake::ALL {
            assert_eq!(Mistake::from_name(mistake.name()), Some(mistake));
            assert!(
                [Role::Sensor, Role::Display]
                    .into_iter()
                    .any(|role| mistake.is_at(role))
            );
        }
    }

    #[test]
    fn an_encoder_whose_lines_are_exchanged_counts_backwards_and_an_open_one_not_at_all() {
        for counts in [0, 1, 700, u16::MAX] {
            assert_eq!(EncoderWires::Sound.counts(counts), counts);
            assert_eq!(
                EncoderWires::Exchanged.counts(counts).wrapping_add(counts),
                0
            );
            assert_eq!(EncoderWires::Open.counts(counts), 0);
        }
    }
}
