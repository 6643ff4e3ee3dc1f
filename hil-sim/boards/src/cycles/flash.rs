//! The STM32F4's flash and the accelerator before it (RM0090, 3.5).

use std::collections::VecDeque;

/// At 168 MHz and 2.7 to 3.6 V (RM0090, table 11).
const WAIT_STATES: u64 = 5;
/// What is read at once, in bytes: 128 bits.
const LINE: u64 = 16;
const INSTRUCTION_LINES: usize = 64;
const DATA_LINES: usize = 8;

/// Lines that are kept, the one used longest ago given up first.
#[derive(Debug)]
struct Cache {
    /// The last used one at the end.
    lines: VecDeque<u64>,
    room: usize,
}

impl Cache {
    fn new(room: usize) -> Self {
        Self {
            lines: VecDeque::with_capacity(room + 1),
            room,
        }
    }

    /// Whether the line is there, from now on the last used one.
    fn has(&mut self, line: u64) -> bool {
        let Some(place) = self.lines.iter().rposition(|&kept| kept == line) else {
            return false;
        };
        self.lines.remove(place);
        self.lines.push_back(line);
        true
    }

    fn keep(&mut self, line: u64) {
        self.lines.push_back(line);
        if self.lines.len() > self.room {
            self.lines.pop_front();
        }
    }
}

/// Knows how long the processor waits for what it reads.
#[derive(Debug)]
pub struct Flash {
    accelerated: bool,
    instructions: Cache,
    data: Cache,
    /// The line that instructions come from.
    current: Option<u64>,
    /// Since which cycle the line after it is being read, if it is.
    ahead_since: u64,
}

impl Flash {
    /// With nothing in its caches. `accelerated`: PRFTEN, ICEN and DCEN are set.
    pub fn new(accelerated: bool) -> Self {
        Self {
            accelerated,
            instructions: Cache::new(INSTRUCTION_LINES),
            data: Cache::new(DATA_LINES),
            current: None,
            ahead_since: 0,
        }
    }

    /// Cycles to wait for the instruction at `address`, which is wanted at cycle `now`.
    pub fn fetch(&mut self, address: u64, now: u64) -> u64 {
        let line = address / LINE;
        if self.current == Some(line) {
            return 0;
        }
        let follows = self.current == Some(line.wrapping_sub(1));
        self.current = Some(line);
        let waits = if !self.accelerated {
            WAIT_STATES
        } else if self.instructions.has(line) {
            0
        } else if follows {
            // It was read while the line before it was worked through; what comes so is not kept.
            (WAIT_STATES + 1).saturating_sub(now - self.ahead_since)
        } else {
            self.instructions.keep(line);
            WAIT_STATES
        };
        self.ahead_since = now + waits;
        waits
    }

    /// Cycles to wait for a constant at `address`.
    pub fn read(&mut self, address: u64) -> u64 {
        let line = address / LINE;
        if self.accelerated && self.data.has(line) {
            return 0;
        }
        if self.accelerated {
            self.data.keep(line);
        }
        WAIT_STATES
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_way_waits_only_for_what_reading_ahead_does_not_hide() {
        let mut flash = Flash::new(true);
        assert_eq!(flash.fetch(0, 0), 5);
        assert_eq!(flash.fetch(14, 8), 0);
        // Four cycles in a line of six.
        assert_eq!(flash.fetch(16, 9), 2);
        assert_eq!(flash.fetch(32, 30), 0);
    }

    #[test]
    fn a_line_that_was_waited_for_is_kept_until_sixty_four_others_were() {
        let mut flash = Flash::new(true);
        for line in (0..64).map(|line| line * 2 * LINE) {
            assert_eq!(flash.fetch(line, 0), 5);
        }
        assert_eq!(flash.fetch(0, 0), 0);
        assert_eq!(flash.fetch(64 * 2 * LINE, 0), 5);
        assert_eq!(flash.fetch(0, 0), 0);
        // The second one had not been used since.
        assert_eq!(flash.fetch(2 * LINE, 0), 5);
    }

    #[test]
    fn without_the_accelerator_every_line_and_every_constant_is_waited_for() {
        let mut flash = Flash::new(false);
        for _ in 0..2 {
            assert_eq!(flash.fetch(0, 0), 5);
            assert_eq!(flash.fetch(16, 100), 5);
            assert_eq!(flash.read(64), 5);
        }
    }
}
