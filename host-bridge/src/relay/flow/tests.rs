//! The flow on models of networks, in their own time.

use std::collections::VecDeque;

use super::*;

/// Between two messages of a display, in µs.
const MOTION_US: u64 = 2_000;
/// Between two pings, and while they are not answered, in µs.
const PING_US: (u64, u64) = (25_000, 100_000);
/// What a message or a ping is on the wire, in bytes: envelope, the engine's part, TCP and IP.
const BYTES: u64 = 150;
/// The other site's clock minus one's own, in µs.
const AHEAD_US: i128 = -7_000_000_000;

fn answer(sent_us: u64, round_trip_us: u64) -> Answer {
    Answer {
        sent_us,
        there_us: AHEAD_US + i128::from(round_trip_us / 2),
        round_trip_us,
    }
}

#[test]
fn before_anybody_has_answered_nothing_is_sent() {
    assert!(!Flow::default().admits(0));
    assert!(!Flow::default().is_answered(0));
}

#[test]
fn while_answers_come_in_time_everything_goes() {
    let mut flow = Flow::default();
    flow.on_answer(answer(0, 20_000));
    let until_us = 3 * 20_000 + SLACK_US;
    assert!(
        (0..=until_us)
            .step_by(2_000)
            .all(|at_us| flow.admits(at_us))
    );
    assert!(flow.is_answered(until_us));
    assert!(!flow.is_answered(until_us + 1));
}

#[test]
fn while_they_are_late_a_few_go_and_then_none() {
    let mut flow = Flow::default();
    flow.on_answer(answer(0, 20_000));
    let in_time_us = 3 * 20_000 + SLACK_US;
    let late = in_time_us + 1..in_time_us + PATIENCE_US;
    let count = late
        .step_by(1_000)
        .filter(|&at_us| flow.admits(at_us))
        .count();
    assert_eq!(count as u64, PATIENCE_US / LATE_SPACING_US);
    assert!(!flow.admits(in_time_us + PATIENCE_US + LATE_SPACING_US));
    flow.on_answer(answer(in_time_us, 2_500_000));
    assert!(flow.admits(in_time_us + PATIENCE_US + LATE_SPACING_US));
}

#[test]
fn an_answer_that_comes_late_takes_nothing_back() {
    let mut flow = Flow::default();
    flow.on_answer(answer(100_000, 10_000));
    flow.on_answer(answer(50_000, 60_000));
    assert!(flow.is_answered(100_000 + 3 * 10_000 + SLACK_US));
}

#[test]
fn a_round_trip_of_long_ago_is_forgotten() {
    let mut flow = Flow::default();
    flow.on_answer(answer(0, 1_000));
    flow.on_answer(answer(HALF_WINDOW_US + 1, 90_000));
    assert_eq!(flow.round_trip_us(), Some(1_000));
    flow.on_answer(answer(2 * HALF_WINDOW_US + 2, 90_000));
    assert_eq!(flow.round_trip_us(), Some(90_000));
}

#[test]
fn a_network_that_takes_very_long_is_not_waited_for_longer_than_is_of_use() {
    let mut flow = Flow::default();
    flow.on_answer(answer(0, 60_000_000));
    assert!(flow.admits(LONGEST_US));
    assert!(!flow.admits(LONGEST_US + 1));
}

#[test]
fn no_claim_of_another_clock_overflows_or_holds_up_the_stream() {
    let mut flow = Flow::default();
    for (round, there_us) in [0, i128::MIN, i128::MAX, 0, i128::MAX]
        .into_iter()
        .enumerate()
    {
        let sent_us = round as u64 * 1_000_000;
        flow.on_answer(Answer {
            sent_us,
            there_us,
            round_trip_us: 10_000,
        });
        assert!(flow.admits(sent_us) && flow.admits(sent_us + 1));
    }
}

/// A network under TCP: bytes go one after another and come in order.
struct Network {
    delay_us: u64,
    /// What it carries, in bytes per second.
    bytes_per_s: u64,
    /// One in this many is lost; none if 0.
    lost_of: u64,
    /// From when on it takes another time.
    later: Option<(u64, u64)>,
    noise: u64,
    free_us: u64,
    newest_us: u64,
    /// When each of the last ones was sent that TCP may notice a loss by.
    sent_us: VecDeque<u64>,
}

impl Network {
    fn new(delay_us: u64, bytes_per_s: u64, lost_of: u64) -> Self {
        Self {
            delay_us,
            bytes_per_s,
            lost_of,
            later: None,
            noise: 1,
            free_us: 0,
            newest_us: 0,
            sent_us: VecDeque::new(),
        }
    }

    /// When something arrives that is sent at `at_us`. What is lost is sent again one round trip and four
    /// messages later, as TCP does that has noticed it by what came after, until it arrives; what comes
    /// behind it waits.
    fn carry(&mut self, at_us: u64) -> u64 {
        if let Some((from_us, delay_us)) = self.later
            && at_us >= from_us
        {
            self.delay_us = delay_us;
        }
        let between_us = self
            .sent_us
            .front()
            .map_or(0, |first_us| (at_us - first_us) / 4);
        self.sent_us.push_back(at_us);
        if self.sent_us.len() > 4 {
            self.sent_us.pop_front();
        }
        self.free_us = self.free_us.max(at_us) + BYTES * 1_000_000 / self.bytes_per_s;
        let mut arrives_us = self.free_us + self.delay_us;
        while self.loses() {
            arrives_us += 2 * self.delay_us + 4 * between_us;
        }
        self.newest_us = self.newest_us.max(arrives_us);
        self.newest_us
    }

    fn loses(&mut self) -> bool {
        self.noise = self.noise * 48_271 % 0x7fff_ffff;
        self.lost_of > 0 && self.noise.is_multiple_of(self.lost_of)
    }
}

struct Stream {
    /// Messages that came after the first `settled_us`.
    count: u64,
    oldest_us: u64,
    longest_gap_us: u64,
}

/// A display's motions for a minute; what comes in the first `settled_us` is not counted.
fn stream(mut network: Network, is_flowing: bool, settled_us: u64) -> Stream {
    let mut flow = Flow::default();
    let mut answers: VecDeque<(u64, Answer)> = VecDeque::new();
    let (mut pinged_us, mut last_us) = (None, None);
    let mut stream = Stream {
        count: 0,
        oldest_us: 0,
        longest_gap_us: 0,
    };
    for now_us in (0..60_000_000).step_by(1_000) {
        while let Some((_, answer)) = answers.pop_front_if(|(due_us, _)| *due_us <= now_us) {
            flow.on_answer(answer);
        }
        let (often_us, seldom_us) = PING_US;
        let period_us = if flow.is_answered(now_us) {
            often_us
        } else {
            seldom_us
        };
        if pinged_us.is_none_or(|pinged_us| now_us - pinged_us >= period_us) {
            pinged_us = Some(now_us);
            let there_us = network.carry(now_us);
            let back_us = there_us + network.delay_us;
            let answer = Answer {
                sent_us: now_us,
                there_us: i128::from(there_us - now_us) + AHEAD_US,
                round_trip_us: back_us - now_us,
            };
            answers.push_back((back_us, answer));
        }
        if now_us % MOTION_US == 0 && (!is_flowing || flow.admits(now_us)) {
            let came_us = network.carry(now_us);
            if now_us > settled_us {
                stream.count += 1;
                stream.oldest_us = stream.oldest_us.max(came_us - now_us);
                let gap_us = came_us - last_us.unwrap_or(came_us);
                stream.longest_gap_us = stream.longest_gap_us.max(gap_us);
            }
            last_us = Some(came_us);
        }
    }
    stream
}

#[test]
fn a_network_that_carries_all_of_it_gets_all_of_it() {
    for delay_us in [1_000, 50_000, 250_000, 500_000] {
        let stream = stream(Network::new(delay_us, 1_000_000, 0), true, 2_000_000);
        assert_eq!(stream.count, 58_000_000 / MOTION_US - 1);
        assert!(stream.oldest_us <= delay_us + 1_000, "{}", stream.oldest_us);
    }
}

#[test]
fn a_way_that_becomes_longer_is_not_taken_for_a_queue_for_long() {
    for (before_us, after_us) in [(500, 500_000), (10_000, 100_000), (50_000, 500_000)] {
        let count = |settled_us: u64| {
            let mut network = Network::new(before_us, 1_000_000, 0);
            network.later = Some((10_000_000, after_us));
            let all = (60_000_000 - settled_us) / MOTION_US - 1;
            (stream(network, true, settled_us).count, all)
        };
        // Ten seconds later nearly all goes again, and after twenty all.
        let (came, all) = count(20_000_000);
        assert!(
            10 * came >= 9 * all,
            "{before_us}, {after_us} µs: {came} of {all}"
        );
        let (came, all) = count(30_000_000);
        assert_eq!(came, all, "{before_us}, {after_us} µs");
    }
}

#[test]
fn on_a_narrow_network_ages_stay_bounded_and_most_of_it_is_used() {
    // What a round trip is long lets more wait, up to the longest patience.
    for (delay_us, bound_us) in [
        (5_000, 500_000),
        (50_000, 2_000_000),
        (250_000, LONGEST_US + 4 * 250_000),
    ] {
        for bytes_per_s in [15_000, 20_000, 40_000, 60_000] {
            let network = || Network::new(delay_us, bytes_per_s, 0);
            let uncontrolled = stream(network(), false, 5_000_000);
            assert!(uncontrolled.oldest_us > 15_000_000);
            let stream = stream(network(), true, 5_000_000);
            let waited_us = stream.oldest_us - delay_us;
            let used = (stream.count * BYTES) as f64 / (55 * bytes_per_s) as f64;
            let gap_us = stream.longest_gap_us;
            println!(
                "{delay_us} µs, {bytes_per_s} B/s: waited {waited_us} µs ({} µs without control), used {used:.2}, gap {gap_us} µs",
                uncontrolled.oldest_us - delay_us,
            );
            assert!(waited_us < bound_us, "{waited_us} µs at {bytes_per_s} B/s");
            assert!(used > 0.4, "{used} at {bytes_per_s} B/s");
            assert!(gap_us < 100_000 || delay_us == 250_000, "{gap_us} µs");
        }
    }
}

#[test]
fn with_loss_no_gap_is_longer_than_what_tcp_needs_by_itself() {
    for (delay_us, lost_of) in [(50_000, 5), (250_000, 20), (500_000, 20)] {
        let network = || Network::new(delay_us, 1_000_000, lost_of);
        let uncontrolled = stream(network(), false, 2_000_000);
        let stream = stream(network(), true, 2_000_000);
        println!(
            "{delay_us} µs, one of {lost_of}: gap {} µs, {} µs without control; {} of {} messages",
            stream.longest_gap_us, uncontrolled.longest_gap_us, stream.count, uncontrolled.count
        );
        // Thinned, TCP notices a loss some messages later.
        assert!(stream.longest_gap_us <= uncontrolled.longest_gap_us + 4 * LATE_SPACING_US);
        assert!(stream.count > uncontrolled.count / 2, "{}", stream.count);
    }
}
