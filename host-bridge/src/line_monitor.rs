//! What is heard on a line, what that tells of who is at its other end, and whether a board has started anew.

use protocol::{Hello, Message, Peer, PortCounters};

use crate::clock::is_due;

/// What a board may take for its first answer: two Hellos and a status.
pub const PATIENCE_US: u64 = 1_500_000;
/// How long a board that was known may say nothing: it reports once a second.
const SILENCE_US: u64 = 2_500_000;
const PING_US: u64 = 1_000_000;
/// What is heard is judged by this much time at least, and by twice as much at most: a board that speaks
/// text has a line a second.
const SPAN_US: u64 = 1_500_000;
/// Text that has been disturbed is still text: at most one byte in so many may be strange. Of random bytes
/// more than half are.
const TEXT_BYTES_A_STRANGE_ONE: u64 = 8;

/// What has been heard on a line since it was opened.
pub struct LineMonitor {
    opened_us: u64,
    patience_us: u64,
    heard_us: Option<u64>,
    /// When a frame came last that was understood.
    understood_us: Option<u64>,
    /// Frames that had been understood by then.
    understood: u32,
    /// Frames of somebody who has not said Hello, so far.
    unheralded: u32,
    pinged_us: Option<u64>,
    /// Whether anything was heard that only a board says: a frame that was understood, or a 0x00, which ends each of
    /// its lines of text.
    is_board: bool,
    /// Since when the other end has spoken text.
    text_us: Option<u64>,
    span_us: u64,
    /// This span, and the one before.
    spans: [Sound; 2],
}

/// What bytes of a span of time were like.
#[derive(Clone, Copy, Default)]
struct Sound {
    bytes: u64,
    /// Bytes of 0x00: no text without others.
    zeros: u64,
    /// Bytes that no text is made of.
    strange: u64,
    /// Frames of somebody who has not said Hello.
    unheralded: u32,
}

/// What the other end of a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    Open,
    Known(Hello),
    /// Somebody of another protocol or schema.
    Foreign(Hello),
    Silent,
    /// A board's text, or frames, from somebody who does not answer.
    Deaf,
    Garbage,
}

impl LineMonitor {
    /// Nothing heard yet on a line that was opened at `opened_us`, and that may be silent for
    /// `patience_us` before it is called so.
    pub const fn new(opened_us: u64, patience_us: u64) -> Self {
        Self {
            opened_us,
            patience_us,
            heard_us: None,
            understood_us: None,
            understood: 0,
            unheralded: 0,
            pinged_us: None,
            is_board: false,
            text_us: None,
            span_us: opened_us,
            spans: [Sound {
                bytes: 0,
                zeros: 0,
                strange: 0,
                unheralded: 0,
            }; 2],
        }
    }

    /// Takes note of what came, maybe nothing, until `at_us`.
    pub fn hear(&mut self, at_us: u64, bytes: &[u8]) {
        if at_us.saturating_sub(self.span_us) >= SPAN_US {
            self.span_us = at_us;
            self.spans = [Sound::default(), self.spans[0]];
        }
        if bytes.is_empty() {
            return;
        }
        self.heard_us = Some(at_us);
        let strange = bytes.iter().filter(|&&byte| !is_text(byte)).count();
        let zeros = bytes.iter().filter(|&&byte| byte == 0).count();
        self.is_board |= zeros > 0;
        self.spans[0].bytes += bytes.len() as u64;
        self.spans[0].zeros += zeros as u64;
        self.spans[0].strange += strange as u64;
    }

    /// Takes note of what the protocol made of it.
    pub fn understand(&mut self, at_us: u64, counters: &PortCounters) {
        if counters.received != self.understood {
            self.understood = counters.received;
            self.understood_us = Some(at_us);
            self.is_board = true;
        }
        self.spans[0].unheralded += counters.unheralded.wrapping_sub(self.unheralded);
        self.unheralded = counters.unheralded;
    }

    /// Whether a ping is due; it counts as sent.
    pub fn ping_due(&mut self, at_us: u64) -> bool {
        let due = is_due(self.pinged_us, PING_US, at_us);
        if due {
            self.pinged_us = Some(at_us);
        }
        due
    }

    /// The board has started anew: its clock is to be asked for.
    pub const fn forget_ping(&mut self) {
        self.pinged_us = None;
    }

    pub fn judge(&mut self, at_us: u64, peer: Peer) -> Verdict {
        match peer {
            Peer::Text if self.text_us.is_none() => {
                // What it said before, in frames, is no garbage: a board that has started anew says a line of
                // text before it is greeted.
                self.text_us = Some(at_us);
                self.spans = [Sound::default(); 2];
            }
            Peer::Text => {}
            _ => self.text_us = None,
        }
        let recent = |when_us: Option<u64>| {
            when_us.is_some_and(|when_us| at_us.saturating_sub(when_us) <= SILENCE_US)
        };
        match peer {
            Peer::Known(hello) if recent(self.understood_us) => Verdict::Known(hello),
            Peer::Foreign(hello) if recent(self.heard_us) => Verdict::Foreign(hello),
            Peer::Silent | Peer::Text
                if at_us.saturating_sub(self.opened_us) <= self.patience_us =>
            {
                Verdict::Open
            }
            Peer::Text
                if self
                    .text_us
                    .is_some_and(|text_us| at_us.saturating_sub(text_us) <= PATIENCE_US) =>
            {
                Verdict::Open
            }
            _ => self.judge_sound(),
        }
    }

    fn judge_sound(&self) -> Verdict {
        let [now, before] = self.spans;
        let bytes = now.bytes + before.bytes;
        let marks = bytes - (now.zeros + before.zeros);
        let strange = now.strange + before.strange;
        let is_text = marks > 0 && strange * TEXT_BYTES_A_STRANGE_ONE <= marks;
        if bytes == 0 {
            Verdict::Silent
        } else if now.unheralded + before.unheralded > 0 || is_text && self.is_board {
            Verdict::Deaf
        } else {
            Verdict::Garbage
        }
    }
}

/// What a board's lines of text, and the ends of frames, are made of.
const fn is_text(byte: u8) -> bool {
    matches!(byte, b' '..=b'~' | b'\r' | b'\n' | 0)
}

/// A board's messages are made and sent in order, some later than others: a block of samples bears the
/// instant of its first one. A clock that steps back further than this has begun again, in µs.
const STEP_US: u64 = 100_000;

/// The latest instant of the board's clock in each kind of message that bears one.
#[derive(Clone, Copy, Debug, Default)]
pub struct BoardClock {
    latest_us: [Option<u64>; 7],
}

impl BoardClock {
    /// Takes note of `message`; whether the board has started anew since the one before.
    pub fn is_restart(&mut self, message: &Message) -> bool {
        let (kind, instant_us) = match message {
            Message::Estimate(estimate) => (0, estimate.instant_us),
            Message::Motion(motion) => (1, motion.instant_us),
            Message::Gauges(gauges) => (2, gauges.instant_us),
            Message::Status(status) => (3, status.uptime_us),
            Message::Pong(pong) => (4, pong.received_us),
            Message::Safety(safety) => (5, safety.instant_us),
            Message::Texture(texture) => (6, texture.instant_us),
            _ => return false,
        };
        let is_restart = self.latest_us[kind]
            .is_some_and(|latest_us| instant_us.saturating_add(STEP_US) < latest_us);
        if is_restart {
            *self = Self::default();
        }
        self.latest_us[kind] = Some(instant_us);
        is_restart
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::Role;

    const HELLO: Hello = Hello::new(Role::Sensor, "stm32f429zi", [0, 1, 0]);
    const S: u64 = 1_000_000;

    fn heard(at_us: u64, bytes: &[u8]) -> LineMonitor {
        let mut line_monitor = LineMonitor::new(0, PATIENCE_US);
        line_monitor.hear(at_us, bytes);
        line_monitor
    }

    fn verdict(line_monitor: &mut LineMonitor, at_us: u64) -> Verdict {
        line_monitor.judge(at_us, Peer::Silent)
    }

    #[test]
    fn nothing_is_said_of_a_line_before_it_had_time_to_answer() {
        assert_eq!(
            verdict(&mut heard(S, &[0x80; 99]), PATIENCE_US),
            Verdict::Open
        );
        assert_eq!(
            verdict(&mut heard(S, &[0x80; 99]), PATIENCE_US + 1),
            Verdict::Garbage
        );
    }

    #[test]
    fn text_is_told_from_garbage_and_from_silence() {
        let line = b"lambda 2.03 mm, v 70 mm/s\r\n\0";
        assert_eq!(verdict(&mut heard(S, line), 2 * S), Verdict::Deaf);
        let mut disturbed = *line;
        disturbed[3] = 0xff;
        assert_eq!(verdict(&mut heard(S, &disturbed), 2 * S), Verdict::Deaf);
        disturbed[..9].fill(0xff);
        assert_eq!(verdict(&mut heard(S, &disturbed), 2 * S), Verdict::Garbage);
        assert_eq!(verdict(&mut heard(S, b""), 2 * S), Verdict::Silent);
    }

    #[test]
    fn text_without_a_boards_ends_of_lines_and_zeros_alone_are_no_board() {
        let other = b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M\r\n";
        assert_eq!(verdict(&mut heard(S, other), 2 * S), Verdict::Garbage);
        assert_eq!(verdict(&mut heard(S, &[0; 99]), 2 * S), Verdict::Garbage);
        // The line that a board has just begun is its line.
        let mut line_monitor = heard(S, b"a line of text\r\n\0");
        for at_us in [3 * S, 5 * S] {
            line_monitor.hear(at_us, b"and half of anoth");
        }
        assert_eq!(verdict(&mut line_monitor, 5 * S), Verdict::Deaf);
    }

    #[test]
    fn a_board_that_starts_anew_in_the_middle_of_its_frames_is_no_garbage() {
        let mut line_monitor = heard(S, &[0x80; 9_000]);
        line_monitor.hear(9 * S, &[0x80; 9_000]);
        line_monitor.hear(
            9 * S + 1,
            b"ridgelink display 0.1.0, started by reset pin\r\n\0",
        );
        let text_us = 9 * S + 1;
        let judge = |line_monitor: &mut LineMonitor, at_us| line_monitor.judge(at_us, Peer::Text);
        assert_eq!(judge(&mut line_monitor, text_us), Verdict::Open);
        let late_us = text_us + PATIENCE_US;
        assert_eq!(judge(&mut line_monitor, late_us), Verdict::Open);
        line_monitor.hear(late_us, b"a line of text\r\n");
        assert_eq!(judge(&mut line_monitor, late_us + 1), Verdict::Deaf);
        line_monitor.hear(late_us + 1, &[0x80; 99]);
        assert_eq!(judge(&mut line_monitor, late_us + 1), Verdict::Garbage);
    }

    #[test]
    fn frames_of_somebody_who_does_not_answer_are_no_garbage() {
        let counters = PortCounters {
            unheralded: 1,
            ..PortCounters::new()
        };
        let mut line_monitor = heard(S, &[0x80; 99]);
        line_monitor.understand(S, &counters);
        assert_eq!(verdict(&mut line_monitor, 2 * S), Verdict::Deaf);
        // Later it may be something else.
        for at_us in [3 * S, 5 * S] {
            line_monitor.hear(at_us, &[0x80; 99]);
            line_monitor.understand(at_us, &counters);
        }
        assert_eq!(verdict(&mut line_monitor, 5 * S), Verdict::Garbage);
    }

    #[test]
    fn a_board_is_known_for_as_long_as_it_is_understood() {
        let mut line_monitor = heard(S, &[1; 40]);
        let counters = PortCounters {
            received: 1,
            ..PortCounters::new()
        };
        line_monitor.understand(S, &counters);
        let mut judge = |at_us: u64, bytes: &[u8]| {
            line_monitor.hear(at_us, bytes);
            line_monitor.understand(at_us, &counters);
            line_monitor.judge(at_us, Peer::Known(HELLO))
        };
        assert_eq!(judge(S + SILENCE_US, b""), Verdict::Known(HELLO));
        assert_eq!(judge(S + SILENCE_US + 1, b""), Verdict::Garbage);
        assert_eq!(judge(S + 2 * SILENCE_US, b""), Verdict::Silent);
        assert_eq!(judge(9 * S, b"a line of text\r\n"), Verdict::Deaf);
    }

    #[test]
    fn a_foreign_board_that_is_gone_is_silent() {
        let mut line_monitor = heard(S, &[1; 40]);
        let judge =
            |line_monitor: &mut LineMonitor, at_us| line_monitor.judge(at_us, Peer::Foreign(HELLO));
        assert_eq!(
            judge(&mut line_monitor, S + SILENCE_US),
            Verdict::Foreign(HELLO)
        );
        line_monitor.hear(S + SPAN_US, b"");
        line_monitor.hear(S + 2 * SPAN_US, b"");
        assert_eq!(judge(&mut line_monitor, S + 2 * SPAN_US), Verdict::Silent);
    }

    #[test]
    fn a_ping_is_due_at_once_and_then_once_a_second() {
        let mut line_monitor = LineMonitor::new(0, PATIENCE_US);
        let due: Vec<bool> = [5, 6, PING_US + 4, PING_US + 5, PING_US + 6]
            .map(|at_us| line_monitor.ping_due(at_us))
            .into();
        assert_eq!(due, [true, false, false, true, false]);
    }
}

#[cfg(test)]
mod restart_tests {
    use super::*;
    use protocol::{Motion, Pong};

    fn motion(instant_us: u64) -> Message {
        Message::Motion(Motion {
            sequence: 0,
            instant_us,
            position_um: 0,
            velocity_um_s: 0,
        })
    }

    fn pong(received_us: u64) -> Message {
        Message::Pong(Pong {
            sent_us: 0,
            received_us,
            answered_us: received_us,
        })
    }

    #[test]
    fn a_clock_that_steps_back_has_begun_again_and_is_told_of_once() {
        let mut clock = BoardClock::default();
        let told = [
            motion(9_000_000),
            pong(9_010_000),
            motion(9_002_000),
            motion(700),
            pong(900),
            motion(2_700),
        ]
        .map(|message| clock.is_restart(&message));
        assert_eq!(told, [false, false, false, true, false, false]);
    }

    #[test]
    fn little_steps_are_none() {
        let mut clock = BoardClock::default();
        assert!(!clock.is_restart(&motion(9_000_000)));
        assert!(!clock.is_restart(&motion(9_000_000 - STEP_US)));
        assert!(clock.is_restart(&motion(9_000_000 - 2 * STEP_US - 1)));
    }
}
