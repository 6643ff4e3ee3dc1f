//! The log of an emulated board: read from its RTT buffer in RAM, as a probe reads it, and decoded
//! by defmt's own decoder.

use defmt_decoder::{DecodeError, Table};
use object::{Object, ObjectSymbol};
use rigless::emulator::Host;
use rigless::soc::Width;

/// SEGGER's control block: 16 bytes of name, two counts, then the first up-channel, whose fields are
/// name, buffer, size, write offset, read offset, flags, of four bytes each.
const BUFFER: u64 = 24 + 4;
const SIZE: u64 = 24 + 8;
const WRITE_OFFSET: u64 = 24 + 12;
const READ_OFFSET: u64 = 24 + 16;

/// The channel by which a board logs: the first that goes up.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    block: u64,
}

impl Channel {
    /// Finds it in an ELF; none if it has none.
    pub fn find(elf: &[u8]) -> Option<Self> {
        let block = object::File::parse(elf)
            .ok()?
            .symbols()
            .find(|symbol| symbol.name() == Ok("_SEGGER_RTT"))?
            .address();
        Some(Self { block })
    }

    /// Takes what the board has written since the last call.
    pub fn take(&self, host: &mut dyn Host) -> Vec<u8> {
        let mut word = |offset: u64| {
            host.read(self.block + offset, Width::W32)
                .ok()
                .filter(|&word| word <= u32::MAX.into())
        };
        let (Some(buffer), Some(size), Some(write), Some(read)) = (
            word(BUFFER),
            word(SIZE),
            word(WRITE_OFFSET),
            word(READ_OFFSET),
        ) else {
            return Vec::new();
        };
        if size == 0 || write >= size || read >= size || write == read {
            return Vec::new();
        }
        let mut taken = Vec::new();
        let mut at = read;
        while at != write {
            let Ok(byte) = host.read(buffer + at, Width::W8) else {
                return Vec::new();
            };
            taken.push(byte.to_le_bytes()[0]);
            at = (at + 1) % size;
        }
        match host.write(self.block + READ_OFFSET, Width::W32, write) {
            Ok(()) => taken,
            Err(_) => Vec::new(),
        }
    }
}

/// The log of one board.
pub struct Log {
    channel: Channel,
    table: Table,
    bytes: Vec<(u64, Vec<u8>)>,
}

impl Log {
    /// Finds the log's place in an ELF; none if it keeps none.
    pub fn find(elf: &[u8]) -> Option<Self> {
        Some(Self {
            channel: Channel::find(elf)?,
            table: Table::parse(elf).ok()??,
            bytes: Vec::new(),
        })
    }

    /// Takes what the board has logged since the last call.
    pub fn read(&mut self, at_ns: u64, host: &mut dyn Host) {
        let taken = self.channel.take(host);
        if !taken.is_empty() {
            self.bytes.push((at_ns, taken));
        }
    }

    /// The lines logged, with the instant each was read at.
    pub fn lines(&self) -> Vec<(u64, String)> {
        let mut decoder = self.table.new_stream_decoder();
        let mut lines = Vec::new();
        for (at_ns, bytes) in &self.bytes {
            decoder.received(bytes);
            loop {
                match decoder.decode() {
                    Ok(frame) => {
                        let level = frame.level().map_or("", |level| level.as_str());
                        lines.push((*at_ns, format!("{level} {}", frame.display_message())));
                    }
                    Err(DecodeError::UnexpectedEof) => break,
                    Err(DecodeError::Malformed) if self.table.encoding().can_recover() => {}
                    Err(DecodeError::Malformed) => return lines,
                }
            }
        }
        lines
    }
}
