//! What the supervisor is told of the board at each tick, and what it answers.

/// The board as it is seen at an output tick. The default is a healthy one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Senses {
    /// The emergency-stop input is open.
    pub stop_input_open: bool,
    /// A converter pulls the alarm line.
    pub alarm: bool,
    /// How the words fared that were sent last.
    pub transfer: Transfer,
    /// CLR fell by itself since the last tick: ticks were not served, and the outputs are at 0 V.
    pub clear_fell: bool,
    /// CLR is low: the outputs are at 0 V, whatever the converters hold.
    pub is_clear: bool,
    /// What a look into a converter's registers said, if there was one since the last tick.
    pub readback: Readback,
    /// A motion found no room since the last tick: the tasks behind the ports do not get to run, and
    /// nobody would hear a Stop.
    pub unheard: bool,
    /// Ticks that were not served since the last one that was; 0 if none.
    pub missed_ticks: u32,
}

/// How the words fared that were sent last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Transfer {
    /// They are in the converters, or none were sent.
    #[default]
    Done,
    /// The bus reported an error.
    Failed,
    /// They were not out when the next ones were due.
    Stalled,
}

/// A comparison of what a converter holds with what it was given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Readback {
    /// None was made.
    #[default]
    None,
    /// It holds what it was given.
    Agrees,
    /// It holds something else.
    Differs,
}

/// Why the converters are not to be driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConverterFault {
    /// A start-up write did not get out.
    Transfer {
        /// The converter, counted from 0.
        chip: u8,
    },
    /// A register does not hold what it was given, or what the part is known by.
    Register {
        /// The converter, counted from 0.
        chip: u8,
        /// The register's address.
        register: u8,
        /// What it should hold.
        want: u16,
        /// What it said.
        got: u16,
    },
}

/// What the board is to do after a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Output {
    /// The words are to be sent.
    pub send: bool,
    /// CLR may be held off. False while the converters are being started and when the display is
    /// stopped: the outputs are then at 0 V whatever the converters hold.
    pub release: bool,
}
