//! The clock offset, against clocks whose offset is known.

use proptest::prelude::*;
use protocol::{ClockOffset, Pong};

/// An exchange between a clock and one `offset_us` ahead of it: sent at `sent_us`, `there_us` and
/// `back_us` on the way, `held_us` at the peer. Returns the answer and when it came.
fn exchange(
    offset_us: i64,
    sent_us: u64,
    there_us: u64,
    held_us: u64,
    back_us: u64,
) -> (Pong, u64) {
    let peer = |own_us: u64| own_us.checked_add_signed(offset_us).expect("in range");
    let pong = Pong {
        sent_us,
        received_us: peer(sent_us + there_us),
        answered_us: peer(sent_us + there_us + held_us),
    };
    (pong, sent_us + there_us + held_us + back_us)
}

#[test]
fn an_even_delay_gives_the_offset_exactly() {
    for offset_us in [0, 1, -1, 12_345_678, -900_000] {
        let mut clock = ClockOffset::new();
        assert_eq!(clock.offset_us(), None);
        let (pong, now_us) = exchange(offset_us, 1_000_000, 250, 40, 250);
        assert!(clock.on_pong(&pong, now_us));
        assert_eq!(clock.offset_us(), Some(offset_us));
        assert_eq!(clock.round_trip_us(), Some(500));
        let own = clock.to_own_us(pong.received_us);
        assert_eq!(own, Some(1_000_250));
    }
}

#[test]
fn the_shortest_of_the_last_eight_counts_and_is_forgotten_after_eight() {
    let mut clock = ClockOffset::new();
    let (short, short_now) = exchange(500, 1_000, 10, 5, 10);
    assert!(clock.on_pong(&short, short_now));
    for n in 1..8 {
        let (slow, now_us) = exchange(500, 10_000 * n, 3_000, 5, 10);
        assert!(clock.on_pong(&slow, now_us));
        assert_eq!(clock.offset_us(), Some(500));
    }
    let (slow, now_us) = exchange(500, 80_000, 3_000, 5, 10);
    assert!(clock.on_pong(&slow, now_us));
    // All eight are uneven now: off by half the difference of the two ways.
    assert_eq!(clock.offset_us(), Some(500 + (3_000 - 10) / 2));
    clock.clear();
    assert_eq!(clock.offset_us(), None);
    assert_eq!(clock.to_own_us(1), None);
}

#[test]
fn answers_that_contradict_themselves_are_refused() {
    let mut clock = ClockOffset::new();
    let good = Pong {
        sent_us: 1_000,
        received_us: 5_000,
        answered_us: 5_100,
    };
    // Before it was asked; answered before it was received; held longer than the whole took.
    assert!(!clock.on_pong(&good, 999));
    let backwards = Pong {
        answered_us: 4_999,
        ..good
    };
    assert!(!clock.on_pong(&backwards, 2_000));
    assert!(!clock.on_pong(&good, 1_099));
    assert_eq!(clock.offset_us(), None);
    assert!(clock.on_pong(&good, 1_100));
}

#[test]
fn an_instant_before_the_own_clocks_start_has_no_answer() {
    let mut clock = ClockOffset::new();
    let (pong, now_us) = exchange(1_000_000, 10, 1, 1, 1);
    assert!(clock.on_pong(&pong, now_us));
    assert_eq!(clock.to_own_us(999_999), None);
    assert_eq!(clock.to_own_us(1_000_000), Some(0));
}

proptest! {
    #[test]
    fn the_error_is_never_more_than_half_the_round_trip(
        offset_us in -1_000_000_i64..1_000_000_000_000,
        sent_us in 1_000_000_u64..1 << 40,
        ways in proptest::collection::vec((0_u64..500_000, 0_u64..10_000, 0_u64..500_000), 1..20),
    ) {
        let mut clock = ClockOffset::new();
        for (n, (there_us, held_us, back_us)) in (0..).zip(ways) {
            let (pong, now_us) =
                exchange(offset_us, sent_us + n * 1_000_000, there_us, held_us, back_us);
            prop_assert!(clock.on_pong(&pong, now_us));
            let error_us = clock.offset_us().expect("one exchange").abs_diff(offset_us);
            let round_trip_us = clock.round_trip_us().expect("one exchange");
            // The halved µs is rounded.
            prop_assert!(2 * error_us <= round_trip_us + 1);
        }
    }

    #[test]
    fn no_claim_of_a_peer_panics(sent_us: u64, received_us: u64, answered_us: u64, now_us: u64, t: u64) {
        let mut clock = ClockOffset::new();
        clock.on_pong(&Pong { sent_us, received_us, answered_us }, now_us);
        let _ = clock.to_own_us(t);
    }
}
