//! The firmwares' logs: the bytes of an RTT channel, from wherever they can be had, decoded by defmt's own
//! decoder with the strings in the ELF.

use std::cell::Cell;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, IsTerminal, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::{FileExt, FileTypeExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Duration;

use defmt_decoder::{DecodeError, Table};
use nix::fcntl::{FcntlArg, OFlag, fcntl};
use probe_rs::probe::list::Lister;
use probe_rs::rtt::{Rtt, ScanRegion, find_rtt_control_block_in_raw_file};
use probe_rs::{Permissions, Session};
use protocol::Role;

use super::log_entry::{LogEvent, LogLine};
use crate::link::is_pause;
use crate::place::{is_far, log_of};
use crate::shared_port::{SharedPorts, open_source};
use crate::state::State;
use crate::system::{Input, Opened, Ports};

/// Longest wait for bytes, and between two looks at a file that may grow.
const LOOK: Duration = Duration::from_millis(100);
/// Between two attempts to get at the bytes.
const AGAIN: Duration = Duration::from_secs(1);
/// Most bytes of a read.
const READ_BYTES: usize = 4_096;
/// So much of what was read of a file is looked at again, in bytes: some lines, which have the board's time in them.
const PASSED_BYTES: usize = 256;

/// Where the bytes come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A file that grows, a pipe, or a pseudo-terminal.
    File(PathBuf),
    /// A server of the raw channel, as `HOST:PORT`: OpenOCD's `rtt server`, J-Link's, and others.
    Tcp(String),
    /// The board's memory, by its probe; that of this serial number if there are several.
    Probe(Option<String>),
}

impl Origin {
    /// `tcp:HOST:PORT`, or the name of a file.
    pub fn of(text: &str) -> Self {
        match text.strip_prefix("tcp:") {
            Some(address) => Self::Tcp(address.to_owned()),
            None => Self::File(PathBuf::from(text)),
        }
    }
}

/// Why a log can't be read at all.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    #[error("{0}: can't be read: {1}")]
    Unreadable(PathBuf, #[source] io::Error),
    #[error("{0}: holds no defmt log ({1}): give the firmware's ELF as the build left it")]
    NoTable(PathBuf, String),
}

struct Log {
    role: Role,
    elf: Vec<u8>,
    table: Table,
    lines: Sender<(Role, LogEvent)>,
    /// Whether a line has come since it was told last why none does.
    has_come: Cell<bool>,
    ended: Arc<AtomicBool>,
}

/// The logs of all boards whose bytes are read; dropping it ends the reading.
pub struct Logs {
    lines: Sender<(Role, LogEvent)>,
    ended: Arc<AtomicBool>,
}

impl Logs {
    /// None is read yet; the lines come out of the receiver.
    pub fn new() -> (Self, Receiver<(Role, LogEvent)>) {
        let (lines, read) = channel();
        let ended = Arc::new(AtomicBool::new(false));
        (Self { lines, ended }, read)
    }

    /// Reads the log of the board of `role`, whose firmware is `elf`, for as long as this lives. Fails if the ELF
    /// can't be read or has no log. That the bytes can't be had is said as it happens.
    pub fn follow(&self, role: Role, elf: &Path, origin: Origin) -> Result<(), LogError> {
        let bytes = fs::read(elf).map_err(|source| LogError::Unreadable(elf.to_owned(), source))?;
        let no_table = |reason: String| LogError::NoTable(elf.to_owned(), reason);
        let table = Table::parse(&bytes)
            .map_err(|error| no_table(format!("{error:#}")))?
            .ok_or_else(|| no_table("no .defmt section".to_owned()))?;
        let log = Log {
            role,
            elf: bytes,
            table,
            lines: self.lines.clone(),
            has_come: Cell::new(false),
            ended: Arc::clone(&self.ended),
        };
        thread::spawn(move || log.read(&origin));
        Ok(())
    }

    /// Reads the log of the board of `role` for as long as this lives, if `port` is that of a board at another site: the
    /// relay there decodes it. That no relay shows it is told by its link.
    pub fn follow_far(&self, role: Role, port: &Path) {
        if !is_far(port) {
            return;
        }
        let name = PathBuf::from(log_of(port));
        let (lines, ended) = (self.lines.clone(), Arc::clone(&self.ended));
        thread::spawn(move || {
            while !ended.load(Ordering::Acquire) {
                if let Ok(opened) = SharedPorts.open(&name) {
                    listen_far(opened.input, &ended, |line| {
                        let _ = lines.send((role, line.into()));
                    });
                }
                thread::park_timeout(AGAIN);
            }
        });
    }
}

/// Hears the lines that a relay tells, until it has gone or this is `ended`.
fn listen_far(mut input: Box<dyn Input>, ended: &AtomicBool, mut tell: impl FnMut(LogLine)) {
    let (mut bytes, mut begun) = (vec![0; READ_BYTES], Vec::new());
    while !ended.load(Ordering::Acquire) {
        match input.read(&mut bytes) {
            Ok(count) => begun.extend_from_slice(&bytes[..count]),
            Err(error) if is_pause(&error) => {}
            Err(_) => break,
        }
        while let Some(end) = begun.iter().position(|&byte| byte == b'\n') {
            let line: Vec<u8> = begun.drain(..=end).collect();
            if let Ok(line) = serde_json::from_slice(&line) {
                tell(line);
            }
        }
    }
    input.close(true);
}

impl Drop for Logs {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Release);
    }
}

impl Log {
    /// Reads until the end of it all; what can't be read is tried again, and told once until a line comes.
    fn read(&self, origin: &Origin) {
        let mut told = None;
        while !self.is_ended() {
            let result = match origin {
                Origin::File(path) => self.read_file(path),
                Origin::Tcp(address) => self.read_tcp(address),
                Origin::Probe(serial) => self.read_probe(serial.as_deref()),
            };
            let reason = match result {
                Ok(()) => "its source has ended".to_owned(),
                Err(reason) => reason,
            };
            let is_told = !self.has_come.take() && told.as_ref() == Some(&reason);
            if !is_told && !self.is_ended() {
                told = Some(reason.clone());
                let _ = self.lines.send((self.role, LogEvent::LogLost(reason)));
            }
            thread::park_timeout(AGAIN);
        }
    }

    fn is_ended(&self) -> bool {
        self.ended.load(Ordering::Acquire)
    }

    fn read_file(&self, path: &Path) -> Result<(), String> {
        let failed = |error: io::Error| format!("{}: {error}", path.display());
        let file = open_at_once(path).map_err(failed)?;
        if file.is_terminal() {
            // Opened as a line, so that the system does not take the bytes for text.
            let opened = SharedPorts.open(path).map_err(|state| state.to_string())?;
            return self.listen(opened).map_err(failed);
        }
        fcntl(&file, FcntlArg::F_SETFL(OFlag::empty())).map_err(|error| failed(error.into()))?;
        let kind = file.metadata().map_err(failed)?.file_type();
        let mut has_come = false;
        let mut passed = Passed::default();
        let read = |bytes: &mut [u8]| {
            let read = (&file).read(bytes);
            // After it, since the file may be cut short at any moment before.
            let is_lost = |count| !passed.is_in(&file) || count == 0 && is_replaced(path, &file);
            match read {
                // Nobody writes to the pipe yet.
                Ok(0) if kind.is_fifo() && !has_come => {
                    thread::park_timeout(LOOK);
                    Err(ErrorKind::WouldBlock.into())
                }
                Ok(count) if kind.is_file() && is_lost(count) => Err(io::Error::other(
                    "was cut short or replaced: read from its beginning",
                )),
                Ok(count) => {
                    has_come = true;
                    passed.add(&bytes[..count]);
                    Ok(count)
                }
                error => error,
            }
        };
        self.decode(!kind.is_file(), read).map_err(failed)
    }

    fn read_tcp(&self, address: &str) -> Result<(), String> {
        let failed = |error: io::Error| format!("tcp:{address}: {error}");
        let mut stream = TcpStream::connect(address).map_err(failed)?;
        stream.set_read_timeout(Some(LOOK)).map_err(failed)?;
        self.decode(true, |bytes| stream.read(bytes))
            .map_err(failed)
    }

    /// Decodes what comes over a line that other programs may listen to as well.
    fn listen(&self, opened: Opened) -> io::Result<()> {
        let Opened { mut input, .. } = opened;
        let result = self.decode(false, |bytes| input.read(bytes));
        input.close(true);
        result
    }

    /// Decodes what `read` gives; until it gives nothing, if it `ends` then.
    fn decode(
        &self,
        ends: bool,
        mut read: impl FnMut(&mut [u8]) -> io::Result<usize>,
    ) -> io::Result<()> {
        let mut bytes = vec![0; READ_BYTES];
        let mut decoder = self.table.new_stream_decoder();
        while !self.is_ended() {
            let count = match read(&mut bytes) {
                Ok(0) if ends => return Ok(()),
                Ok(0) => {
                    thread::park_timeout(LOOK);
                    0
                }
                Ok(count) => count,
                Err(error) if is_pause(&error) => 0,
                Err(error) => return Err(error),
            };
            decoder.received(&bytes[..count]);
            loop {
                match decoder.decode() {
                    Ok(frame) => {
                        let level = frame.level().map(|level| level.as_str());
                        let text = frame.display_message().to_string();
                        let line = (self.role, LogEvent::Log { level, text });
                        if self.lines.send(line).is_err() {
                            return Ok(());
                        }
                        self.has_come.set(true);
                    }
                    Err(DecodeError::UnexpectedEof) => break,
                    Err(DecodeError::Malformed) if self.table.encoding().can_recover() => {}
                    Err(DecodeError::Malformed) => {
                        decoder = self.table.new_stream_decoder();
                        break;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Opens what may be a file, a pipe or a terminal: a pipe without a writer is not waited for, and a terminal does not
/// become this program's own.
fn open_at_once(path: &Path) -> io::Result<File> {
    OpenOptions::new()
        .read(true)
        .custom_flags(libc::O_NONBLOCK | libc::O_NOCTTY)
        .open(path)
}

/// The last of what was read of a file: one that was cut short has something else there, also when it has grown again.
#[derive(Default)]
struct Passed {
    last: Vec<u8>,
    /// Where it ends, in bytes from the file's beginning.
    end: u64,
}

impl Passed {
    fn add(&mut self, bytes: &[u8]) {
        self.last.extend_from_slice(bytes);
        let before = self.last.len().saturating_sub(PASSED_BYTES);
        self.last.drain(..before);
        self.end += bytes.len() as u64;
    }

    fn is_in(&self, file: &File) -> bool {
        let mut there = vec![0; self.last.len()];
        let start = self.end - there.len() as u64;
        file.read_exact_at(&mut there, start).is_ok() && there == self.last
    }
}

/// Whether another file than this one has its name by now.
fn is_replaced(path: &Path, file: &File) -> bool {
    // Its name leads to nothing while it is being replaced.
    let (Ok(named), Ok(open)) = (fs::metadata(path), file.metadata()) else {
        return false;
    };
    (named.dev(), named.ino()) != (open.dev(), open.ino())
}

/// The chip of both boards, by probe-rs's name.
const CHIP: &str = "STM32F429ZITx";
/// Between two looks at the buffer, of which the firmware fills 1 kB in no less.
const PROBE_LOOK: Duration = Duration::from_millis(20);

impl Log {
    /// Reads by the probe of this serial number, or by the only one. Of several programs one has the probe,
    /// and the others hear what it hears.
    pub(super) fn read_probe(&self, serial: Option<&str>) -> Result<(), String> {
        let block = find_rtt_control_block_in_raw_file(&self.elf)
            .map_err(|error| error.to_string())?
            .ok_or("the ELF has no RTT buffer")?;
        let wanted = serial.map(ToOwned::to_owned);
        let name = format!("probe-{}", serial.unwrap_or_default());
        let opened = open_source(&name, move || {
            let attached = Buffer::attach(wanted.as_deref(), block);
            let buffer =
                attached.map_err(|reason| State::Failed(PathBuf::from("the probe"), reason))?;
            Ok(Opened {
                input: Box::new(buffer),
                output: Box::new(io::sink()) as Box<dyn Write + Send>,
            })
        });
        let opened = opened.map_err(|state| state.to_string())?;
        self.listen(opened).map_err(|error| error.to_string())
    }
}

/// The buffer of the log in the board's memory.
struct Buffer {
    session: Session,
    rtt: Rtt,
}

impl Buffer {
    fn attach(serial: Option<&str>, block: u64) -> Result<Self, String> {
        let lister = Lister::new();
        let mut probes = lister.list_all();
        if let Some(serial) = serial {
            probes.retain(|probe| probe.serial_number.as_deref() == Some(serial));
        }
        let probe = match probes.as_slice() {
            [probe] => probe,
            [] => return Err("no probe is attached".to_owned()),
            _ => {
                return Err(
                    "several probes: name this board's in the bench file (usb = …)".to_owned(),
                );
            }
        };
        let mut session = probe
            .open()
            .map_err(|error| error.to_string())?
            .attach(CHIP, Permissions::default())
            .map_err(|error| error.to_string())?;
        let mut core = session.core(0).map_err(|error| error.to_string())?;
        let rtt = Rtt::attach_region(&mut core, &ScanRegion::Exact(block))
            .map_err(|error| error.to_string())?;
        drop(core);
        Ok(Self { session, rtt })
    }
}

impl Input for Buffer {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let channel = self.rtt.up_channel(0);
        let channel = channel.ok_or_else(|| io::Error::other("the firmware has no RTT channel"))?;
        let mut core = self.session.core(0).map_err(io::Error::other)?;
        let count = channel.read(&mut core, bytes).map_err(io::Error::other)?;
        if count == 0 {
            drop(core);
            thread::park_timeout(PROBE_LOOK);
            return Err(ErrorKind::TimedOut.into());
        }
        Ok(count)
    }

    fn close(self: Box<Self>, _discards: bool) {}
}
