//! What a driver did wrong.

/// Something a driver should not have done. The chip goes on, and so does the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the variants say what their fields are")]
pub enum Fault {
    /// A frame outside of streaming mode was not 24 bits long but so many bytes: ignored.
    Length(usize),
    /// A streaming frame of so many bytes did not end with a whole word: the rest was ignored.
    PartialWord(usize),
    /// A streaming frame went on behind DAC15: so many words were ignored.
    BeyondLastChannel(usize),
    /// A byte came while the chip was not selected: ignored.
    NotSelected,
    /// A read of a register in streaming mode, where SDO is silent.
    ReadWhileStreaming(u8),
    /// A write to a register that cannot be written: ignored.
    ReadOnly(u8),
    /// No register has this address: ignored.
    NoRegister(u8),
    /// A channel was given a code of four bits that is no range; it stays at 0 V.
    NoRange { channel: usize, code: u8 },
    /// The word in a channel's register was written while CLR was low: ignored.
    HeldByClear(u8),
    /// Bits of a register were set that switch on something that this model leaves out.
    NotModelled { address: u8, bits: u16 },
}
