//! Looks into the converters: whether they hold what they were given.
//!
//! A streaming chip does not answer (TI's forum: SDO is silent), so a look takes four frames: streaming
//! off, ask, ask again with the first answer coming back, streaming on with the second. Every
//! [`PERIOD_MS`] one chip is looked into, so each of the four within 8 ms: its last channel in use,
//! whose word is the last of its frame and the first to be missing when a frame was cut short or not
//! heard; and one thing more. That is, every other time, whether its channels are powered, which a chip
//! that has lost its supply has them not be though it may still take broadcasts; else one thing in turn,
//! so that within [`ROUND_MS`] all its channels, and all its settings that can be read, have been seen.
//!
//! What is read is a channel's buffer. That LDAC moved it to the output can't be read; the board looks
//! at LDAC's own level instead.

use protocol::UpdateRate;

use crate::dac81416::{
    self, ALL_CHANNELS, CHANNELS, CHANNELS_PER_CHIP, CHIPS, FRAME_CHANNELS, NO_CHANNEL, PRODUCT,
    REFERENCE_ON, register, spiconfig,
};
use crate::pace::{per_tick, quarters};
use crate::senses::ConverterFault;
use crate::{ACTUATORS, ZERO_VOLT};

/// Between two looks, in ms.
pub const PERIOD_MS: u32 = 2;
/// Frames of a look.
pub const FRAMES: usize = 4;
/// A frame, or what came back with one.
pub type Bytes = [u8; 3];

/// A register and what is to be in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Content {
    /// The register's address.
    pub register: u8,
    /// The bits that count.
    pub mask: u16,
    /// What they are to be.
    pub want: u16,
}

impl Content {
    const fn all(register: u8, want: u16) -> Self {
        Self {
            register,
            mask: u16::MAX,
            want,
        }
    }

    const fn of_channel(channel: usize, want: u16) -> Self {
        Self::all(register::DAC0 + channel as u8, want)
    }

    /// What a chip's register holds, from what came back with the frame after the question; nothing
    /// if it is no answer to it.
    fn got(&self, answer: Bytes) -> Option<u16> {
        let [echo, high, low] = answer;
        (echo == register::READ | self.register).then_some(u16::from_be_bytes([high, low]))
    }

    /// Whether `answer` says so.
    pub fn is_in(&self, answer: Bytes) -> bool {
        self.got(answer)
            .is_some_and(|got| got & self.mask == self.want)
    }
}

const STATUS_CRC_ALARM: u16 = 1 << 2;
const STATUS_TEMPERATURE_ALARM: u16 = 1 << 0;
/// DEVICEID without the silicon's version.
const PRODUCT_BITS: u16 = 0xFFFC;

/// What a chip that answers is to hold, apart from its channels. The ranges can't be read.
pub const SETTINGS: [Content; 9] = [
    Content {
        register: register::DEVICEID,
        mask: PRODUCT_BITS,
        want: PRODUCT << 2,
    },
    Content::all(register::SPICONFIG, spiconfig::ANSWERING),
    Content::all(register::GENCONFIG, REFERENCE_ON),
    Content::all(register::BRDCONFIG, FRAME_CHANNELS),
    Content::all(register::SYNCCONFIG, ALL_CHANNELS),
    Content::all(register::TOGGCONFIG0, 0),
    Content::all(register::TOGGCONFIG1, 0),
    POWERED,
    Content {
        register: register::STATUS,
        mask: STATUS_CRC_ALARM | STATUS_TEMPERATURE_ALARM,
        want: 0,
    },
];

/// All channels are powered.
const POWERED: Content = Content::all(register::DACPWDWN, NO_CHANNEL);

/// Everything that a chip is to hold after start-up, before it is driven for the first time.
pub fn at_start() -> impl Iterator<Item = Content> {
    let channels = (0..CHANNELS).map(|channel| Content::of_channel(channel, ZERO_VOLT));
    SETTINGS.into_iter().chain(channels)
}

/// Judges what `chip` answered when it was asked for `content`.
///
/// # Errors
/// What was to be there, and what was said to be.
pub fn check(chip: usize, content: &Content, answer: Bytes) -> Result<(), ConverterFault> {
    if content.is_in(answer) {
        return Ok(());
    }
    let [_, high, low] = answer;
    Err(ConverterFault::Register {
        chip: chip as u8,
        register: content.register,
        want: content.want,
        got: u16::from_be_bytes([high, low]),
    })
}

/// One look into one chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// The chip.
    pub chip: usize,
    contents: [Content; 2],
}

impl Look {
    /// The frames to send, a chip select each.
    pub fn frames(&self) -> [Bytes; FRAMES] {
        let [first, second] = self.contents;
        [
            dac81416::ANSWER,
            dac81416::read(first.register),
            dac81416::read(second.register),
            dac81416::STREAM,
        ]
    }

    /// Whether what came back with each frame says that all is as it should be.
    pub fn agrees(&self, answers: &[Bytes; FRAMES]) -> bool {
        let [_, _, first, second] = *answers;
        self.contents[0].is_in(first) && self.contents[1].is_in(second)
    }
}

/// Channels in use of `chip`, from its first on.
const fn used_channels(chip: usize) -> usize {
    if chip + 1 < CHIPS {
        CHANNELS_PER_CHIP
    } else {
        ACTUATORS - (CHIPS - 1) * CHANNELS_PER_CHIP
    }
}

/// Channels besides the last, and settings, each in its turn.
const TURNS: usize = CHANNELS_PER_CHIP - 1 + SETTINGS.len();
/// Time in ms within which everything that can be read has been.
pub const ROUND_MS: u32 = 2 * (TURNS * CHIPS) as u32 * PERIOD_MS;

/// Whose turn it is, when, and for what. A configuration does not begin it anew: one after the other would put off
/// what comes late in a round.
#[derive(Clone, Debug, Default)]
pub struct Rounds {
    /// Since the last look, in quarters of a millisecond.
    waited: u32,
    chip: usize,
    turn: usize,
    /// Whether power is looked at, instead of what has its turn.
    power: bool,
}

impl Rounds {
    /// A tick at `rate`, with chips that were given `words`: a look into one of them, if it is due. In a tick that is not
    /// `quiet` there can be none; it comes with the next one that is.
    pub fn tick(
        &mut self,
        rate: UpdateRate,
        quiet: bool,
        words: &[u16; ACTUATORS],
    ) -> Option<Look> {
        self.waited = self.waited.saturating_add(per_tick(rate));
        if self.waited < quarters(PERIOD_MS) || !quiet {
            return None;
        }
        self.waited = 0;
        Some(self.next(words))
    }

    fn next(&mut self, words: &[u16; ACTUATORS]) -> Look {
        let chip = self.chip;
        let words = words.chunks(CHANNELS_PER_CHIP).nth(chip).unwrap_or(&[]);
        let channel = |channel: usize| {
            let want = words.get(channel).copied().unwrap_or(ZERO_VOLT);
            Content::of_channel(channel, want)
        };
        let last = used_channels(chip) - 1;
        let second = match SETTINGS.get(self.turn) {
            _ if self.power => POWERED,
            Some(setting) => *setting,
            None => channel((self.turn - SETTINGS.len()) % last),
        };
        let look = Look {
            chip,
            contents: [channel(last), second],
        };
        self.chip = (chip + 1) % CHIPS;
        if self.chip == 0 {
            if self.power {
                self.turn = (self.turn + 1) % TURNS;
            }
            self.power = !self.power;
        }
        look
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WORDS: [u16; ACTUATORS] = {
        let mut words = [0; ACTUATORS];
        let mut actuator = 0;
        while actuator < ACTUATORS {
            words[actuator] = 0x4000 + actuator as u16;
            actuator += 1;
        }
        words
    };

    #[test]
    fn a_look_is_these_bytes() {
        let mut rounds = Rounds::default();
        let frames = [
            [0x03, 0x0A, 0x84],
            [0x9C, 0, 0],
            [0x81, 0, 0],
            [0x03, 0x0A, 0x8C],
        ];
        assert_eq!(rounds.next(&WORDS).frames(), frames);
    }

    #[test]
    fn a_look_agrees_only_with_the_right_answers_to_its_questions() {
        let look = Rounds::default().next(&WORDS);
        let right = [[0xFF; 3], [0; 3], [0x9C, 0x40, 12], [0x81, 0x0A, 0x70]];
        assert!(look.agrees(&right));
        // The silicon's version does not count, anything else does.
        let mut other = right;
        other[3][2] |= 0b11;
        assert!(look.agrees(&other));
        for (frame, byte, bit) in (2..4)
            .flat_map(|frame| (0..3).map(move |byte| (frame, byte)))
            .flat_map(|(frame, byte)| (0..8).map(move |bit| (frame, byte, bit)))
            .filter(|&at| !matches!(at, (3, 2, 0 | 1)))
        {
            let mut wrong = right;
            wrong[frame][byte] ^= 1 << bit;
            assert!(
                !look.agrees(&wrong),
                "frame {frame}, byte {byte}, bit {bit}"
            );
        }
        // A wire that hangs low or high says nothing.
        assert!(!look.agrees(&[[0; 3]; FRAMES]));
        assert!(!look.agrees(&[[0xFF; 3]; FRAMES]));
    }

    #[test]
    fn a_look_that_is_due_while_there_is_no_quiet_comes_with_the_next_quiet_tick() {
        let mut rounds = Rounds::default();
        let mut chips = std::vec::Vec::new();
        for tick in 1..=40 {
            // Each that would be one after 2 ms.
            let quiet = tick % 4 != 0;
            let look = rounds.tick(UpdateRate::Hz2000, quiet, &WORDS);
            chips.extend(look.map(|look| look.chip));
        }
        assert_eq!(chips, [0, 1, 2, 3, 0, 1, 2, 3, 0]);
    }

    #[test]
    fn a_look_comes_every_two_milliseconds_whatever_becomes_of_the_rate() {
        let mut rounds = Rounds::default();
        let rates = [UpdateRate::Hz2000, UpdateRate::Hz4000];
        let (mut waited, mut looks) = (0, 0);
        for tick in 0..4_000 {
            let rate = rates[tick / 3 % 2];
            waited += per_tick(rate);
            if rounds.tick(rate, true, &WORDS).is_some() {
                // A tick of two quarters may end it a quarter late.
                assert!((8..=9).contains(&waited), "{tick}: {waited}");
                (waited, looks) = (0, looks + 1);
            }
        }
        assert!(looks > 600, "{looks}");
    }

    #[test]
    fn every_chip_is_looked_into_in_turn_and_its_last_word_each_time() {
        let mut rounds = Rounds::default();
        for look in 0..3 * CHIPS {
            let Look { chip, contents } = rounds.next(&WORDS);
            assert_eq!(chip, look % CHIPS);
            let last = (chip * CHANNELS_PER_CHIP + CHANNELS_PER_CHIP).min(ACTUATORS) - 1;
            assert_eq!(contents[0].want, WORDS[last]);
            assert_eq!(
                usize::from(contents[0].register - register::DAC0),
                last - chip * CHANNELS_PER_CHIP
            );
        }
    }

    #[test]
    fn every_chips_power_is_looked_at_within_sixteen_milliseconds() {
        let mut rounds = Rounds::default();
        let mut last_ms = [0; CHIPS];
        for at_ms in (0..2 * ROUND_MS).step_by(PERIOD_MS as usize) {
            let Look { chip, contents } = rounds.next(&WORDS);
            if contents[1] == POWERED {
                assert!(at_ms - last_ms[chip] <= 16, "{at_ms}");
                last_ms[chip] = at_ms;
            }
        }
        assert!(last_ms.iter().all(|&last| 2 * ROUND_MS - last <= 16));
    }

    #[test]
    fn a_round_sees_every_word_and_every_setting_of_every_chip() {
        let mut rounds = Rounds::default();
        let mut seen = std::collections::BTreeSet::new();
        for _ in 0..ROUND_MS / PERIOD_MS {
            let Look { chip, contents } = rounds.next(&WORDS);
            for content in contents {
                seen.insert((chip, content.register, content.want));
            }
        }
        for (actuator, word) in WORDS.into_iter().enumerate() {
            let (chip, channel) = dac81416::place_of(actuator);
            assert!(seen.contains(&(chip, register::DAC0 + channel as u8, word)));
        }
        for chip in 0..CHIPS {
            for setting in SETTINGS {
                assert!(seen.contains(&(chip, setting.register, setting.want)));
            }
        }
        assert_eq!(seen.len(), ACTUATORS + CHIPS * SETTINGS.len());
    }

    #[test]
    fn what_start_up_writes_is_what_is_looked_for() {
        for content in at_start() {
            let write = dac81416::write(content.register, content.want);
            let is_read_only = matches!(content.register, register::DEVICEID | register::STATUS);
            assert_eq!(!is_read_only, dac81416::START_UP.contains(&write));
        }
    }

    #[test]
    fn a_wrong_answer_at_start_says_what_was_to_be_there() {
        let content = Content::all(register::SYNCCONFIG, ALL_CHANNELS);
        assert_eq!(check(2, &content, [0x86, 0xFF, 0xFF]), Ok(()));
        let fault = ConverterFault::Register {
            chip: 2,
            register: 0x06,
            want: 0xFFFF,
            got: 0,
        };
        assert_eq!(check(2, &content, [0x86, 0, 0]), Err(fault));
    }
}
