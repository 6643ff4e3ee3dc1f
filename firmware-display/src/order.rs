//! Whether a message of the sensor's is later than those before it, late, or of a sensor that has started again.

/// Where a message stands to the last one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// It was sent before one that was seen already.
    Late,
    /// It was sent after all that were seen.
    Later,
    /// The sensor has started again.
    Anew,
}

/// How far sequences may go astray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Astray {
    /// A message is late if it is behind the last by at most this many.
    pub late_at_most: u32,
    /// A sensor that has just started sends sequences up to this; from it, one that is behind by more than
    /// `reordered_at_most` is a new beginning and not late.
    pub beginning: u32,
    /// The link puts messages out of order by no more than this many.
    pub reordered_at_most: u32,
}

/// The sensor's estimates, by whose numbers its textures go too: 10 s; the first 0.1 s; 0.32 s.
pub const SENSORS: Astray = Astray {
    late_at_most: 1_000,
    beginning: 10,
    reordered_at_most: 32,
};

/// Where `sequence` stands to the `last` one seen, of a sensor that `may_begin`: it has asked for a greeting since then.
pub fn order(last: Option<u32>, sequence: u32, may_begin: bool, astray: &Astray) -> Order {
    let Some(last) = last else {
        return Order::Later;
    };
    // A later one is behind by almost 2³².
    let behind = last.wrapping_sub(sequence);
    let is_first = may_begin || sequence <= astray.beginning;
    let begins_anew = is_first && behind > astray.reordered_at_most;
    if behind <= astray.late_at_most && !begins_anew {
        Order::Late
    } else if behind <= i32::MAX as u32 {
        Order::Anew
    } else {
        Order::Later
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASTRAY: Astray = Astray {
        late_at_most: 200,
        beginning: 2,
        reordered_at_most: 8,
    };

    #[test]
    fn a_sequence_is_later_late_or_a_new_beginning() {
        for (last, sequence, may_begin, expected) in [
            (None, 7, false, Order::Later),
            (Some(7), 8, false, Order::Later),
            (Some(7), 1_000_007, false, Order::Later),
            (Some(u32::MAX), 0, false, Order::Later),
            (Some(7), 7, false, Order::Late),
            (Some(7), 0, false, Order::Late),
            (Some(300), 100, false, Order::Late),
            (Some(300), 99, false, Order::Anew),
            (Some(100), 2, false, Order::Anew),
            (Some(100), 3, false, Order::Late),
            (Some(10), 2, false, Order::Late),
            (None, 7, true, Order::Later),
            (Some(7), 8, true, Order::Later),
            (Some(100), 92, true, Order::Late),
            (Some(100), 91, true, Order::Anew),
            (Some(300), 100, true, Order::Anew),
        ] {
            assert_eq!(
                order(last, sequence, may_begin, &ASTRAY),
                expected,
                "{last:?} {sequence} {may_begin}"
            );
        }
    }
}
