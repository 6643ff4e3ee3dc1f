//! The display board's processor.

use protocol::{Role, Trip};

use super::{DANGEROUS, RESTARTED, WATCHDOG_MS};
use crate::scene::fault::Kind;
use crate::scene::fault::catalogue::{Class, Key, Lasts, Row, Sign};

/// Until a watchdog that is no longer fed has bitten (0.5 s at most), the board has started again and had the
/// time to drive, which it must not, and has told why: once a second.
const PAST_WATCHDOG_S: f64 = 1.8;

pub(super) static ROWS: [Row; 9] = [
    Row {
        kind: Kind::TickStopped,
        name: "tick-stopped",
        meaning: "the output tick stops",
        injected: "TIM3_CR1 is written 0",
        lasts: Lasts::ForGood,
        resets: 1,
        trips: &[Trip::Watchdog],
        signs: &[Sign::ClearFell, Sign::Stopped(Trip::Watchdog)],
        also: &RESTARTED,
        silences: &[Role::Display],
        expected: "CLR falls after four ticks, the watchdog bites; stopped: watchdog",
        watch_s: PAST_WATCHDOG_S,
        ..DANGEROUS
    },
    Row {
        kind: Kind::OutputTaskStall,
        name: "output-task-stall",
        meaning: "the output task never ends",
        injected: "its entry in RAM, by which its executor calls it, leads to an endless loop",
        resets: 1,
        trips: &[Trip::Watchdog],
        signs: &[Sign::ClearFell, Sign::Stopped(Trip::Watchdog)],
        also: &RESTARTED,
        silences: &[Role::Display],
        expected: "CLR falls after four ticks, the watchdog bites; stopped: watchdog",
        watch_s: PAST_WATCHDOG_S,
        ..DANGEROUS
    },
    Row {
        kind: Kind::ThreadStall,
        name: "thread-stall",
        meaning: "a task of the thread never ends, so that nobody hears a Stop",
        injected: "the reporting task's entry in RAM leads to an endless loop",
        resets: 1,
        trips: &[Trip::Watchdog],
        signs: &[
            Sign::ClearFell,
            Sign::Stopped(Trip::Watchdog),
            Sign::Reset(Role::Display),
        ],
        seen_within_ms: WATCHDOG_MS,
        also: &RESTARTED,
        silences: &[Role::Display],
        expected: "fades out within 20 ms, the watchdog bites; stopped: watchdog",
        watch_s: PAST_WATCHDOG_S,
        ..DANGEROUS
    },
    Row {
        kind: Kind::BoardHang,
        name: "board-hang",
        meaning: "the display's processor hangs",
        injected: "the output task's entry leads to an endless loop with interrupts disabled",
        resets: 1,
        trips: &[Trip::Watchdog],
        signs: &[Sign::ClearFell, Sign::Stopped(Trip::Watchdog)],
        also: &RESTARTED,
        silences: &[Role::Display],
        expected: "CLR falls after four ticks, the watchdog bites; stopped: watchdog",
        watch_s: PAST_WATCHDOG_S,
        ..DANGEROUS
    },
    Row {
        kind: Kind::Panic,
        name: "panic",
        meaning: "the firmware panics",
        injected: "the output task's entry leads to core's panic for an index out of bounds",
        resets: 1,
        trips: &[Trip::Panic],
        signs: &[Sign::ClearFell, Sign::Stopped(Trip::Panic)],
        also: &RESTARTED,
        silences: &[Role::Display],
        expected: "CLR falls; stopped: panic, also after the reset",
        watch_s: PAST_WATCHDOG_S,
        ..DANGEROUS
    },
    Row {
        kind: Kind::HardFault,
        name: "hard-fault",
        meaning: "the processor meets an instruction that is none",
        injected: "the output task's entry leads to UDF",
        resets: 1,
        trips: &[Trip::Fault],
        signs: &[Sign::ClearFell, Sign::Stopped(Trip::Fault)],
        also: &RESTARTED,
        silences: &[Role::Display],
        expected: "CLR falls; stopped: fault, also after the reset",
        watch_s: PAST_WATCHDOG_S,
        ..DANGEROUS
    },
    Row {
        kind: Kind::StackOverflow,
        name: "stack-overflow",
        meaning: "a recursion without an end",
        injected: "the output task's entry leads to code that pushes registers and calls itself",
        resets: 1,
        trips: &[Trip::StackOverflow],
        signs: &[Sign::ClearFell, Sign::Stopped(Trip::StackOverflow)],
        also: &RESTARTED,
        silences: &[Role::Display],
        expected: "CLR falls; stopped: stack overflow, also after the reset",
        watch_s: PAST_WATCHDOG_S,
        ..DANGEROUS
    },
    Row {
        kind: Kind::MemoryChanged,
        name: "memory-changed",
        meaning: "a bit of the settings in RAM turns",
        injected: "one bit of a setting where the output task holds them, at the lowest address if there are \
                   more places (what follows there are copies that are no longer read)",
        keys: &[
            Key {
                name: "setting",
                meaning: "which: 0 max_age_ms, 1 fade_in_ms, 2 fade_out_ms, 3 glide_ms, 4 amplitude_mv, \
                          5 reference_lsb, \
                          6 reference_mn, 7 full_drive_s",
                default: 4.0,
                low: 0.0,
                high: 7.0,
                whole: true,
                drawn: Some((0.0, 7.0)),
            },
            Key {
                name: "bit",
                meaning: "the bit, 0 to 15",
                default: 12.0,
                low: 0.0,
                high: 15.0,
                whole: true,
                drawn: Some((0.0, 15.0)),
            },
        ],
        trips: &[Trip::Memory],
        signs: &[Sign::Stopped(Trip::Memory), Sign::ClearFell],
        also: &[Sign::Counted(Role::Display, "clears")],
        expected: "stopped: memory",
        ..DANGEROUS
    },
    Row {
        kind: Kind::BrownOut,
        name: "brown-out",
        meaning: "the display board's supply dips",
        injected: "as power-cycle, of the display's processor alone: the DACs keep their registers",
        lasts: Lasts::For(0.02),
        class: Class::Fades,
        resets: 1,
        signs: &[Sign::ClearFell, Sign::Greets(Role::Display)],
        also: &RESTARTED,
        silences: &[Role::Display],
        again_within_ms: Some(500.0),
        expected: "CLR is pulled low at once; the board starts and drives when there is a fresh estimate",
        watch_s: 0.7,
        ..DANGEROUS
    },
];
