//! What keeps a board alive and known: greetings, counters once a second, the watchdog's food.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::peripherals::{IWDG, PB0};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::{Duration, Instant, Ticker};
use protocol::{Message, ResetCause, RoleCounters, Status};

use crate::console::ConsoleOutput;
use crate::ports::Ports;
use crate::side::Side;
use crate::stack::StackWatch;

/// Between two looks: eight in a watchdog's time.
const PERIOD: Duration = Duration::from_millis(50);
const STATUS_PERIOD: Duration = Duration::from_secs(1);
const WATCHDOG_US: u32 = 400_000;

/// What [`care`] takes care of.
pub struct Vitals {
    watchdog: IndependentWatchdog<'static, IWDG>,
    link_led: Output<'static>,
    reset: ResetCause,
    watchdog_resets: u32,
    stack: StackWatch,
}

impl Vitals {
    /// Starts the watchdog. `started` is what [`crate::reset::cause`] said; LD1 (PB0) will show whether
    /// the peer is known.
    pub fn new(
        watchdog: Peri<'static, IWDG>,
        link_led: Peri<'static, PB0>,
        started: (ResetCause, u32),
    ) -> Self {
        let mut watchdog = IndependentWatchdog::new(watchdog, WATCHDOG_US);
        watchdog.unleash();
        let (reset, watchdog_resets) = started;
        Self {
            watchdog,
            link_led: Output::new(link_led, Level::Low, Speed::Low),
            reset,
            watchdog_resets,
            stack: StackWatch::default(),
        }
    }

    fn status(&self, ports: &Ports, role: RoleCounters) -> Status {
        Status {
            uptime_us: Instant::now().as_micros(),
            reset: self.reset,
            watchdog_resets: self.watchdog_resets,
            peer: ports.counters(Side::Peer),
            console: ports.counters(Side::Console),
            role,
            stack_free_bytes: self.stack.free_bytes(),
        }
    }
}

/// Greets, sends the counters, speaks to who reads the console, and feeds the watchdog as long as the
/// counters show that the board does its work. Deadline: 400 ms, the watchdog's; missed, the board
/// restarts.
#[embassy_executor::task]
pub async fn supervise(
    ports: &'static Ports,
    mut vitals: Vitals,
    counters: fn() -> RoleCounters,
    voice: ConsoleOutput,
) {
    let mut ticker = Ticker::every(PERIOD);
    let mut next_status = Instant::now() + STATUS_PERIOD;
    let mut work_before = None;
    defmt::info!(
        "reset by {}, watchdog resets {}",
        defmt::Debug2Format(&vitals.reset),
        vitals.watchdog_resets
    );
    voice.greet(ports, &vitals.status(ports, counters()));
    loop {
        let role = counters();
        let work = match role {
            RoleCounters::Sensor(counters) => counters.samples,
            RoleCounters::Display(counters) => counters.ticks,
        };
        if work_before.replace(work) != Some(work) {
            vitals.watchdog.pet();
        }
        vitals.stack.look();
        let typed = ports.poll();
        let known = ports.is_known(Side::Peer);
        vitals
            .link_led
            .set_level(if known { Level::High } else { Level::Low });
        let is_due = Instant::now() >= next_status;
        if is_due || typed.is_some() {
            let status = vitals.status(ports, role);
            if let Some(key) = typed {
                voice.obey(ports, key, &status);
            }
            if is_due {
                next_status += STATUS_PERIOD;
                ports.post(&Message::Status(status));
                voice.tell(ports, &status);
            }
        }
        ticker.next().await;
    }
}
