//! The display board's tasks and what they pass to each other.

use core::cell::{Cell, RefCell};

use embassy_executor::Spawner;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::ThreadModeMutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_time::Instant;
use firmware_display::capabilities::CAPABILITIES;
use firmware_display::look::Rounds;
use firmware_display::{Display, Senses, Settings, Transfer, line};
use nucleo::answer::answer;
use nucleo::console::ConsoleOutput;
use nucleo::ports::{OUTBOX, Ports, reply, report, speak};
use nucleo::serial::Receiver;
use nucleo::side::Side;
use nucleo::spawn::once;
use nucleo::stop;
use nucleo::supervision::supervise;
use protocol::{
    DisplayCounters, DisplayState, Estimate, Hello, Message, Question, RoleCounters, Safety, Stop,
    Texture, Trip,
};
use static_cell::StaticCell;

use crate::board::Board;
use crate::converters::Converters;
use crate::inputs::Inputs;
use crate::ticks::Ticks;

/// From the ports to the output task. More estimates than a tick brings at a line's full speed, so that
/// those of a flood are seen.
static ESTIMATES: Channel<CriticalSectionRawMutex, Estimate, 8> = Channel::new();
/// The same for textures, which are fewer.
static TEXTURES: Channel<CriticalSectionRawMutex, Texture, 2> = Channel::new();
/// Who may send estimates has asked for a greeting.
static GREETED: Signal<CriticalSectionRawMutex, ()> = Signal::new();
static STOP: Signal<CriticalSectionRawMutex, Stop> = Signal::new();
static CONFIGURE: Signal<CriticalSectionRawMutex, Settings> = Signal::new();
/// What is in force, whichever port it came from.
static SETTINGS: ThreadModeMutex<RefCell<Settings>> =
    ThreadModeMutex::new(RefCell::new(Settings::DEFAULT));
/// What the output task has counted so far.
static COUNTERS: Mutex<CriticalSectionRawMutex, Cell<DisplayCounters>> =
    Mutex::new(Cell::new(DisplayCounters::ZERO));

/// Starts every task.
pub fn start(spawner: Spawner, board: Board, hello: Hello) {
    static PORTS: StaticCell<Ports> = StaticCell::new();
    let ports: &'static Ports = PORTS.init(Ports::new(hello));
    let Board {
        output,
        ticks,
        converters,
        inputs,
        trip,
        peer,
        console,
        vitals,
    } = board;
    let [major, minor, patch] = hello.version;
    defmt::info!("display {}.{}.{} started", major, minor, patch);
    output.spawn(once(drive(ticks, converters, inputs, trip)));
    for (side, serial) in [(Side::Peer, peer), (Side::Console, console)] {
        spawner.spawn(once(listen(ports, side, serial.receiver)));
        spawner.spawn(once(speak(ports, side, serial.transmitter)));
    }
    spawner.spawn(once(report(ports)));
    spawner.spawn(once(answer(ports)));
    let counters = || RoleCounters::Display(COUNTERS.lock(Cell::get));
    let voice = ConsoleOutput {
        hello,
        line: line::line,
        help: &line::HELP,
        stop: |stop| {
            STOP.signal(stop);
            line::STOPPING
        },
    };
    spawner.spawn(once(supervise(ports, vitals, counters, voice)));
}

/// Reads the hand, moves the phase, starts fifty voltages on their way. Deadline: LDAC's edge, 102 µs after
/// the tick, for them to arrive. Missed, they are sent again with the next tick's travel in them, and the
/// miss is counted; missed four times in a row, CLR is no longer held off and all outputs go to 0 V, as
/// they do by hardware if this task does not run any more.
#[embassy_executor::task]
async fn drive(
    mut ticks: Ticks,
    mut converters: Converters,
    inputs: Inputs,
    persisted: Option<Trip>,
) {
    let settings = Settings::DEFAULT;
    let mut display = Display::new(&settings, persisted);
    display.started(converters.start());
    let mut rounds = Rounds::default();
    let mut announced = Announced::default();
    let mut unheard = false;
    let mut released = false;
    ticks.start();
    loop {
        let (encoder, missed_ticks) = ticks.next().await;
        let (transfer, readback) = converters.finish();
        let is_clear = converters.is_clear();
        let senses = Senses {
            stop_input_open: inputs.stop_is_open(),
            alarm: inputs.alarm(),
            transfer,
            clear_fell: released && is_clear,
            is_clear,
            readback,
            unheard: core::mem::take(&mut unheard),
            missed_ticks,
        };
        if let Some(stop) = STOP.try_take() {
            display.stop(stop.reason);
        }
        let output = display.tick(encoder, &senses);
        // Outputs that can't be changed go to 0 V.
        if output.release && transfer == Transfer::Done {
            converters.hold_off(is_clear);
        }
        // What CLR took away is not looked for before it is there again.
        let quiet = transfer == Transfer::Done && !senses.clear_fell;
        match rounds.tick(display.rate(), quiet, display.words()) {
            look if output.send => converters.update(display.words(), look),
            Some(look) => converters.look(look),
            None => {}
        }
        released = output.release;
        // The words are on their way: what else there is to do has the rest of the tick.
        // Asked first: to take moves a kilobyte, also if there is nothing to be taken.
        if CONFIGURE.signaled()
            && let Some(settings) = CONFIGURE.try_take()
        {
            ticks.set_rate(settings.configuration().update_rate);
            display.configure(&settings);
        }
        if GREETED.try_take().is_some() {
            display.on_greeting();
        }
        while let Ok(estimate) = ESTIMATES.try_receive() {
            display.on_estimate(&estimate);
        }
        while let Ok(texture) = TEXTURES.try_receive() {
            display.on_texture(&texture);
        }
        if let Some(motion) = display.motion(Instant::now().as_micros()) {
            unheard = OUTBOX.try_send(Message::Motion(motion)).is_err();
        }
        let state = display.state();
        announced.tell(state);
        if let DisplayState::Stopped(_) = state {
            announced.tell_off(display.off());
        }
        COUNTERS.lock(|shared| shared.set(display.counters()));
    }
}

/// What was said of the supervisor's state.
#[derive(Default)]
struct Announced {
    kept: DisplayState,
    told: DisplayState,
    is_off: bool,
}

impl Announced {
    /// Says once that a stopped display's outputs are off.
    fn tell_off(&mut self, off: Option<Trip>) {
        if let Some(trip) = off
            && !core::mem::replace(&mut self.is_off, true)
        {
            stop::OFF.signal(trip);
        }
    }

    /// Keeps why the display was stopped where a reset does not reach, and tells of each change as soon
    /// as there is room for the message.
    fn tell(&mut self, state: DisplayState) {
        if state != self.kept {
            self.kept = state;
            if let DisplayState::Stopped(trip) = state {
                nucleo::trip::latch(trip);
            }
        }
        if state != self.told {
            let instant_us = Instant::now().as_micros();
            let safety = Message::Safety(Safety { instant_us, state });
            if OUTBOX.try_send(safety).is_ok() {
                self.told = state;
            }
        }
    }
}

/// Hears a port. See [`Ports::listen`].
#[embassy_executor::task(pool_size = 2)]
async fn listen(ports: &'static Ports, side: Side, uart: Receiver) {
    ports
        .listen(side, uart, |message| match message {
            Message::Hello(_) => GREETED.signal(()),
            Message::Estimate(estimate) => {
                // Full only in a flood, of which those that fit tell enough.
                let _ = ESTIMATES.try_send(estimate);
            }
            Message::Texture(texture) => {
                let _ = TEXTURES.try_send(texture);
            }
            Message::Stop(stop) => STOP.signal(stop),
            Message::Actuators(block) => {
                let refused = SETTINGS.lock(|settings| settings.borrow_mut().on_actuators(&block));
                if let Some(answer) = refused {
                    reply(Message::Configuration(answer));
                }
            }
            Message::Configure(asked) => {
                let (answer, settings) = SETTINGS.lock(|settings| {
                    let mut settings = settings.borrow_mut();
                    (settings.on_configure(&asked), settings.clone())
                });
                if answer.refused.is_none() {
                    CONFIGURE.signal(settings);
                }
                reply(Message::Configuration(answer));
            }
            Message::Question(question) => {
                let answer = match question {
                    Question::Configuration => {
                        Message::Configuration(SETTINGS.lock(|settings| settings.borrow().report()))
                    }
                    Question::Capabilities => Message::Capabilities(CAPABILITIES),
                };
                reply(answer);
            }
            _ => {}
        })
        .await
}
