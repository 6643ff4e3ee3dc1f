//! Which frames came, which are missing, and which came too late or twice.

/// How far back a late frame is told from a duplicate, in frames: about 0.5 s of a display's traffic.
pub(crate) const WINDOW: u16 = 256;
/// Good frames in a row, all from beyond the window, after which the stream is taken to go on there:
/// a peer that was cut off for half a turn of the counter must not be late for ever. The idea is
/// RFC 3550's (appendix A.1), with more frames, because a network may deliver a few very old ones.
const STRAYS: u8 = 8;

const WORDS: usize = WINDOW as usize / 32;

/// What a frame's number says about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Arrival {
    /// Newer than all before, after `lost` frames that have not come.
    Fresh { lost: u16 },
    /// A newer one came before. `filled`: it had been counted as lost.
    Late { filled: bool },
    /// It came before.
    Duplicate,
}

/// The recent past of one direction's frame numbers, which wrap at 2¹⁶.
pub(crate) struct Sequences {
    /// The newest number, once there is one.
    newest: Option<u16>,
    /// Bit n % 256 set: the recent number n was skipped and is still missing.
    missing: [u32; WORDS],
    /// How many numbers before the newest belong to this stream, below [`WINDOW`].
    depth: u16,
    /// Frames in a row from beyond the window.
    strays: u8,
}

impl Sequences {
    pub(crate) const fn new() -> Self {
        Self {
            newest: None,
            missing: [0; WORDS],
            depth: 0,
            strays: 0,
        }
    }

    /// Starts anew at `sequence`: what was before is another stream's.
    pub(crate) fn restart(&mut self, sequence: u16) {
        *self = Self {
            newest: Some(sequence),
            ..Self::new()
        };
    }

    /// Notes that a good frame came.
    pub(crate) fn note(&mut self, sequence: u16) -> Arrival {
        let Some(newest) = self.newest else {
            self.restart(sequence);
            return Arrival::Fresh { lost: 0 };
        };
        let ahead = sequence.wrapping_sub(newest);
        if (1..1 << 15).contains(&ahead) {
            self.strays = 0;
            self.advance(newest, ahead);
            return Arrival::Fresh { lost: ahead - 1 };
        }
        let behind = newest.wrapping_sub(sequence);
        if behind >= WINDOW {
            self.strays += 1;
            if self.strays < STRAYS {
                return Arrival::Late { filled: false };
            }
            self.restart(sequence);
            return Arrival::Fresh { lost: 0 };
        }
        self.strays = 0;
        if behind > self.depth {
            // From before the first frame that was heard: it was never counted as lost.
            Arrival::Late { filled: false }
        } else if self.is_missing(sequence) {
            self.set_missing(sequence, false);
            Arrival::Late { filled: true }
        } else {
            Arrival::Duplicate
        }
    }

    /// Notes a Hello, which a peer that was restarted says first, numbering from 0 again.
    ///
    /// Only one who has not been answered yet `asks`, so an asking Hello under an old number is a
    /// restart, unless it fills a gap; one from outside of the window always is. A network that
    /// delivers an asking Hello twice can thus raise `lost` by the few frames in between.
    pub(crate) fn note_hello(&mut self, sequence: u16, asks: bool) -> Arrival {
        let newest = self.newest;
        let arrival = self.note(sequence);
        let outside = newest.is_some_and(|newest| {
            sequence.wrapping_sub(newest) >= WINDOW && newest.wrapping_sub(sequence) >= WINDOW
        });
        let restarted = match arrival {
            Arrival::Fresh { .. } | Arrival::Late { filled: true } => outside,
            Arrival::Late { filled: false } | Arrival::Duplicate => outside || asks,
        };
        if restarted {
            self.restart(sequence);
            return Arrival::Fresh { lost: 0 };
        }
        arrival
    }

    /// Notes a Stop, or the answer to one, which may be of somebody who says nothing else and numbers for
    /// himself: a number from far off is no part of this stream.
    pub(crate) fn note_stop(&mut self, sequence: u16) -> Arrival {
        match self.newest {
            Some(newest)
                if sequence.wrapping_sub(newest) < WINDOW
                    || newest.wrapping_sub(sequence) < WINDOW =>
            {
                self.note(sequence)
            }
            _ => Arrival::Fresh { lost: 0 },
        }
    }

    /// Moves the newest number on by `ahead`; what is skipped is missing.
    fn advance(&mut self, newest: u16, ahead: u16) {
        let sequence = newest.wrapping_add(ahead);
        // Beyond a window's length, older bits would only be overwritten.
        for back in 1..ahead.min(WINDOW) {
            self.set_missing(sequence.wrapping_sub(back), true);
        }
        self.set_missing(sequence, false);
        self.newest = Some(sequence);
        self.depth = self.depth.saturating_add(ahead).min(WINDOW - 1);
    }

    fn is_missing(&self, sequence: u16) -> bool {
        let (word, bit) = place(sequence);
        self.missing[word] & bit != 0
    }

    fn set_missing(&mut self, sequence: u16, missing: bool) {
        let (word, bit) = place(sequence);
        if missing {
            self.missing[word] |= bit;
        } else {
            self.missing[word] &= !bit;
        }
    }
}

/// Word and bit of a number in the ring of the recent ones; 2¹⁶ is a multiple of its length.
const fn place(sequence: u16) -> (usize, u32) {
    let at = sequence % WINDOW;
    (at as usize / 32, 1 << (at % 32))
}
