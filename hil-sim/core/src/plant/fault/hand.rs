//! Faults of the hand's encoder.

use crate::scene::fault::{Fault, Kind};

/// The wires of the hand's encoder, and the counter behind them.
#[derive(Clone, Debug, Default)]
pub struct HandFault {
    faults: Vec<Fault>,
    /// Jumps that have come.
    jumped: usize,
    /// What the counter is ahead of the hand.
    offset: u16,
    last: u16,
}

impl HandFault {
    /// The encoder under a scene's `faults`.
    pub fn new(faults: &[Fault]) -> Self {
        let of_hand =
            |fault: &&Fault| matches!(fault.kind, Kind::HandEncoderDead | Kind::HandEncoderJump);
        let mut faults: Vec<Fault> = faults.iter().filter(of_hand).copied().collect();
        faults.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        Self {
            faults,
            ..Self::default()
        }
    }

    /// The counter at `at_ns`, where a sound one has `counts`. To be asked for in order.
    pub fn counts(&mut self, at_ns: u64, counts: u16) -> u16 {
        let jumps = self
            .faults
            .iter()
            .filter(|fault| fault.kind == Kind::HandEncoderJump && fault.begins_ns() <= at_ns);
        for jump in jumps.skip(self.jumped) {
            self.jumped += 1;
            let counts = jump.values[0] as u16;
            self.offset = self.offset.wrapping_add(counts);
            self.last = self.last.wrapping_add(counts);
        }
        let is_dead = |fault: &Fault| fault.kind == Kind::HandEncoderDead && fault.is_on(at_ns);
        if self.faults.iter().any(is_dead) {
            // It goes on from where it stopped.
            self.offset = self.last.wrapping_sub(counts);
        }
        self.last = counts.wrapping_add(self.offset);
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dead_encoder_stands_and_goes_on_from_there() {
        let mut hand = HandFault::new(&[Fault {
            for_s: Some(2e-9),
            ..Fault::new(Kind::HandEncoderDead, 3e-9)
        }]);
        let read: Vec<u16> = (0..8).map(|ns| hand.counts(ns, 100 + ns as u16)).collect();
        assert_eq!(read, [100, 101, 102, 102, 102, 103, 104, 105]);
    }

    #[test]
    fn an_encoder_that_stands_still_jumps_as_well() {
        let jump = Fault {
            values: [500.0, 0.0],
            ..Fault::new(Kind::HandEncoderJump, 4e-9)
        };
        let mut hand = HandFault::new(&[Fault::new(Kind::HandEncoderDead, 2e-9), jump]);
        let read: Vec<u16> = (0..6).map(|ns| hand.counts(ns, ns as u16)).collect();
        assert_eq!(read, [0, 1, 1, 1, 501, 501]);
    }

    #[test]
    fn a_jump_comes_once_and_stays() {
        let mut hand = HandFault::new(&[Fault {
            values: [500.0, 0.0],
            ..Fault::new(Kind::HandEncoderJump, 2e-9)
        }]);
        let read: Vec<u16> = (0..4).map(|ns| hand.counts(ns, ns as u16)).collect();
        assert_eq!(read, [0, 1, 502, 503]);
    }
}
