//! A log read out of the board's memory by its probe, while the firmware runs on.

use std::thread;
use std::time::Duration;

use probe_rs::Permissions;
use probe_rs::probe::list::Lister;
use probe_rs::rtt::{Rtt, ScanRegion, find_rtt_control_block_in_raw_file};

use super::{Log, READ_BYTES};

/// The chip of both boards, by probe-rs's name.
const CHIP: &str = "STM32F429ZITx";
/// Between two looks at the buffer, of which the firmware fills 1 kB in no less.
const LOOK: Duration = Duration::from_millis(20);

impl Log {
    /// Reads by the probe of this serial number, or by the only one.
    pub(super) fn read_probe(&self, serial: Option<&str>) -> Result<(), String> {
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
        let block = find_rtt_control_block_in_raw_file(&self.elf)
            .map_err(|error| error.to_string())?
            .ok_or("the ELF has no RTT buffer")?;
        let mut session = probe
            .open()
            .map_err(|error| error.to_string())?
            .attach(CHIP, Permissions::default())
            .map_err(|error| error.to_string())?;
        let mut core = session.core(0).map_err(|error| error.to_string())?;
        let mut rtt = Rtt::attach_region(&mut core, &ScanRegion::Exact(block))
            .map_err(|error| error.to_string())?;
        let mut bytes = vec![0; READ_BYTES];
        self.decode(|| {
            let channel = rtt.up_channel(0).ok_or("the firmware has no RTT channel")?;
            let count = channel
                .read(&mut core, &mut bytes)
                .map_err(|error| error.to_string())?;
            if count == 0 {
                thread::park_timeout(LOOK);
            }
            Ok(Some(bytes[..count].to_vec()))
        })
    }
}
