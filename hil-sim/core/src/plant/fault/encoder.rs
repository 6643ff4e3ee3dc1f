//! Faults of the encoders.

use crate::scene::fault::{Fault, Kind};

/// The wires of an encoder, and the counter behind them.
#[derive(Clone, Debug, Default)]
pub struct EncoderFaults {
    /// When it stands still.
    dead: Vec<Fault>,
    /// When it jumps, the first one first.
    jumps: Vec<Fault>,
    /// Jumps that have come.
    jumped: usize,
    /// What the counter is ahead of the encoder.
    offset: u16,
    last: u16,
}

impl EncoderFaults {
    /// The hand's encoder under a scene's `faults`.
    pub fn of_hand(faults: &[Fault]) -> Self {
        Self::of(faults, Kind::HandEncoderDead, Kind::HandEncoderJump)
    }

    /// The arm's.
    pub fn of_arm(faults: &[Fault]) -> Self {
        Self::of(faults, Kind::ArmEncoderDead, Kind::ArmEncoderJump)
    }

    fn of(faults: &[Fault], dead: Kind, jump: Kind) -> Self {
        let of = |kind| {
            let of_kind = faults.iter().filter(move |fault| fault.kind == kind);
            of_kind.copied().collect::<Vec<_>>()
        };
        let mut jumps = of(jump);
        jumps.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        Self {
            dead: of(dead),
            jumps,
            ..Self::default()
        }
    }

    /// The counter at `at_ns`, where a sound one has `counts`. To be asked for in order.
    pub fn counts(&mut self, at_ns: u64, counts: u16) -> u16 {
        let come = self.jumps.iter().filter(|jump| jump.begins_ns() <= at_ns);
        for jump in come.skip(self.jumped) {
            self.jumped += 1;
            let counts = jump.values[0] as u16;
            self.offset = self.offset.wrapping_add(counts);
            self.last = self.last.wrapping_add(counts);
        }
        if self.dead.iter().any(|fault| fault.is_on(at_ns)) {
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
        let mut encoder = EncoderFaults::of_hand(&[Fault {
            for_s: Some(2e-9),
            ..Fault::new(Kind::HandEncoderDead, 3e-9)
        }]);
        let read: Vec<u16> = (0..8)
            .map(|ns| encoder.counts(ns, 100 + ns as u16))
            .collect();
        assert_eq!(read, [100, 101, 102, 102, 102, 103, 104, 105]);
    }

    #[test]
    fn an_encoder_that_stands_still_jumps_as_well() {
        let jump = Fault {
            values: [500.0, 0.0],
            ..Fault::new(Kind::HandEncoderJump, 4e-9)
        };
        let mut encoder = EncoderFaults::of_hand(&[Fault::new(Kind::HandEncoderDead, 2e-9), jump]);
        let read: Vec<u16> = (0..6).map(|ns| encoder.counts(ns, ns as u16)).collect();
        assert_eq!(read, [0, 1, 1, 1, 501, 501]);
    }

    #[test]
    fn a_jump_comes_once_and_stays() {
        let mut encoder = EncoderFaults::of_hand(&[Fault {
            values: [500.0, 0.0],
            ..Fault::new(Kind::HandEncoderJump, 2e-9)
        }]);
        let read: Vec<u16> = (0..4).map(|ns| encoder.counts(ns, ns as u16)).collect();
        assert_eq!(read, [0, 1, 502, 503]);
    }
}
