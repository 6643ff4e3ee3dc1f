//! What a bench is told from outside: signals, keys, lines.

use std::io::{self, BufRead, IsTerminal};
use std::sync::mpsc::Sender;
use std::thread;

use crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use crossterm::terminal::{disable_raw_mode, enable_raw_mode};
use hil_sim_boards::bench::{Bench, Command, PortName};
use protocol::Role;
use rustix::process::getpgrp;
use rustix::termios::tcgetpgrp;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

/// What a key changes of the hand's speed, in mm/s, and where it begins.
const STEP_MM_S: f64 = 10.0;
const FIRST_MM_S: f64 = 20.0;
const MOST_MM_S: f64 = 300.0;

/// Something that came in.
pub enum Input {
    Key(KeyCode),
    Line(String),
    Help,
    Quit,
}

/// Whether keys can be read: standard input is a terminal, and ours.
pub fn has_terminal() -> bool {
    let stdin = io::stdin();
    stdin.is_terminal() && tcgetpgrp(&stdin).is_ok_and(|group| group == getpgrp())
}

/// The terminal as it hands on keys; dropped, it is as it was.
pub struct Raw(());

impl Raw {
    pub fn enter() -> io::Result<Self> {
        enable_raw_mode()?;
        Ok(Self(()))
    }
}

impl Drop for Raw {
    fn drop(&mut self) {
        // There is nobody to tell, and nothing else to try.
        let _ = disable_raw_mode();
    }
}

/// Hands on the signals that end a program as [`Input::Quit`].
pub fn on_signals(events: Sender<Input>) -> io::Result<()> {
    let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP])?;
    thread::spawn(move || {
        for _ in signals.forever() {
            if events.send(Input::Quit).is_err() {
                return;
            }
        }
    });
    Ok(())
}

pub fn on_keys(events: Sender<Input>) {
    thread::spawn(move || {
        while let Ok(event) = event::read() {
            let Event::Key(key) = event else { continue };
            if let Some(input) = meaning(key)
                && events.send(input).is_err()
            {
                return;
            }
        }
        // A terminal that can't be read is gone.
        let _ = events.send(Input::Quit);
    });
}

fn meaning(key: KeyEvent) -> Option<Input> {
    if key.kind == KeyEventKind::Release {
        return None;
    }
    if key.modifiers.contains(KeyModifiers::CONTROL) {
        return (key.code == KeyCode::Char('c')).then_some(Input::Quit);
    }
    match key.code {
        KeyCode::Char('q') => Some(Input::Quit),
        KeyCode::Char('?') => Some(Input::Help),
        code => Some(Input::Key(code)),
    }
}

/// Hands on lines of standard input. Its end means nothing.
pub fn on_lines(events: Sender<Input>) {
    thread::spawn(move || {
        let (mut input, mut bytes) = (io::stdin().lock(), Vec::new());
        while input
            .read_until(b'\n', &mut bytes)
            .is_ok_and(|count| count > 0)
        {
            // One that is no text is no command, and is answered as such.
            let line = String::from_utf8_lossy(&bytes).trim().to_owned();
            bytes.clear();
            if !line.is_empty() && events.send(Input::Line(line)).is_err() {
                return;
            }
        }
    });
}

#[derive(Debug, Default)]
pub struct Keys {
    speed_mm_s: f64,
    is_backwards: bool,
    is_stopped: bool,
}

impl Keys {
    pub fn command(&mut self, key: KeyCode, bench: &Bench) -> Option<Command> {
        match key {
            KeyCode::Up => self.speed_mm_s = (self.speed_mm_s + STEP_MM_S).min(MOST_MM_S),
            KeyCode::Down => self.speed_mm_s = (self.speed_mm_s - STEP_MM_S).max(0.0),
            KeyCode::Left | KeyCode::Right => {
                self.is_backwards = key == KeyCode::Left;
                if self.speed_mm_s == 0.0 {
                    self.speed_mm_s = FIRST_MM_S;
                }
            }
            KeyCode::Char(' ') => self.speed_mm_s = 0.0,
            KeyCode::Char('r') => return Some(Command::Reset(Role::Sensor)),
            KeyCode::Char('d') => return Some(Command::Reset(Role::Display)),
            KeyCode::Char('e') => {
                self.is_stopped = !self.is_stopped;
                let pressed = self.is_stopped;
                return Some(if pressed {
                    Command::Stop
                } else {
                    Command::Release
                });
            }
            KeyCode::Char(digit @ '1'..='6') => {
                let name = PortName::ALL[digit as usize - '1' as usize];
                return Some(if bench.is_plugged(name) {
                    Command::Pull(name)
                } else {
                    Command::Plug(name)
                });
            }
            _ => return None,
        }
        let sign = if self.is_backwards { -1.0 } else { 1.0 };
        Some(Command::Hand {
            speed_mm_s: sign * self.speed_mm_s,
        })
    }
}
