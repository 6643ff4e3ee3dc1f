//! Which of the counters tell of something wrong, of what, and what to do about it.

use protocol::{DisplayCounters, PortCounters, RoleCounters, SensorCounters};

/// A counter of something that should not happen.
pub struct Fault<C> {
    /// Its name on the wire.
    pub name: &'static str,
    /// What one more of it means: follows the count.
    pub what: &'static str,
    /// What to do about it.
    pub advice: &'static str,
    /// Whether it tells of something wrong even if it grows no more.
    pub at_rest: bool,
    /// Its count.
    pub read: fn(&C) -> u32,
}

impl<C> Fault<C> {
    const fn new(
        name: &'static str,
        read: fn(&C) -> u32,
        at_rest: bool,
        what: &'static str,
        advice: &'static str,
    ) -> Self {
        Self {
            name,
            what,
            advice,
            at_rest,
            read,
        }
    }

    /// The count, and how far it has grown from `first` to `last`, if it tells of something wrong.
    fn seen(&self, first: &C, last: Option<&C>) -> Option<Count> {
        let began = (self.read)(first);
        let count = last.map_or(began, self.read);
        let grown = last.map(|_| count.wrapping_sub(began));
        let matters = if self.at_rest {
            count > 0
        } else {
            grown.is_some_and(|grown| grown > 0)
        };
        matters.then_some(Count {
            name: self.name,
            what: self.what,
            advice: self.advice,
            count,
            grown,
        })
    }
}

/// A count that tells of something wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Count {
    /// The counter's name on the wire.
    pub name: &'static str,
    /// What was counted.
    pub what: &'static str,
    /// What to do about it.
    pub advice: &'static str,
    /// How many.
    pub count: u32,
    /// How many of them while it was looked at; none if there was only one look.
    pub grown: Option<u32>,
}

/// Those of a port towards the other board.
const PEER: [Fault<PortCounters>; 11] = [
    Fault::new(
        "dropped",
        |c| c.dropped,
        true,
        "frames not sent because the line was full",
        "send less over it: no gauge streaming where it is not needed",
    ),
    Fault::new(
        "lost",
        |c| c.lost,
        true,
        "frames that never came",
        "see the wires between the boards: PD5 and PD6 crossed, a common ground",
    ),
    Fault::new(
        "corrupt",
        |c| c.corrupt,
        true,
        "damaged frames",
        "see the wires between the boards: short, with a common ground, away from the drives",
    ),
    Fault::new(
        "overlong",
        |c| c.overlong,
        true,
        "frames without an end",
        "see what is at the other end of PD6: it does not speak as a board does",
    ),
    Fault::new(
        "malformed",
        |c| c.malformed,
        true,
        "frames of another version",
        "flash both boards with one build: `host-bridge flash`",
    ),
    Fault::new(
        "overruns",
        |c| c.overruns,
        true,
        "bytes lost inside the board",
        "keep the log and report it: the firmware was held up",
    ),
    Fault::new(
        "line_errors",
        |c| c.line_errors,
        true,
        "noise and framing errors",
        "see the wires between the boards, their ground, and that nothing else drives PD6",
    ),
    Fault::new(
        "late",
        |c| c.late,
        false,
        "frames out of order",
        "see what carries the frames: a wire can't exchange them",
    ),
    Fault::new(
        "duplicated",
        |c| c.duplicated,
        false,
        "frames that came twice",
        "see what carries the frames: a wire can't repeat them",
    ),
    Fault::new(
        "foreign",
        |c| c.foreign,
        false,
        "frames of another protocol or schema",
        "flash both boards with one build: `host-bridge flash`",
    ),
    Fault::new(
        "unheralded",
        |c| c.unheralded,
        false,
        "frames of a board that says no Hello",
        "see the other direction of the link: PD5 to the other board's PD6",
    ),
];

/// Those of a console, and of this computer's end of it.
const CONSOLE: [Fault<PortCounters>; 11] = [
    Fault::new(
        "dropped",
        |c| c.dropped,
        true,
        "frames not sent because the line was full",
        "send less over it: no gauge streaming where it is not needed",
    ),
    Fault::new(
        "lost",
        |c| c.lost,
        true,
        "frames that never came",
        "see USB cable and hub, and whether this computer is too busy",
    ),
    Fault::new(
        "corrupt",
        |c| c.corrupt,
        true,
        "damaged frames",
        "see USB cable and hub; something else than frames was sent at 921600 baud",
    ),
    Fault::new(
        "overlong",
        |c| c.overlong,
        true,
        "frames without an end",
        "see which program writes to this port: it does not speak as the bridge does",
    ),
    Fault::new(
        "malformed",
        |c| c.malformed,
        true,
        "frames of another version",
        "use the bridge and the firmware of one build: `host-bridge flash`",
    ),
    Fault::new(
        "overruns",
        |c| c.overruns,
        true,
        "bytes lost inside the board",
        "keep the log and report it: the firmware was held up",
    ),
    Fault::new(
        "line_errors",
        |c| c.line_errors,
        true,
        "noise and framing errors",
        "see that every program opens the console at 921600 baud, 8N1",
    ),
    Fault::new(
        "late",
        |c| c.late,
        false,
        "frames out of order",
        "see what carries the frames: a USB cable can't exchange them",
    ),
    Fault::new(
        "duplicated",
        |c| c.duplicated,
        false,
        "frames that came twice",
        "see what carries the frames: a USB cable can't repeat them",
    ),
    Fault::new(
        "foreign",
        |c| c.foreign,
        false,
        "frames of another protocol or schema",
        "use the bridge and the firmware of one build: `host-bridge flash`",
    ),
    Fault::new(
        "unheralded",
        |c| c.unheralded,
        false,
        "frames without a Hello before",
        "start the program again that talks to this port",
    ),
];

const SENSOR: [Fault<SensorCounters>; 3] = [
    Fault::new(
        "adc_overruns",
        |c| c.adc_overruns,
        true,
        "conversions lost by the ADC",
        "keep the log and report it: samples are missing",
    ),
    Fault::new(
        "dma_overruns",
        |c| c.dma_overruns,
        true,
        "times that scans were lost",
        "keep the log and report it: samples are missing",
    ),
    Fault::new(
        "deadline_misses",
        |c| c.deadline_misses,
        true,
        "samples that were done too late",
        "flash a release build; if it is one, keep the log and report it",
    ),
];

const DISPLAY: [Fault<DisplayCounters>; 9] = [
    Fault::new(
        "deadline_misses",
        |c| c.deadline_misses,
        true,
        "ticks that were done too late",
        "flash a release build, or update at 2000 Hz; else keep the log and report it",
    ),
    Fault::new(
        "spi_errors",
        |c| c.spi_errors,
        true,
        "failed transfers to the converters",
        "see SPI1's wires (SCK D13, SDI D11) and LDAC (D16)",
    ),
    Fault::new(
        "converter_faults",
        |c| c.converter_faults,
        true,
        "times that a converter lost its words or raised its alarm",
        "see the converters' supply, heat, ALMOUT (D3) and SDO (D12)",
    ),
    Fault::new(
        "clears",
        |c| c.clears,
        true,
        "times that CLR fell because ticks were not served",
        "keep the log and report it: the firmware was held up",
    ),
    Fault::new(
        "encoder_jumps",
        |c| c.encoder_jumps,
        true,
        "jumps of the hand's encoder",
        "see the encoder and its wires (PD12, PD13)",
    ),
    Fault::new(
        "unheard",
        |c| c.unheard,
        true,
        "motions that found no room",
        "keep the log and report it: the ports were held up",
    ),
    Fault::new(
        "flooded",
        |c| c.flooded,
        true,
        "estimates too many",
        "let only one program or board send estimates: see relay, replay and the peer link",
    ),
    Fault::new(
        "implausible",
        |c| c.implausible,
        false,
        "estimates that can't be true",
        "see the sensor's gauges, and what else sends estimates to this board",
    ),
    Fault::new(
        "refused_estimates",
        |c| c.refused_estimates,
        false,
        "estimates that were old or out of range",
        "let only one program or board send estimates: see relay, replay and the peer link",
    ),
];

fn all<C>(faults: &[Fault<C>], first: &C, last: Option<&C>) -> Vec<Count> {
    faults
        .iter()
        .filter_map(|fault| fault.seen(first, last))
        .collect()
}

/// What a board's port towards the other board tells, from its counters at a first and at a last look.
pub fn of_peer(first: &PortCounters, last: Option<&PortCounters>) -> Vec<Count> {
    all(&PEER, first, last)
}

/// What a console tells.
pub fn of_console(first: &PortCounters, last: Option<&PortCounters>) -> Vec<Count> {
    all(&CONSOLE, first, last)
}

/// What this computer's end of a console tells, since the line was opened.
pub fn of_this_end(counters: &PortCounters) -> Vec<Count> {
    // The board may be in mid-frame when the line is opened, and some frames are on their way before its
    // Hello.
    let opened = PortCounters {
        corrupt: 1,
        unheralded: u32::MAX,
        ..PortCounters::new()
    };
    CONSOLE
        .iter()
        .filter(|fault| (fault.read)(counters) > (fault.read)(&opened))
        .map(|fault| Count {
            name: fault.name,
            what: fault.what,
            advice: fault.advice,
            count: (fault.read)(counters),
            grown: Some((fault.read)(counters)),
        })
        .collect()
}

/// What the counters of a role tell; nothing if the role changed in between.
pub fn of_role(first: &RoleCounters, last: Option<&RoleCounters>) -> Vec<Count> {
    match (first, last) {
        (RoleCounters::Sensor(first), None) => all(&SENSOR, first, None),
        (RoleCounters::Sensor(first), Some(RoleCounters::Sensor(last))) => {
            all(&SENSOR, first, Some(last))
        }
        (RoleCounters::Display(first), None) => all(&DISPLAY, first, None),
        (RoleCounters::Display(first), Some(RoleCounters::Display(last))) => {
            all(&DISPLAY, first, Some(last))
        }
        _ => Vec::new(),
    }
}
