//! The converters and the way to them.

use protocol::{Role, Trip};

use super::DANGEROUS;
use crate::scene::fault::Kind;
use crate::scene::fault::catalogue::{Key, Lasts, Row, Sign};

const CHIP: Key = Key {
    name: "chip",
    meaning: "the chip on the bus, 0 to 3",
    default: 1.0,
    low: 0.0,
    high: 3.0,
    whole: true,
    drawn: Some((0.0, 3.0)),
};

pub(super) static ROWS: [Row; 7] = [
    Row {
        kind: Kind::DacIgnoresWords,
        name: "dac-ignores-words",
        meaning: "a converter no longer takes words",
        injected: "the chip hears no frame and says nothing on SDO: its outputs stay as they are",
        lasts: Lasts::ForGood,
        keys: &[CHIP],
        trips: &[Trip::Converter],
        signs: &[Sign::Stopped(Trip::Converter), Sign::ClearFell],
        also: &[
            Sign::Counted(Role::Display, "converter_faults"),
            Sign::Counted(Role::Display, "clears"),
        ],
        expected: "readback differs; stopped: converter, by CLR, which the chip still obeys",
        ..DANGEROUS
    },
    Row {
        kind: Kind::DacPowerLost,
        name: "dac-power-lost",
        meaning: "a converter loses its power for a moment and its settings with it",
        injected: "the chip is reset to its power-on state",
        keys: &[CHIP],
        trips: &[Trip::Converter],
        signs: &[Sign::Stopped(Trip::Converter), Sign::ClearFell],
        also: &[
            Sign::Counted(Role::Display, "converter_faults"),
            Sign::Counted(Role::Display, "clears"),
        ],
        expected: "its own outputs at 0 V at once; readback differs; stopped: converter",
        ..DANGEROUS
    },
    Row {
        kind: Kind::DacAlarm,
        name: "dac-alarm",
        meaning: "a converter raises its alarm",
        injected: "the chip is too hot: its STATUS says so and it pulls ALMOUT (D3) low",
        lasts: Lasts::For(0.05),
        keys: &[CHIP],
        trips: &[Trip::Converter],
        signs: &[Sign::Stopped(Trip::Converter), Sign::ClearFell],
        also: &[
            Sign::Counted(Role::Display, "converter_faults"),
            Sign::Counted(Role::Display, "clears"),
        ],
        expected: "stopped: converter",
        ..DANGEROUS
    },
    Row {
        kind: Kind::LdacStuck,
        name: "ldac-stuck",
        meaning: "LDAC's wire is held high: the chips take words and don't play them",
        injected: "LDAC (D16) is high whatever TIM3 drives, at the chips and at the pin",
        lasts: Lasts::ForGood,
        trips: &[Trip::Transfer, Trip::Converter],
        signs: &[
            Sign::Stopped(Trip::Transfer),
            Sign::Stopped(Trip::Converter),
            Sign::ClearFell,
        ],
        also: &[
            Sign::Counted(Role::Display, "converter_faults"),
            Sign::Counted(Role::Display, "spi_errors"),
            Sign::Counted(Role::Display, "clears"),
            Sign::Counted(Role::Display, "deadline_misses"),
        ],
        expected: "stopped: transfer or converter",
        ..DANGEROUS
    },
    Row {
        kind: Kind::ClearStuckLow,
        name: "clear-stuck-low",
        meaning: "CLR's wire is at ground",
        injected: "CLR is low at the chips whatever the pin says",
        lasts: Lasts::ForGood,
        trips: &[Trip::Converter],
        signs: &[Sign::Stopped(Trip::Converter), Sign::ClearFell],
        also: &[
            Sign::Counted(Role::Display, "converter_faults"),
            Sign::Counted(Role::Display, "clears"),
        ],
        expected: "0 V at once; readback differs; stopped: converter",
        ..DANGEROUS
    },
    Row {
        kind: Kind::SpiStall,
        name: "spi-stall",
        meaning: "SPI1 sends no more",
        injected: "its clock is taken away (RCC_APB2ENR, SPI1EN)",
        lasts: Lasts::ForGood,
        trips: &[Trip::Transfer],
        signs: &[Sign::Stopped(Trip::Transfer), Sign::ClearFell],
        also: &[
            Sign::Counted(Role::Display, "spi_errors"),
            Sign::Counted(Role::Display, "clears"),
            Sign::Counted(Role::Display, "deadline_misses"),
        ],
        expected: "stopped: transfer",
        ..DANGEROUS
    },
    Row {
        kind: Kind::DmaStall,
        name: "dma-stall",
        meaning: "DMA2 moves no more",
        injected: "its clock is taken away (RCC_AHB1ENR, DMA2EN); a frame that is under way ends, and its interrupt stays",
        lasts: Lasts::ForGood,
        trips: &[Trip::Transfer],
        signs: &[Sign::Stopped(Trip::Transfer), Sign::ClearFell],
        also: &[
            Sign::Counted(Role::Display, "spi_errors"),
            Sign::Counted(Role::Display, "clears"),
            Sign::Counted(Role::Display, "deadline_misses"),
        ],
        expected: "stopped: transfer",
        ..DANGEROUS
    },
];
