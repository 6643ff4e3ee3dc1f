//! A display with a hand and a sensor at its ends.

use firmware_display::{ACTUATORS, Display};
use protocol::{Contact, DisplayConfiguration, Estimate, GAUGES, GaugeHealth, Mode, Range};

/// Volts of one DAC step.
pub const VOLT_PER_STEP: f64 = 10.0 / 65_536.0;
/// Ticks that the default fade-in takes, and one.
pub const FADED_IN: usize = 41;

pub struct Rig {
    pub display: Display,
    encoder: u16,
    sequence: u32,
}

impl Rig {
    pub fn new(mode: Mode) -> Self {
        Self::with(DisplayConfiguration {
            mode,
            ..DisplayConfiguration::default()
        })
    }

    pub fn with(configuration: DisplayConfiguration) -> Self {
        Self {
            display: Display::new(configuration),
            encoder: 65_000,
            sequence: 0,
        }
    }

    /// The next estimate, valid, of this wavelength.
    pub fn estimate(&mut self, wavelength_mm: f32) {
        self.sequence += 1;
        self.display
            .on_estimate(&valid(self.sequence, wavelength_mm));
    }

    /// The next estimate, which its estimator does not stand by.
    pub fn doubtful(&mut self, wavelength_mm: Option<f32>) {
        self.sequence += 1;
        let estimate = Estimate {
            wavelength_mm,
            valid: false,
            ..valid(self.sequence, 1.0)
        };
        self.display.on_estimate(&estimate);
    }

    /// One tick in which the hand moves by `counts`.
    pub fn tick(&mut self, counts: i16) -> bool {
        self.encoder = self.encoder.wrapping_add_signed(counts);
        self.display.tick(self.encoder)
    }

    /// `ticks` ticks with an estimate of `wavelength_mm` every twentieth; the volts of each.
    pub fn rub(&mut self, ticks: usize, counts: i16, wavelength_mm: f32) -> Vec<[f64; ACTUATORS]> {
        (0..ticks)
            .map(|tick| {
                if tick % 20 == 0 {
                    self.estimate(wavelength_mm);
                }
                self.tick(counts);
                self.volts()
            })
            .collect()
    }

    pub fn volts(&self) -> [f64; ACTUATORS] {
        self.display
            .words()
            .map(|word| (f64::from(word) - 32_768.0) * VOLT_PER_STEP)
    }
}

pub fn valid(sequence: u32, wavelength_mm: f32) -> Estimate {
    Estimate {
        sequence,
        instant_us: u64::from(sequence) * 10_000,
        wavelength_mm: Some(wavelength_mm),
        valid: true,
        confidence: 1.0,
        amplitude_lsb: 100.0,
        counted_mm: None,
        range: Range::T1,
        contact: Contact::Unknown,
        velocity_um_s: 70_000,
        lag_um: None,
        gauges_used: 0b1_1111,
        health: [GaugeHealth::Good; GAUGES],
    }
}
