//! What a driver did wrong.

/// Something a driver should not have done. The chip goes on, and so does the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A frame outside of streaming mode was not 24 bits long: ignored.
    Length {
        /// Bytes in the frame.
        bytes: usize,
    },
    /// A streaming frame did not end with a whole word: the rest was ignored.
    PartialWord {
        /// Bytes in the frame.
        bytes: usize,
    },
    /// A streaming frame went on behind DAC15: the rest was ignored.
    BeyondLastChannel {
        /// Words ignored.
        words: usize,
    },
    /// A byte came while the chip was not selected: ignored.
    NotSelected,
    /// A read in streaming mode, where SDO is silent.
    ReadWhileStreaming {
        /// The register.
        address: u8,
    },
    /// A write to a register that cannot be written: ignored.
    ReadOnly {
        /// The register.
        address: u8,
    },
    /// No such register: ignored.
    NoRegister {
        /// The address.
        address: u8,
    },
    /// A code that is no range; such a channel stays at 0 V.
    NoRange {
        /// The channel.
        channel: usize,
        /// The four bits written.
        code: u8,
    },
    /// A channel's word was written while CLR was low: ignored.
    HeldByClear {
        /// The register.
        address: u8,
    },
    /// Something was switched on that this model leaves out.
    NotModelled {
        /// The register.
        address: u8,
        /// The bits that were set.
        bits: u16,
    },
}
