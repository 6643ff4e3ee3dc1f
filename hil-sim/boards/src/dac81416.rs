//! TI's DAC81416, as the bytes and pins of its neighbours see it: sixteen 16-bit voltage outputs.
//!
//! Written from facts found in published drivers, in a TI forum thread on SDO in streaming mode, and
//! in the outline of the datasheet SLASEO0; never checked against silicon. Where drivers disagree
//! the choice made here is said at its place. It shares no code with the firmware, so the two can be
//! wrong together only where those facts are.
//!
//! Left out: the frame CRC (CRC-EN), toggle mode, differential mode, daisy chains, an external
//! reference, and everything analogue: settling, offset, gain, supplies. Whoever switches one of the
//! digital ones on finds a [`Fault::NotModelled`].
//!
//! A chip can be broken on purpose: see [`defect`].

pub mod defect;
pub mod fault;
pub mod register;

pub use defect::Defects;
pub use fault::Fault;

use register::{
    BRDCAST, BRDCONFIG, DAC0, DAC15, DACPWDWN, DACRANGE0, DACRANGE3, DEVICEID, GENCONFIG, NOP,
    OFFSET0, OFFSET3, SPICONFIG, STATUS, SYNCCONFIG, TOGGCONFIG0, TOGGCONFIG1, TRIGGER,
};

/// Outputs of one chip.
pub const CHANNELS: usize = 16;

/// DEVICEID's product field.
pub const PRODUCT: u16 = 668;

const READ: u8 = 0x80;
/// Address bits; the one between them and [`READ`] does not matter.
const ADDRESS: u8 = 0x3F;

const SPICONFIG_TEMPALM_EN: u16 = 1 << 11;
const STATUS_TEMP_ALM: u16 = 1 << 0;
const SPICONFIG_SOFTTOGGLE_EN: u16 = 1 << 6;
const SPICONFIG_DEV_PWDWN: u16 = 1 << 5;
const SPICONFIG_CRC_EN: u16 = 1 << 4;
const SPICONFIG_STR_EN: u16 = 1 << 3;
const SPICONFIG_SDO_EN: u16 = 1 << 2;
const GENCONFIG_REF_PWDWN: u16 = 1 << 14;
const GENCONFIG_DIFFERENTIAL: u16 = 0x00FF;
const TRIGGER_LDAC: u16 = 1 << 4;
const TRIGGER_SOFT_RESET: u16 = 0xF;

/// What SDO reads while nobody drives it.
const IDLE_HIGH: u8 = 0xFF;
/// Longest frame that can mean anything: an address, and a word for each register.
const FRAME: usize = 1 + 2 * (1 + OFFSET3 as usize);
/// Faults kept; the counters go on.
const FAULTS: usize = 32;

/// What one chip has seen since it was made; a reset clears none of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Frames with at least one byte.
    pub frames: u64,
    /// Frames of a wrong length.
    pub malformed: u64,
    /// Words written to a channel, broadcasts once a channel.
    pub words: u64,
    /// Loads by LDAC, pin or TRIGGER.
    pub loads: u64,
    /// Every [`Fault`], also those no longer kept.
    pub faults: u64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Range {
    lowest_v: f64,
    span_v: f64,
}

impl Range {
    /// The range behind four bits of DACRANGE, if they name one.
    fn from_code(code: u8) -> Option<Self> {
        let (lowest_v, span_v) = match code {
            0x0 => (0.0, 5.0),
            0x1 => (0.0, 10.0),
            0x2 => (0.0, 20.0),
            0x4 => (0.0, 40.0),
            0x9 => (-5.0, 10.0),
            0xA => (-10.0, 20.0),
            0xC => (-20.0, 40.0),
            0xE => (-2.5, 5.0),
            _ => return None,
        };
        Some(Self { lowest_v, span_v })
    }

    fn voltage(self, word: u16) -> f64 {
        self.lowest_v + self.span_v * f64::from(word) / 65_536.0
    }

    /// The word for 0 V: the middle of a bipolar range, the bottom of a unipolar one.
    fn zero_word(self) -> u16 {
        if self.lowest_v < 0.0 { 0x8000 } else { 0 }
    }
}

/// One chip, on its SPI bus and with its pins.
#[derive(Clone, Debug)]
pub struct Dac81416 {
    /// Registers as written; a channel's is its buffer, not yet its output.
    registers: [u16; 1 + OFFSET3 as usize],
    /// The words that the outputs follow.
    active: [u16; CHANNELS],
    /// The frame so far, none while the chip is not selected.
    frame: Option<([u8; FRAME], usize)>,
    /// What SDO says in the next frame, after a read.
    answer: Option<[u8; 3]>,
    ldac_high: bool,
    clr_low: bool,
    /// What is wrong with it.
    pub defects: Defects,
    counters: Counters,
    faults: Vec<Fault>,
}

impl Dac81416 {
    /// A chip that has just been powered, with LDAC and CLR high and chip select too.
    pub fn new() -> Self {
        let mut chip = Self {
            registers: [0; 1 + OFFSET3 as usize],
            active: [0; CHANNELS],
            frame: None,
            answer: None,
            ldac_high: true,
            clr_low: false,
            defects: Defects::default(),
            counters: Counters::default(),
            faults: Vec::new(),
        };
        chip.reset();
        chip
    }

    /// The RESET pin, or power: every register at its default, the device, its reference and its
    /// channels powered down, so that all outputs are at 0 V. What LDAC and CLR are held at stays.
    pub fn reset(&mut self) {
        self.registers = [0; 1 + OFFSET3 as usize];
        self.registers[usize::from(DEVICEID)] = PRODUCT << 2;
        self.registers[usize::from(SPICONFIG)] = 0x0AA4;
        self.registers[usize::from(GENCONFIG)] = 0x7F00;
        self.registers[usize::from(BRDCONFIG)] = 0xFFFF;
        self.registers[usize::from(DACPWDWN)] = 0xFFFF;
        self.active = [0; CHANNELS];
        self.frame = None;
        self.answer = None;
    }

    /// Chip select falls: a frame begins. One that had begun before is lost, as if it had ended empty.
    pub fn select(&mut self) {
        self.frame = Some(([0; FRAME], 0));
    }

    /// Eight clocks: takes a byte from MOSI, and returns the one that SDO says meanwhile.
    ///
    /// SDO answers a read in the frame after it: the read's first byte again, then the register.
    /// Else it says 0; and 0xFF, its idle level, if it is off, or silent because of streaming mode.
    pub fn transfer(&mut self, mosi: u8) -> u8 {
        if self.defects.deaf {
            return IDLE_HIGH;
        }
        let Some((bytes, length)) = &mut self.frame else {
            self.fault(Fault::NotSelected);
            return IDLE_HIGH;
        };
        let at = *length;
        if let Some(place) = bytes.get_mut(at) {
            *place = mosi;
        }
        *length += 1;
        if !self.is_set(SPICONFIG, SPICONFIG_SDO_EN) || self.is_streaming() {
            return IDLE_HIGH;
        }
        let answer = self.answer.unwrap_or_default();
        answer.get(at).copied().unwrap_or(0)
    }

    /// Chip select rises: the frame takes effect. An empty one, as pins make at start-up, is none.
    pub fn deselect(&mut self) {
        let Some((bytes, length)) = self.frame.take() else {
            return;
        };
        if length == 0 {
            return;
        }
        self.counters.frames += 1;
        self.answer = None;
        let frame = &bytes[..length.min(FRAME)];
        if self.is_streaming() {
            self.take_stream(frame, length);
        } else if let &[address, high, low] = frame {
            self.take_single(address, u16::from_be_bytes([high, low]));
        } else {
            self.counters.malformed += 1;
            self.fault(Fault::Length(length));
        }
    }

    /// The LDAC pin. Its falling edge moves the words of all channels of SYNCCONFIG to their outputs.
    pub fn ldac(&mut self, high: bool) {
        let falls = self.ldac_high && !high;
        self.ldac_high = high;
        if falls {
            self.load();
        }
    }

    /// The CLR pin. While it is low every channel, its buffer included, is held at the word for 0 V;
    /// there it stays when CLR rises, until it is written again.
    pub fn clr(&mut self, low: bool) {
        self.clr_low = low;
        if low {
            self.clear();
        }
    }

    /// ALMOUT: whether the chip pulls it low, which it does when it overheats and was asked to tell
    /// (TEMPALM-EN). In reset it is asked to.
    pub fn alarm(&self) -> bool {
        self.defects.overheated && self.is_set(SPICONFIG, SPICONFIG_TEMPALM_EN)
    }

    /// A channel's output in V, as an ideal converter gives it. 0 V while the channel, the device or
    /// the reference is powered down, while CLR is low, and in no valid range.
    ///
    /// # Panics
    /// If there is no such channel.
    pub fn voltage(&self, channel: usize) -> f64 {
        if let Some((stuck, volts)) = self.defects.stuck_output
            && stuck == channel
        {
            return volts;
        }
        let down = self.is_set(SPICONFIG, SPICONFIG_DEV_PWDWN)
            || self.is_set(GENCONFIG, GENCONFIG_REF_PWDWN)
            || self.is_set(DACPWDWN, 1 << channel)
            || self.clr_low;
        match self.range(channel) {
            Some(range) if !down => range.voltage(self.active[channel]),
            _ => 0.0,
        }
    }

    /// The word that a channel's output follows.
    ///
    /// # Panics
    /// If there is no such channel.
    pub fn word(&self, channel: usize) -> u16 {
        self.active[channel]
    }

    /// What the chip has seen.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// The first faults, in their order; [`Counters::faults`] counts all of them.
    pub fn faults(&self) -> &[Fault] {
        &self.faults
    }

    fn is_set(&self, address: u8, bits: u16) -> bool {
        self.registers[usize::from(address)] & bits != 0
    }

    fn is_streaming(&self) -> bool {
        self.is_set(SPICONFIG, SPICONFIG_STR_EN)
    }

    fn range_code(&self, channel: usize) -> u8 {
        let register = usize::from(DACRANGE3) - channel / 4;
        (self.registers[register] >> (4 * (channel % 4)) & 0xF) as u8
    }

    fn range(&self, channel: usize) -> Option<Range> {
        Range::from_code(self.range_code(channel))
    }

    fn fault(&mut self, fault: Fault) {
        self.counters.faults += 1;
        if self.faults.len() < FAULTS {
            self.faults.push(fault);
        }
    }

    fn take_single(&mut self, command: u8, data: u16) {
        let address = command & ADDRESS;
        if command & READ == 0 {
            self.write(address, data);
        } else if let Some(&value) = self.registers.get(usize::from(address)) {
            let readable = !matches!(address, NOP | DACRANGE0..=DACRANGE3 | TRIGGER);
            let value = match address {
                STATUS if self.defects.overheated => value | STATUS_TEMP_ALM,
                _ if readable => value,
                _ => 0,
            };
            let [high, low] = value.to_be_bytes();
            self.answer = Some([command, high, low]);
        } else {
            self.fault(Fault::NoRegister(address));
        }
    }

    /// A streaming frame: an address, then words for it and the ones that follow, up to DAC15.
    fn take_stream(&mut self, frame: &[u8], length: usize) {
        let Some((&command, data)) = frame.split_first() else {
            return;
        };
        let first = command & ADDRESS;
        if command & READ != 0 {
            self.fault(Fault::ReadWhileStreaming(first));
            return;
        }
        if length < 3 || length.is_multiple_of(2) {
            self.counters.malformed += 1;
            self.fault(Fault::PartialWord(length));
        }
        let room = (usize::from(DAC15) + 1).saturating_sub(first.into());
        // A frame of a single word may be for any register; only longer ones can run over the end.
        let whole = (length - 1) / 2;
        let words = whole.min(room.max(1));
        if whole > words {
            self.fault(Fault::BeyondLastChannel(whole - words));
        }
        for (address, word) in (first..).zip(data.chunks_exact(2).take(words)) {
            self.write(address, u16::from_be_bytes([word[0], word[1]]));
        }
    }

    fn write(&mut self, address: u8, data: u16) {
        match address {
            NOP => {}
            DEVICEID | STATUS => self.fault(Fault::ReadOnly(address)),
            TRIGGER => self.trigger(data),
            BRDCAST => {
                self.registers[usize::from(BRDCAST)] = data;
                for channel in 0..CHANNELS {
                    if self.is_set(BRDCONFIG, 1 << channel) {
                        self.write_channel(channel, data);
                    }
                }
            }
            DAC0..=DAC15 => self.write_channel((address - DAC0).into(), data),
            SPICONFIG..=DACRANGE3 | OFFSET0..=OFFSET3 => self.configure(address, data),
            _ => self.fault(Fault::NoRegister(address)),
        }
    }

    fn configure(&mut self, address: u8, data: u16) {
        self.registers[usize::from(address)] = data;
        let left_out = match address {
            SPICONFIG => SPICONFIG_CRC_EN | SPICONFIG_SOFTTOGGLE_EN,
            GENCONFIG => GENCONFIG_DIFFERENTIAL,
            TOGGCONFIG0 | TOGGCONFIG1 | OFFSET0..=OFFSET3 => 0xFFFF,
            _ => 0,
        };
        let bits = data & left_out;
        if bits != 0 {
            self.fault(Fault::NotModelled { address, bits });
        }
        if (DACRANGE0..=DACRANGE3).contains(&address) {
            let first = 4 * usize::from(DACRANGE3 - address);
            for channel in first..first + 4 {
                if self.range(channel).is_none() {
                    let code = self.range_code(channel);
                    self.fault(Fault::NoRange { channel, code });
                }
            }
            if self.clr_low {
                self.clear();
            }
        }
    }

    fn trigger(&mut self, data: u16) {
        // The field for a reset has four bits, and 0b1010 in it resets. Some drivers take that for
        // hexadecimal and write 0x1010; taken as a reset as well, because nobody means the LDAC that
        // its bits would be.
        if data & TRIGGER_SOFT_RESET == 0b1010 || data == 0x1010 {
            self.reset();
        } else if data & TRIGGER_LDAC != 0 {
            self.load();
        }
    }

    fn write_channel(&mut self, channel: usize, word: u16) {
        let address = DAC0 + channel as u8;
        if self.clr_low {
            // To say what is so anyway does no harm.
            if word != self.registers[usize::from(address)] {
                self.fault(Fault::HeldByClear(address));
            }
            return;
        }
        self.counters.words += 1;
        self.registers[usize::from(address)] = word;
        if !self.is_set(SYNCCONFIG, 1 << channel) {
            self.active[channel] = word;
        }
    }

    fn load(&mut self) {
        if self.defects.no_load {
            return;
        }
        self.counters.loads += 1;
        for channel in 0..CHANNELS {
            if self.is_set(SYNCCONFIG, 1 << channel) {
                self.active[channel] = self.registers[usize::from(DAC0) + channel];
            }
        }
    }

    fn clear(&mut self) {
        for channel in 0..CHANNELS {
            let word = self.range(channel).map_or(0, Range::zero_word);
            self.registers[usize::from(DAC0) + channel] = word;
            self.active[channel] = word;
        }
    }
}

impl Default for Dac81416 {
    fn default() -> Self {
        Self::new()
    }
}
