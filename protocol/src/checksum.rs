//! The CRC of frames, and the names of configurations by it.

use crc::{CRC_32_ISO_HDLC, Crc};

/// CRC-32/ISO-HDLC: Ethernet's, zip's.
pub(crate) const CRC_32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
