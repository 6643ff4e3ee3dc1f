//! A log read out of the board's memory by its probe, while the firmware runs on.

use std::io::{self, ErrorKind, Write};
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use probe_rs::probe::list::Lister;
use probe_rs::rtt::{Rtt, ScanRegion, find_rtt_control_block_in_raw_file};
use probe_rs::{Permissions, Session};

use super::Log;
use crate::shared_port::open_source;
use crate::state::State;
use crate::system::{Input, Opened};

/// The chip of both boards, by probe-rs's name.
const CHIP: &str = "STM32F429ZITx";
/// Between two looks at the buffer, of which the firmware fills 1 kB in no less.
const LOOK: Duration = Duration::from_millis(20);

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
            thread::park_timeout(LOOK);
            return Err(ErrorKind::TimedOut.into());
        }
        Ok(count)
    }

    fn close(self: Box<Self>, _discards: bool) {}
}
