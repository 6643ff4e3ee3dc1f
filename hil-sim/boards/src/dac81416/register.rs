//! Register addresses.

/// Does nothing.
pub const NOP: u8 = 0x00;
/// Product 668 in bits 15:2, version in 1:0; read only.
pub const DEVICEID: u8 = 0x01;
/// Alarms, none of which are modelled; read only.
pub const STATUS: u8 = 0x02;
/// Interface and device power.
pub const SPICONFIG: u8 = 0x03;
/// Reference power and differential pairs.
pub const GENCONFIG: u8 = 0x04;
/// Channels that follow a broadcast, a bit each.
pub const BRDCONFIG: u8 = 0x05;
/// Channels that wait for LDAC, a bit each.
pub const SYNCCONFIG: u8 = 0x06;
/// Toggle modes of channels 8 to 15.
pub const TOGGCONFIG0: u8 = 0x07;
/// Toggle modes of channels 0 to 7.
pub const TOGGCONFIG1: u8 = 0x08;
/// Channels that are powered down, a bit each.
pub const DACPWDWN: u8 = 0x09;
/// Ranges of channels 15 to 12, four bits each, the highest channel in the highest bits; write
/// only. Drivers disagree on whether the first register holds the first or the last channels.
pub const DACRANGE0: u8 = 0x0A;
/// Ranges of channels 3 to 0; write only.
pub const DACRANGE3: u8 = 0x0D;
/// LDAC and reset by software; write only.
pub const TRIGGER: u8 = 0x0E;
/// A word for all channels of BRDCONFIG.
pub const BRDCAST: u8 = 0x0F;
/// The first channel's word.
pub const DAC0: u8 = 0x10;
/// The last channel's word.
pub const DAC15: u8 = 0x1F;
/// Offsets of differential pairs, first register.
pub const OFFSET0: u8 = 0x20;
/// Offsets of differential pairs, last register.
pub const OFFSET3: u8 = 0x23;
