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
use super::draw::draw;
use super::keys::{Asked, is_stop, press};
use super::session::LiveRecording;
use super::session::Session;
use super::theme::Theme;
use super::view::{Kept, View};
use crate::link::{LinkSender, stop_all};

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

/// Shows the dashboard until a key, `ended` or `limit` ends it. Fails if there is no terminal, or if the last of a
/// recording can't be written.
pub fn run(
    mut session: Session,
    limit: Option<Duration>,
    ended: &Arc<AtomicBool>,
) -> Result<(), MonitorError> {
    let shown = Screen::open(ended).and_then(|mut screen| {
        let end = limit.map(|limit| Instant::now() + limit);
        show(&mut screen.terminal, &mut session, end, ended)
    });
    let closed = session.close();
    shown?;
    Ok(closed?)
}

fn show(
    terminal: &mut DefaultTerminal,
    session: &mut Session,
    end: Option<Instant>,
    ended: &AtomicBool,
) -> io::Result<()> {
    let mut view = View::new(Theme::of_environment());
    let mut frozen: Option<Box<Dashboard>> = None;
    let mut drawn: Option<Instant> = None;
    let mut changed = true;
    let mut next = Instant::now();
    let typed = listen(session.senders());
    while !ended.load(Ordering::Acquire) && end.is_none_or(|end| Instant::now() < end) {
        changed |= session.take();
        // Shown already, in the log.
        session.dashboard.take_log_entries();
        view.kept = session.recording().map(kept);
        view.is_over = session.is_over();
        let is_idle = drawn.is_none_or(|drawn| drawn.elapsed() >= IDLE);
        if changed || is_idle {
            let live = &session.dashboard;
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
            let asked = press(key, &mut session.dashboard, &mut view);
            session.say();
            match asked {
                Asked::Nothing => {}
                Asked::Quit => return Ok(()),
                Asked::Freeze => {
                    view.is_frozen = !view.is_frozen;
                    frozen = view.is_frozen.then(|| Box::new(session.dashboard.clone()));
                }
                Asked::Keep => session.toggle_recording(),
            }
        }
    }
    Ok(())
}

/// What is typed. On a thread of its own, which is left behind at the end: crossterm never comes back from
/// a terminal that has hung up. It says Stop itself: whoever draws may have to wait for the terminal.
fn listen(boards: Vec<LinkSender>) -> Receiver<Typed> {
    let (events, typed) = channel();
    thread::spawn(move || {
        while let Ok(event) = event::read() {
            let stops = matches!(&event, Typed::Key(key) if key.kind != KeyEventKind::Release && is_stop(*key));
            // First, so that no answer to a Stop comes before its key.
            let told = events.send(event);
            if stops {
                stop_all(&boards);
            }
            if told.is_err() {
                return;
            }
        }
    });
    typed
}

fn kept(recording: &LiveRecording) -> Kept {
    Kept {
        name: recording.path.display().to_string(),
        since_us: recording.since_us,
        safe_bytes: recording.recorder.progress().safe_bytes,
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

#[cfg(test)]
mod tests {
    use std::env;
    use std::fs::{File, OpenOptions};
    use std::io::{ErrorKind, Read};
    use std::process::{Command, Stdio};
    use std::sync::mpsc::Sender;

    use ratatui::crossterm::terminal::is_raw_mode_enabled;
    use serialport::{SerialPort, TTYPort};

    use super::*;

    /// Far more than anything here takes.
    const LIMIT: Duration = Duration::from_secs(30);
    /// Set for the program that has the screen and panics: this one, once more.
    const WITHIN: &str = "RIDGELINK_TEST_WITHIN_A_TERMINAL";
    const NAME: &str = "monitor::screen::tests::a_panic_anywhere_restores_the_terminal";

    #[test]
    fn a_panic_anywhere_restores_the_terminal() {
        match env::var(WITHIN).as_deref() {
            Ok("another thread") => panic_in_another_thread(),
            Ok(_) => panic_in_this_thread(),
            Err(_) => {
                for place in ["another thread", "this thread"] {
                    assert_restored_after(place);
                }
            }
        }
    }

    /// The hook restores it, before anybody knows of the panic; the guard is never dropped.
    fn panic_in_another_thread() {
        let ended = Arc::new(AtomicBool::new(false));
        let screen = Screen::open(&ended).expect("there is a terminal");
        assert!(is_raw_mode_enabled().is_ok_and(|is_raw| is_raw));
        let fallen = thread::spawn(|| panic!("on purpose")).join();
        assert!(fallen.is_err() && ended.load(Ordering::Acquire));
        assert!(is_raw_mode_enabled().is_ok_and(|is_raw| !is_raw));
        std::mem::forget(screen);
    }

    /// The guard is dropped on the way out, after the hook.
    fn panic_in_this_thread() {
        let ended = Arc::new(AtomicBool::new(false));
        let fallen = panic::catch_unwind(|| {
            let _screen = Screen::open(&ended).expect("there is a terminal");
            panic!("on purpose");
        });
        assert!(fallen.is_err() && ended.load(Ordering::Acquire));
        assert!(is_raw_mode_enabled().is_ok_and(|is_raw| !is_raw));
    }

    fn assert_restored_after(place: &str) {
        let (mut window, terminal) = TTYPort::pair().expect("the system has pseudo-terminals");
        let name = terminal.name().expect("it has a name");
        let end = || {
            OpenOptions::new()
                .read(true)
                .write(true)
                .open(&name)
                .expect("the terminal can be opened")
        };
        // As a shell leaves it: the pair was made for bytes, not for people.
        stty(end(), &["sane", "rows", "40", "cols", "120"]);
        let before = stty(end(), &["-a"]);
        let (sender, shown) = channel();
        window.set_timeout(LIMIT).expect("it takes a limit");
        let reader = thread::spawn(move || read(&mut window, &sender));
        let this = env::current_exe().expect("a test knows where it is");
        let status = Command::new(this)
            .args(["--exact", NAME, "--nocapture"])
            .env(WITHIN, place)
            .env("TERM", "xterm-256color")
            .stdin(end())
            .stdout(end())
            .stderr(Stdio::null())
            .status()
            .expect("this program can be started");
        assert!(status.success(), "{place}: {status}");
        assert_eq!(stty(end(), &["-a"]), before, "{place}");
        // What was written stays to be read: to its end, once nobody has the terminal open.
        drop(terminal);
        reader.join().expect("it only reads");
        let shown: Vec<u8> = shown.try_iter().flatten().collect();
        let shown = String::from_utf8_lossy(&shown);
        let [entered, left, hidden, seen] =
            ["\x1b[?1049h", "\x1b[?1049l", "\x1b[?25l", "\x1b[?25h"]
                .map(|words| shown.rfind(words));
        assert!(entered.is_some() && left > entered, "{place}: {shown:?}");
        assert!(hidden.is_none() || seen > hidden, "{place}: {shown:?}");
    }

    /// Passes on what is shown until nobody has the terminal open.
    fn read(window: &mut TTYPort, shown: &Sender<Vec<u8>>) {
        let mut bytes = [0; 4_096];
        loop {
            match window.read(&mut bytes) {
                Ok(count @ 1..) => {
                    let _ = shown.send(bytes[..count].to_vec());
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Ok(0) | Err(_) => return,
            }
        }
    }

    fn stty(terminal: File, arguments: &[&str]) -> String {
        let output = Command::new("stty")
            .args(arguments)
            .stdin(terminal)
            .output()
            .expect("stty can be run");
        assert!(output.status.success(), "{output:?}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    }
}
