//! What the board's senses mean: one bad look can be noise on a wire, some in a row are a fault.

use protocol::Trip;

use crate::pace::quarters;
use crate::senses::{Readback, Senses, Transfer};

/// The emergency stop or the alarm counts when it is seen in so many ticks in a row.
const LOOKS: u8 = 2;
/// Words that did not arrive so many times in a row will not arrive: as long as the hardware holds CLR
/// off without being served.
const TRANSFERS: u8 = 4;
/// After a motion that found no room, none may be lost for so long.
const UNHEARD_QUARTERS: u32 = quarters(100);

/// The senses' last ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Watch {
    open: u8,
    alarmed: u8,
    transfers: u8,
    /// Time left until the ports' tasks are believed to run again.
    unheard: u32,
}

impl Watch {
    /// A tick with these senses, `quarters` of a millisecond after the one before. Returns what they trip.
    pub fn look(&mut self, senses: &Senses, quarters: u32) -> Option<Trip> {
        count(&mut self.open, senses.stop_input_open);
        count(&mut self.alarmed, senses.alarm);
        count(&mut self.transfers, senses.transfer != Transfer::Done);
        self.unheard = if senses.unheard {
            UNHEARD_QUARTERS
        } else {
            self.unheard.saturating_sub(quarters)
        };
        if self.open >= LOOKS {
            Some(Trip::EmergencyStop)
        } else if self.alarmed >= LOOKS || senses.readback == Readback::Differs {
            Some(Trip::Converter)
        } else if self.transfers >= TRANSFERS {
            Some(Trip::Transfer)
        } else {
            None
        }
    }

    /// Whether the alarm has just been found to last, so that it counts once.
    pub const fn alarm_begins(&self) -> bool {
        self.alarmed == LOOKS
    }

    /// Whether the words sent last are not in the converters.
    pub const fn words_are_missing(&self) -> bool {
        self.transfers > 0
    }

    /// Whether the tasks behind the ports are held up.
    pub const fn is_unheard(&self) -> bool {
        self.unheard > 0
    }
}

fn count(in_a_row: &mut u8, seen: bool) {
    *in_a_row = if seen { in_a_row.saturating_add(1) } else { 0 };
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tick, counted from 1, in which `senses` trip if they last, and the trip.
    fn trips(senses: Senses) -> Option<(usize, Trip)> {
        let mut watch = Watch::default();
        (1..1_000).find_map(|tick| watch.look(&senses, 2).map(|trip| (tick, trip)))
    }

    /// The same if every second tick is a healthy one.
    fn trips_in_turn(senses: Senses) -> Option<Trip> {
        let mut watch = Watch::default();
        (0..1_000).find_map(|tick| {
            let healthy = Senses::default();
            watch.look(if tick % 2 == 0 { &senses } else { &healthy }, 2)
        })
    }

    #[test]
    fn a_fault_that_lasts_trips_and_noise_on_a_wire_does_not() {
        let open = Senses {
            stop_input_open: true,
            ..Senses::default()
        };
        let alarm = Senses {
            alarm: true,
            ..Senses::default()
        };
        let [failed, stalled] = [Transfer::Failed, Transfer::Stalled].map(|transfer| Senses {
            transfer,
            ..Senses::default()
        });
        for (senses, expected) in [
            (open, (2, Trip::EmergencyStop)),
            (alarm, (2, Trip::Converter)),
            (failed, (4, Trip::Transfer)),
            (stalled, (4, Trip::Transfer)),
        ] {
            assert_eq!(trips(senses), Some(expected));
            assert_eq!(trips_in_turn(senses), None);
        }
    }

    #[test]
    fn a_converter_that_holds_something_else_trips_at_once() {
        let [none, agrees, differs] =
            [Readback::None, Readback::Agrees, Readback::Differs].map(|readback| {
                trips(Senses {
                    readback,
                    ..Senses::default()
                })
            });
        assert_eq!((none, agrees), (None, None));
        assert_eq!(differs, Some((1, Trip::Converter)));
    }

    #[test]
    fn a_lost_motion_counts_for_a_tenth_of_a_second() {
        let mut watch = Watch::default();
        let lost = Senses {
            unheard: true,
            ..Senses::default()
        };
        assert_eq!(watch.look(&lost, 1), None);
        let lasts = (0..).take_while(|_| {
            watch.look(&Senses::default(), 1);
            watch.is_unheard()
        });
        assert_eq!(lasts.count(), 399);
    }
}
