//! The four converters as the output task sees them.

use firmware_display::dac81416::{self, CHIPS};
use firmware_display::look::{self, Look};
use firmware_display::{ACTUATORS, ConverterFault, Readback, Transfer};

use crate::chain::Chain;
use crate::clear::ClearGuard;
use crate::load::Load;

/// The chips, the line that makes their words voltages, and the one that keeps them at 0 V.
pub struct Converters {
    chain: Chain,
    _load: Load,
    clear: ClearGuard,
}

impl Converters {
    /// The converters as power, or whatever ran before, left them; CLR is low.
    pub fn new(chain: Chain, load: Load, clear: ClearGuard) -> Self {
        Self {
            chain,
            _load: load,
            clear,
        }
    }

    /// Brings all chips from any state to streaming, at 0 V and with CLR low, and looks whether each
    /// holds what it was given.
    ///
    /// # Errors
    /// The first register that does not.
    pub fn start(&mut self) -> Result<(), ConverterFault> {
        let started = (0..CHIPS).try_for_each(|chip| self.start_chip(chip));
        self.chain.open();
        self.clear.start();
        started
    }

    fn start_chip(&mut self, chip: usize) -> Result<(), ConverterFault> {
        for write in dac81416::start_up() {
            self.exchange(chip, write)?;
        }
        for content in look::at_start() {
            self.exchange(chip, dac81416::read(content.register))?;
            let answer = self.exchange(chip, dac81416::ANSWER)?;
            look::check(chip, &content, answer)?;
        }
        self.exchange(chip, dac81416::STREAM)?;
        Ok(())
    }

    /// Writes a frame to a chip and returns what came back meanwhile, with no update under way.
    ///
    /// # Errors
    /// The frame did not get out.
    pub fn exchange(
        &mut self,
        chip: usize,
        frame: look::Bytes,
    ) -> Result<look::Bytes, ConverterFault> {
        let fault = ConverterFault::Transfer { chip: chip as u8 };
        self.chain.exchange(chip, frame).ok_or(fault)
    }

    /// Starts to load every channel; all of them change on one LDAC edge. Looks into a chip if asked to.
    pub fn update(&mut self, words: &[u16; ACTUATORS], look: Option<Look>) {
        self.chain.send(words, look);
    }

    /// Looks into a chip in a tick without an update.
    pub fn look(&mut self, look: Look) {
        self.chain.look(look);
    }

    /// How the last update went, and the last look, to be asked once a tick before the next.
    pub fn finish(&mut self) -> (Transfer, Readback) {
        self.chain.finish()
    }

    /// Whether CLR is low: the chips are at 0 V and take no words.
    pub fn is_clear(&self) -> bool {
        self.clear.is_low()
    }

    /// Keeps CLR off for 2 ms from now, unless it has fallen since it was looked at: `was_clear` is what
    /// [`Converters::is_clear`] said in this tick.
    pub fn hold_off(&mut self, was_clear: bool) {
        self.clear.hold_off(was_clear);
    }
}
