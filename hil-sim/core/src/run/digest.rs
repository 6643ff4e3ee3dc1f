//! One number for a whole run: equal if and only if every link byte, every DAC word and every
//! instant of them is.

use std::hash::Hasher;

use twox_hash::XxHash3_64;

use crate::run::recording::OutputRecord;

/// XXH3 (64 bits) over little-endian bytes, in the order of the calls.
#[derive(Default)]
pub struct Digest(XxHash3_64);

impl Digest {
    /// Every byte of one direction of the link, with its instant in ns.
    pub fn link(&mut self, bytes: &[(u64, u8)]) {
        for (at_ns, byte) in bytes {
            self.0.write(&at_ns.to_le_bytes());
            self.0.write(&[*byte]);
        }
    }

    /// A frame of the board that `mark` stands for, whose bytes follow each other from `at_ns` on.
    pub fn frame(&mut self, mark: u8, at_ns: u64, bytes: &[u8]) {
        self.0.write(&[mark]);
        self.0.write(&at_ns.to_le_bytes());
        self.0.write(bytes);
    }

    /// Every change of the outputs, with its instant.
    pub fn outputs(&mut self, outputs: &[OutputRecord]) {
        for output in outputs {
            self.output(output);
        }
    }

    /// One change of the outputs, with its instant.
    pub fn output(&mut self, output: &OutputRecord) {
        let mut bytes = [0; 8 + 2 * crate::run::recording::ACTUATORS];
        let (instant, words) = bytes.split_at_mut(8);
        instant.copy_from_slice(&output.at_ns.to_le_bytes());
        for (place, word) in words.chunks_exact_mut(2).zip(output.words) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        self.0.write(&bytes);
    }

    /// The digest of all that was written.
    pub fn finish(&self) -> u64 {
        self.0.finish()
    }
}
