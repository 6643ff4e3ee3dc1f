//! How far a board's clock is ahead of this computer's, and how fast it drifts.

use protocol::{ClockOffset, Pong};

/// One exchange of a ping and its pong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exchange {
    /// When the answer came, in µs of this computer's clock.
    pub at_us: u64,
    /// The board's clock minus this computer's, in µs: wrong by half the round trip at most.
    pub offset_us: i64,
    /// Time on the way, in µs.
    pub round_trip_us: u64,
}

impl Exchange {
    /// The exchange that an answer at `at_us` ends; none if its instants contradict each other.
    pub fn new(pong: &Pong, at_us: u64) -> Option<Self> {
        let mut clock = ClockOffset::new();
        clock.on_pong(pong, at_us).then_some(())?;
        Some(Self {
            at_us,
            offset_us: clock.offset_us()?,
            round_trip_us: clock.round_trip_us()?,
        })
    }
}

/// What several exchanges tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockFacts {
    /// The board's clock minus this computer's, in µs, by the shortest exchange.
    pub offset_us: i64,
    /// The shortest round trip, in µs.
    pub round_trip_us: u64,
    /// How fast the board's clock gains, if there was time to see it.
    pub drift: Option<Drift>,
}

/// How fast a clock gains on another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// In µs a second; above 0 if the board's clock is the faster one.
    pub ppm: f64,
    /// The bound of its error, from the round trips, in µs a second.
    pub error_ppm: f64,
}

impl ClockFacts {
    /// From exchanges in the order of time; none without one.
    pub fn new(exchanges: &[Exchange]) -> Option<Self> {
        let best = shortest(exchanges)?;
        Some(Self {
            offset_us: best.offset_us,
            round_trip_us: best.round_trip_us,
            drift: drift(exchanges),
        })
    }
}

fn shortest(exchanges: &[Exchange]) -> Option<&Exchange> {
    exchanges
        .iter()
        .min_by_key(|exchange| exchange.round_trip_us)
}

/// Between the shortest exchange of the first third and that of the last one: they have waited least in
/// queues, and each offset is wrong by no more than half its round trip.
fn drift(exchanges: &[Exchange]) -> Option<Drift> {
    let third = exchanges.len() / 3;
    let from = shortest(&exchanges[..third])?;
    let to = shortest(&exchanges[exchanges.len() - third..])?;
    let span_s = to.at_us.checked_sub(from.at_us).filter(|&us| us > 0)? as f64 / 1e6;
    let gained_us = (i128::from(to.offset_us) - i128::from(from.offset_us)) as f64;
    Some(Drift {
        ppm: gained_us / span_s,
        error_ppm: (from.round_trip_us as f64 + to.round_trip_us as f64) / 2.0 / span_s,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exchange_is_read_from_its_instants() {
        let pong = Pong {
            sent_us: 1_000,
            received_us: 501_300,
            answered_us: 501_310,
        };
        let exchange = Exchange::new(&pong, 1_610).expect("in order");
        assert_eq!(exchange.round_trip_us, 600);
        assert_eq!(exchange.offset_us, 500_000);
        assert_eq!(Exchange::new(&pong, 900), None);
    }

    #[test]
    fn drift_is_found_among_exchanges_that_waited() {
        // 80 ppm fast; every answer but each third has waited 5 ms on its way back, which looks like an
        // offset of -2.5 ms.
        let exchanges: Vec<Exchange> = (0..30)
            .map(|at| {
                let at_us = 1_000_000 + at * 100_000;
                let waited_us = if at % 3 == 0 { 0 } else { 5_000 };
                let gained_us = i64::try_from(at_us * 80 / 1_000_000).expect("small");
                Exchange {
                    at_us,
                    offset_us: 7_000 + gained_us - i64::try_from(waited_us / 2).expect("small"),
                    round_trip_us: 100 + waited_us,
                }
            })
            .collect();
        let facts = ClockFacts::new(&exchanges).expect("exchanges");
        assert_eq!(facts.round_trip_us, 100);
        let drift = facts.drift.expect("three seconds");
        assert!((drift.ppm - 80.0).abs() <= 1.0, "{drift:?}");
        // 100 µs over the 2.1 s between the first and the 22nd exchange.
        assert!((drift.error_ppm - 100.0 / 2.1).abs() < 0.1, "{drift:?}");
    }

    #[test]
    fn two_exchanges_tell_no_drift_and_none_tells_nothing() {
        let exchange = Exchange {
            at_us: 5,
            offset_us: 1,
            round_trip_us: 2,
        };
        let facts = ClockFacts::new(&[exchange; 2]).expect("exchanges");
        assert_eq!(facts.drift, None);
        assert_eq!(ClockFacts::new(&[]), None);
    }
}
