//! The dashboard on the terminal this program was started from, which is restored whatever happens.

use std::io;
use std::panic;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event as Typed, KeyEventKind};

use super::MonitorError;
use super::dashboard::Dashboard;
use super::desk::Desk;
use super::draw::draw;
use super::keeping::Keeping;
use super::keys::{Asked, press};
use super::theme::Theme;
use super::view::{Kept, View};

/// Between two pictures: 30 a second.
const FRAME: Duration = Duration::from_nanos(1_000_000_000 / 30);
/// Between two pictures when nothing comes: ages grow.
const IDLE: Duration = Duration::from_millis(500);

/// The terminal while it is ours. Dropping it restores what was there.
struct Screen {
    terminal: DefaultTerminal,
}

impl Screen {
    fn open(ended: &Arc<AtomicBool>) -> io::Result<Self> {
        let terminal = ratatui::try_init().inspect_err(|_| {
            // What was changed before it failed is put back.
            let _ = ratatui::try_restore();
        })?;
        // A thread that panics restores the terminal by ratatui's hook; nobody may draw on it then.
        let restoring = panic::take_hook();
        let ended = Arc::clone(ended);
        panic::set_hook(Box::new(move |panic| {
            ended.store(true, Ordering::Release);
            restoring(panic);
        }));
        Ok(Self { terminal })
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // A terminal that is gone needs no restoring.
        let _ = self.terminal.show_cursor();
        let _ = ratatui::try_restore();
    }
}

/// Shows the dashboard until a key, `ended` or `limit` ends it.
///
/// # Errors
/// If there is no terminal, or if the last of a recording can't be written.
pub fn run(
    mut desk: Desk,
    limit: Option<Duration>,
    ended: &Arc<AtomicBool>,
) -> Result<(), MonitorError> {
    let shown = Screen::open(ended).and_then(|mut screen| {
        let end = limit.map(|limit| Instant::now() + limit);
        show(&mut screen.terminal, &mut desk, end, ended)
    });
    let closed = desk.close();
    shown?;
    Ok(closed?)
}

fn show(
    terminal: &mut DefaultTerminal,
    desk: &mut Desk,
    end: Option<Instant>,
    ended: &AtomicBool,
) -> io::Result<()> {
    let mut view = View::new(Theme::of_environment());
    let mut frozen: Option<Box<Dashboard>> = None;
    let mut drawn: Option<Instant> = None;
    let mut changed = true;
    let mut next = Instant::now();
    let typed = listen();
    while !ended.load(Ordering::Acquire) && end.is_none_or(|end| Instant::now() < end) {
        changed |= desk.take();
        // Shown already, in the log.
        desk.dashboard.take_happenings();
        view.kept = desk.keeping().map(kept);
        view.is_over = desk.is_over();
        let is_idle = drawn.is_none_or(|drawn| drawn.elapsed() >= IDLE);
        if changed || is_idle {
            let live = &desk.dashboard;
            let shown = frozen.as_deref().unwrap_or(live);
            if let Err(error) = terminal.draw(|frame| draw(frame, live, shown, &view)) {
                return gone(error, ended);
            }
            drawn = Some(Instant::now());
            changed = false;
        }
        next = (next + FRAME).max(Instant::now());
        // Every key is obeyed when it comes, not at the next picture.
        loop {
            let event = match typed.recv_timeout(next.saturating_duration_since(Instant::now())) {
                Ok(event) => event,
                Err(RecvTimeoutError::Timeout) => break,
                // Nothing will be typed any more: the terminal is gone.
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            };
            changed = true;
            let Typed::Key(key) = event else {
                continue;
            };
            if key.kind == KeyEventKind::Release {
                continue;
            }
            let asked = press(key, &mut desk.dashboard, &mut view);
            desk.say();
            match asked {
                Asked::Nothing => {}
                Asked::Quit => return Ok(()),
                Asked::Freeze => {
                    view.is_frozen = !view.is_frozen;
                    frozen = view.is_frozen.then(|| Box::new(desk.dashboard.clone()));
                }
                Asked::Keep => desk.toggle_keeping(),
            }
        }
    }
    Ok(())
}

/// What is typed. On a thread of its own, which is left behind at the end: crossterm never comes back from
/// a terminal that has hung up.
fn listen() -> Receiver<Typed> {
    let (events, typed) = channel();
    thread::spawn(move || {
        while let Ok(event) = event::read() {
            if events.send(event).is_err() {
                return;
            }
        }
    });
    typed
}

fn kept(keeping: &Keeping) -> Kept {
    Kept {
        name: keeping.path.display().to_string(),
        since_us: keeping.since_us,
        safe_bytes: keeping.progress().safe_bytes,
    }
}

/// A terminal that has hung up is no error: the signal for it may only come a moment later.
fn gone(error: io::Error, ended: &AtomicBool) -> io::Result<()> {
    const EIO: i32 = 5;
    if ended.load(Ordering::Acquire) || error.raw_os_error() == Some(EIO) {
        Ok(())
    } else {
        Err(error)
    }
}
