//! The DAC81416: what is written to the four chips at start-up and at every output tick.
//!
//! Facts are from TI's datasheet SLASEO0 as published drivers for the chip carry them, and from TI's
//! forum where said; none of it has been tried on silicon here.
//!
//! SPI mode 1 (clock idles low, data taken at the falling edge), most significant bit first, at 42 MHz
//! (the STM32F429's SPI1 at 84 MHz / 2; the chip takes 50 MHz), and read at a quarter of that. A write is three bytes under one chip select: the
//! register's address, then 16 bits of data. Bit 7 of the address byte asks for a read; the answer
//! comes with the next frame, unless the chip is streaming: see [`crate::look`].
//!
//! With streaming enabled the chip select may stay low after the first word: each further word goes
//! to the next address. So one frame carries all of a chip's channels, and one falling edge of LDAC,
//! common to the four chips, makes all of them voltages. Where a chip's words are all equal, as in the
//! paper's uniform drive, a frame with a single broadcast word says the same in three bytes instead of 27:
//! it fills the same buffers, and they wait for LDAC alike (SLASEO0B, 8.3.1.2.2).

use crate::{ACTUATORS, ZERO_VOLT};

/// Chips on the board, a chip select each.
pub const CHIPS: usize = 4;
/// Channels used of each chip; the last chip drives the remaining 11, and nothing is wired to its other
/// two.
pub const CHANNELS_PER_CHIP: usize = 13;
/// Bytes of a chip's longest frame: the first channel's address, then its channels' words.
pub const FRAME_BYTES: usize = 1 + 2 * CHANNELS_PER_CHIP;

const _: () = assert!(CHIPS * CHANNELS_PER_CHIP >= ACTUATORS);
const _: () = assert!((CHIPS - 1) * CHANNELS_PER_CHIP < ACTUATORS);

/// Channels that the chip has (DAC0 to DAC15).
pub const CHANNELS: usize = 16;
/// Fastest SPI clock used, in Hz.
pub const MAX_CLOCK_HZ: u32 = 42_000_000;
/// DEVICEID bits 15 to 2 of a DAC81416 (0x29C).
pub const PRODUCT: u16 = 668;

/// Registers (SLASEO0, register map).
pub mod register {
    /// Does nothing; written to clock a read's answer out.
    pub const NOP: u8 = 0x00;
    /// Bits 15–2: [`super::PRODUCT`]; bits 1–0: the silicon's version. Read only.
    pub const DEVICEID: u8 = 0x01;
    /// Bit 2 CRC-ALM, bit 1 DAC-BUSY, bit 0 TEMP-ALM. Read only.
    pub const STATUS: u8 = 0x02;
    /// The interface: see [`super::spiconfig`]. 0x0AA4 after a reset.
    pub const SPICONFIG: u8 = 0x03;
    /// Bit 14 REF-PWDWN: the internal 2.5 V reference is off; bits 7–0: differential pairs.
    /// 0x7F00 after a reset.
    pub const GENCONFIG: u8 = 0x04;
    /// Bit c: channel c follows [`BRDCAST`].
    pub const BRDCONFIG: u8 = 0x05;
    /// Bit c: channel c changes on LDAC (1) or as soon as it is written (0). 0 after a reset.
    pub const SYNCCONFIG: u8 = 0x06;
    /// Two bits a channel, DAC15 to DAC8: toggle mode, 0 for none.
    pub const TOGGCONFIG0: u8 = 0x07;
    /// Two bits a channel, DAC7 to DAC0: toggle mode, 0 for none.
    pub const TOGGCONFIG1: u8 = 0x08;
    /// Bit c: channel c is powered down and held to ground through 10 kΩ. 0xFFFF after a reset.
    pub const DACPWDWN: u8 = 0x09;
    /// First of four: ranges of DAC15 to DAC12, then DAC11 to DAC8, DAC7 to DAC4, DAC3 to DAC0, four
    /// bits a channel. Write only.
    pub const DACRANGE0: u8 = 0x0A;
    /// Bit 8 resets alarms, bit 4 loads all synchronous channels as LDAC does, bits 3–0 = 0b1010
    /// reset the chip. Write only.
    pub const TRIGGER: u8 = 0x0E;
    /// A word for all channels named in [`BRDCONFIG`].
    pub const BRDCAST: u8 = 0x0F;
    /// Channel 0's word; channel c's is at `DAC0 + c`.
    pub const DAC0: u8 = 0x10;
    /// Bit 7 of the address byte: read instead of write.
    pub const READ: u8 = 0x80;
}

/// Bits of [`register::SPICONFIG`].
pub mod spiconfig {
    /// ALMOUT tells of overheating (140 °C).
    pub const TEMPALM_EN: u16 = 1 << 11;
    /// ALMOUT tells of CRC errors.
    pub const CRCALM_EN: u16 = 1 << 9;
    /// Reserved, 1 after a reset, kept.
    pub const RESERVED: u16 = 1 << 7;
    /// The whole device is powered down.
    pub const DEV_PWDWN: u16 = 1 << 5;
    /// Frames carry a CRC-8.
    pub const CRC_EN: u16 = 1 << 4;
    /// Streaming: addresses count up while the chip select stays low.
    pub const STR_EN: u16 = 1 << 3;
    /// SDO answers reads. TI's forum: it stays silent while streaming is enabled all the same.
    pub const SDO_EN: u16 = 1 << 2;

    /// Active, alarms on, no CRC, answering, not streaming: for start-up and for reading back.
    pub const ANSWERING: u16 = TEMPALM_EN | CRCALM_EN | RESERVED | SDO_EN;
    /// The same, streaming: for the output ticks.
    pub const STREAMING: u16 = ANSWERING | STR_EN;
}

/// [`register::GENCONFIG`]: reference on, no differential pairs, reserved bits as after a reset.
pub(crate) const REFERENCE_ON: u16 = 0x3F00;
/// ±5 V for four channels.
const RANGES_BIPOLAR_5_V: u16 = 0x9999;
pub(crate) const ALL_CHANNELS: u16 = 0xFFFF;
/// The channels of [`Frame`]; the others stay at 0 V.
pub(crate) const FRAME_CHANNELS: u16 = (1 << CHANNELS_PER_CHIP) - 1;
pub(crate) const NO_CHANNEL: u16 = 0x0000;
/// Bit 4 of [`register::TRIGGER`].
const TRIGGER_LDAC: u16 = 1 << 4;

/// A write of `value` to `register`.
pub const fn write(register: u8, value: u16) -> [u8; 3] {
    let [high, low] = value.to_be_bytes();
    [register, high, low]
}

/// A read of `register`; its answer comes with the next frame, while streaming is disabled.
pub const fn read(register: u8) -> [u8; 3] {
    [register::READ | register, 0, 0]
}

const WRITES_BEFORE_CODES: usize = 11;
const WRITES_AFTER_CODES: usize = 2;
/// Writes in [`START_UP`].
pub const START_UP_WRITES: usize = WRITES_BEFORE_CODES + CHANNELS + WRITES_AFTER_CODES;

/// The writes that take a chip from any state to fifty synchronous channels at 0 V, for each chip
/// alike, a chip select each. It answers then; [`STREAM`] makes it ready for frames.
///
/// In the order that keeps the skin quiet, whatever the chip did before (a watchdog restarts the
/// board, not the chip): channels off, ranges, 0 V in every channel's code and in force, and only
/// then channels on. The middle of a bipolar range is 0 V whatever the reference does meanwhile.
/// No software reset: it would not undo more, and its wait is one more thing to get wrong.
/// CLR is low throughout, which holds every code at 0 V by itself; they are written all the same, for
/// a CLR that does not arrive.
pub const START_UP: [[u8; 3]; START_UP_WRITES] = start_up_writes();

const fn start_up_writes() -> [[u8; 3]; START_UP_WRITES] {
    use register::*;
    let before: [[u8; 3]; WRITES_BEFORE_CODES] = [
        // Read right by a chip that is still streaming: a stream of one word.
        write(SPICONFIG, spiconfig::ANSWERING),
        write(DACPWDWN, ALL_CHANNELS),
        write(GENCONFIG, REFERENCE_ON),
        write(TOGGCONFIG0, 0),
        write(TOGGCONFIG1, 0),
        write(SYNCCONFIG, ALL_CHANNELS),
        write(BRDCONFIG, FRAME_CHANNELS),
        write(DACRANGE0, RANGES_BIPOLAR_5_V),
        write(DACRANGE0 + 1, RANGES_BIPOLAR_5_V),
        write(DACRANGE0 + 2, RANGES_BIPOLAR_5_V),
        write(DACRANGE0 + 3, RANGES_BIPOLAR_5_V),
    ];
    let after: [[u8; 3]; WRITES_AFTER_CODES] =
        [write(TRIGGER, TRIGGER_LDAC), write(DACPWDWN, NO_CHANNEL)];
    let mut writes = [[0; 3]; START_UP_WRITES];
    let mut at = 0;
    while at < START_UP_WRITES {
        writes[at] = if at < WRITES_BEFORE_CODES {
            before[at]
        } else if at < WRITES_BEFORE_CODES + CHANNELS {
            write(DAC0 + (at - WRITES_BEFORE_CODES) as u8, ZERO_VOLT)
        } else {
            after[at - WRITES_BEFORE_CODES - CHANNELS]
        };
        at += 1;
    }
    writes
}

/// The writes of [`START_UP`], in order.
pub fn start_up() -> impl Iterator<Item = [u8; 3]> {
    START_UP.into_iter()
}

/// The write after which a chip takes [`Frames`], and no longer answers.
pub const STREAM: [u8; 3] = write(register::SPICONFIG, spiconfig::STREAMING);
/// The write after which a chip answers, understood by one that is streaming: a stream of one word.
pub const ANSWER: [u8; 3] = write(register::SPICONFIG, spiconfig::ANSWERING);

/// The chip and channel that drive `actuator`.
pub const fn place_of(actuator: usize) -> (usize, usize) {
    (actuator / CHANNELS_PER_CHIP, actuator % CHANNELS_PER_CHIP)
}

/// What goes to a chip under one chip select at an output tick: a register's address, then a word for
/// each of its channels, or one for all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// The address byte to begin with.
    pub register: u8,
    /// The words that follow, 1 or [`CHANNELS_PER_CHIP`].
    pub words: &'a [u16],
}

/// The words of an output tick, as the four chips' frames take them: one copy, in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(align(4))]
pub struct Frames {
    /// Actuator i is channel i % 13 of chip i / 13. The last channels, which nothing is wired to, stay at
    /// 0 V; or get the one word that goes to all, if a chip's are equal.
    words: [u16; CHIPS * CHANNELS_PER_CHIP],
}

impl Frames {
    /// 0 V on each channel.
    pub const ZERO_VOLT: Self = Self {
        words: [ZERO_VOLT; CHIPS * CHANNELS_PER_CHIP],
    };

    /// Takes the words of a tick.
    pub fn set(&mut self, words: &[u16; ACTUATORS]) {
        if let Some(places) = self.words.first_chunk_mut() {
            *places = *words;
        }
    }

    /// What goes to each chip.
    pub fn each(&self) -> [Frame<'_>; CHIPS] {
        core::array::from_fn(|chip| {
            let start = chip * CHANNELS_PER_CHIP;
            let words = &self.words[start..start + CHANNELS_PER_CHIP];
            let used = &words[..CHANNELS_PER_CHIP.min(ACTUATORS - start)];
            if used.iter().all(|word| *word == used[0]) {
                Frame {
                    register: register::BRDCAST,
                    words: &words[..1],
                }
            } else {
                Frame {
                    register: register::DAC0,
                    words,
                }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn start_up_writes_are_these_bytes() {
        let literal: std::vec::Vec<[u8; 3]> = std::vec![
            [0x03, 0x0A, 0x84],
            [0x09, 0xFF, 0xFF],
            [0x04, 0x3F, 0x00],
            [0x07, 0x00, 0x00],
            [0x08, 0x00, 0x00],
            [0x06, 0xFF, 0xFF],
            [0x05, 0x1F, 0xFF],
            [0x0A, 0x99, 0x99],
            [0x0B, 0x99, 0x99],
            [0x0C, 0x99, 0x99],
            [0x0D, 0x99, 0x99],
            [0x10, 0x80, 0x00],
            [0x11, 0x80, 0x00],
            [0x12, 0x80, 0x00],
            [0x13, 0x80, 0x00],
            [0x14, 0x80, 0x00],
            [0x15, 0x80, 0x00],
            [0x16, 0x80, 0x00],
            [0x17, 0x80, 0x00],
            [0x18, 0x80, 0x00],
            [0x19, 0x80, 0x00],
            [0x1A, 0x80, 0x00],
            [0x1B, 0x80, 0x00],
            [0x1C, 0x80, 0x00],
            [0x1D, 0x80, 0x00],
            [0x1E, 0x80, 0x00],
            [0x1F, 0x80, 0x00],
            [0x0E, 0x00, 0x10],
            [0x09, 0x00, 0x00],
        ];
        assert_eq!(start_up().collect::<std::vec::Vec<_>>(), literal);
        assert_eq!(ANSWER, [0x03, 0x0A, 0x84]);
        assert_eq!(STREAM, [0x03, 0x0A, 0x8C]);
    }

    #[test]
    fn every_code_is_zero_volt_and_loaded_before_a_channel_is_powered() {
        let at = |write: [u8; 3]| START_UP.iter().position(|&other| other == write).unwrap();
        let power_up = at(write(register::DACPWDWN, NO_CHANNEL));
        let load = at(write(register::TRIGGER, TRIGGER_LDAC));
        for channel in 0..CHANNELS as u8 {
            assert!(at(write(register::DAC0 + channel, ZERO_VOLT)) < load);
        }
        assert!(load < power_up);
        assert_eq!(power_up, START_UP_WRITES - 1);
    }

    /// A frame as it goes over the wire.
    fn bytes(frame: &Frame<'_>) -> std::vec::Vec<u8> {
        let words = frame.words.iter().flat_map(|word| word.to_be_bytes());
        core::iter::once(frame.register).chain(words).collect()
    }

    fn frames_of(words: &[u16; ACTUATORS]) -> Frames {
        let mut frames = Frames::ZERO_VOLT;
        frames.set(words);
        frames
    }

    #[test]
    fn streaming_frames_are_these_bytes() {
        let frames = frames_of(&core::array::from_fn(|i| 0x4000 + i as u16));
        assert_eq!(
            bytes(&frames.each()[0]),
            [
                0x10, 0x40, 0x00, 0x40, 0x01, 0x40, 0x02, 0x40, 0x03, 0x40, 0x04, 0x40, 0x05, 0x40,
                0x06, 0x40, 0x07, 0x40, 0x08, 0x40, 0x09, 0x40, 0x0A, 0x40, 0x0B, 0x40, 0x0C,
            ]
        );
        assert_eq!(
            bytes(&frames.each()[1])[..5],
            [0x10, 0x40, 0x0D, 0x40, 0x0E]
        );
        assert_eq!(
            bytes(&frames.each()[2])[..5],
            [0x10, 0x40, 0x1A, 0x40, 0x1B]
        );
        assert_eq!(
            bytes(&frames.each()[3]),
            [
                0x10, 0x40, 0x27, 0x40, 0x28, 0x40, 0x29, 0x40, 0x2A, 0x40, 0x2B, 0x40, 0x2C, 0x40,
                0x2D, 0x40, 0x2E, 0x40, 0x2F, 0x40, 0x30, 0x40, 0x31, 0x80, 0x00, 0x80, 0x00,
            ]
        );
    }

    #[test]
    fn equal_words_are_these_three_bytes_a_chip() {
        for frame in &frames_of(&[0x1234; ACTUATORS]).each() {
            assert_eq!(bytes(frame), [0x0F, 0x12, 0x34]);
        }
        for frame in &Frames::ZERO_VOLT.each() {
            assert_eq!(bytes(frame), [0x0F, 0x80, 0x00]);
        }
    }

    #[test]
    fn only_a_chip_whose_words_all_agree_gets_a_broadcast() {
        for actuator in 0..ACTUATORS {
            let mut words = [0x1234; ACTUATORS];
            words[actuator] = 0x1235;
            let (chip, _) = place_of(actuator);
            for (c, frame) in frames_of(&words).each().iter().enumerate() {
                let length = if c == chip { FRAME_BYTES } else { 3 };
                assert_eq!(bytes(frame).len(), length, "chip {c}, actuator {actuator}");
            }
        }
    }

    #[test]
    fn each_actuator_has_a_channel_of_its_own_where_the_frame_puts_its_word() {
        for actuator in 0..ACTUATORS {
            let mut words = [ZERO_VOLT; ACTUATORS];
            words[actuator] = 0x1234;
            let (chip, channel) = place_of(actuator);
            for (c, frame) in frames_of(&words).each().iter().enumerate() {
                if c != chip {
                    assert_eq!(bytes(frame), [0x0F, 0x80, 0x00]);
                    continue;
                }
                for (n, bytes) in bytes(frame)[1..].chunks(2).enumerate() {
                    let expected = if n == channel {
                        [0x12, 0x34]
                    } else {
                        [0x80, 0]
                    };
                    assert_eq!(bytes, expected);
                }
            }
        }
    }

    #[test]
    fn four_frames_take_less_than_a_tenth_of_a_tick() {
        let bits = (CHIPS * FRAME_BYTES * 8) as u32;
        assert!(bits * 10 * crate::TICK_RATE_HZ < MAX_CLOCK_HZ);
    }
}
