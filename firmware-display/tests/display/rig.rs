//! A display with a hand and a sensor at its ends.

use firmware_display::{ACTUATORS, Display, Output, Senses, Settings, ZERO_VOLT};
use protocol::actuators::{ACTUATOR_BLOCK, Actuator};
use protocol::{
    Actuators, Configuration, Contact, DisplayConfiguration, DisplayState, Estimate, GAUGES,
    GaugeHealth, Range, UpdateRate,
};

pub const RATES: [UpdateRate; 2] = [UpdateRate::Hz2000, UpdateRate::Hz4000];
pub const SILENCE: [u16; ACTUATORS] = [ZERO_VOLT; ACTUATORS];
pub const HEALTHY: Senses = Senses {
    stop_input_open: false,
    alarm: false,
    transfer: firmware_display::Transfer::Done,
    clear_fell: false,
    is_clear: false,
    readback: firmware_display::Readback::None,
    unheard: false,
    missed_ticks: 0,
};

/// Settings of a board that was asked for these.
pub fn settings(
    configuration: &DisplayConfiguration,
    described: &[Actuator; ACTUATORS],
) -> Settings {
    let mut settings = Settings::DEFAULT;
    for first in (0..ACTUATORS).step_by(ACTUATOR_BLOCK) {
        let block = Actuators {
            first: first as u8,
            actuators: described[first..first + ACTUATOR_BLOCK].try_into().unwrap(),
        };
        assert_eq!(settings.on_actuators(&block), None);
    }
    let asked = Configuration::Display(DisplayConfiguration {
        actuators: protocol::actuators::hash(described),
        ..*configuration
    });
    let refused = settings
        .on_configure(&protocol::Configure::anyway(asked))
        .refused;
    assert_eq!(refused, None, "{configuration:?}");
    settings
}

/// Settings of a board that was asked for this configuration of the default actuators.
pub fn configured(configuration: &DisplayConfiguration) -> Settings {
    settings(configuration, &protocol::actuators::DEFAULT_ACTUATORS)
}

/// A configuration at a rate, all else by default.
pub fn at(update_rate: UpdateRate) -> DisplayConfiguration {
    DisplayConfiguration {
        update_rate,
        ..DisplayConfiguration::DEFAULT
    }
}

pub struct Rig {
    pub display: Display,
    pub senses: Senses,
    /// What the last tick asked for.
    pub output: Output,
    rate: UpdateRate,
    ticks: u64,
    encoder: u16,
    sequence: u32,
}

impl Rig {
    /// A display that has started.
    pub fn new(configuration: &DisplayConfiguration) -> Self {
        let mut rig = Self::of(Display::new(&configured(configuration), None));
        rig.display.started(Ok(()));
        rig
    }

    pub fn of(display: Display) -> Self {
        Self {
            rate: display.configuration().update_rate,
            display,
            senses: HEALTHY,
            output: Output::default(),
            ticks: 0,
            encoder: 65_000,
            sequence: 0,
        }
    }

    /// One that has followed the hand at full drive for 200 ms.
    pub fn driving(configuration: &DisplayConfiguration) -> Self {
        let mut rig = Self::new(configuration);
        rig.rub(200, 2.0);
        assert_eq!(rig.display.state(), DisplayState::Driving);
        assert!(!rig.is_silent());
        rig
    }

    pub fn state(&self) -> DisplayState {
        self.display.state()
    }

    pub fn is_silent(&self) -> bool {
        *self.display.words() == SILENCE
    }

    /// Ticks in `ms` milliseconds.
    pub fn ticks(&self, ms: u32) -> u32 {
        ms * self.rate.hz() / 1_000
    }

    /// Takes a configuration; ticks come at its rate from now on.
    pub fn configure(&mut self, configuration: &DisplayConfiguration) {
        self.display.configure(&configured(configuration));
        self.rate = configuration.update_rate;
    }

    /// The next estimate, which is sound and of this wavelength.
    pub fn estimate(&mut self, wavelength_mm: f32) {
        self.tell(sound(0, wavelength_mm));
    }

    /// The next estimate.
    pub fn tell(&mut self, estimate: Estimate) {
        self.sequence += 1;
        self.display.on_estimate(&Estimate {
            sequence: self.sequence,
            ..estimate
        });
    }

    /// One tick in which the hand moves by `counts`.
    pub fn tick(&mut self, counts: i16) -> Output {
        self.encoder = self.encoder.wrapping_add_signed(counts);
        self.ticks += 1;
        self.output = self.display.tick(self.encoder, &self.senses);
        self.output
    }

    /// One tick of a hand at 70 mm/s.
    pub fn move_on(&mut self) -> Output {
        // 7 counts a tick at 2 kHz, 3 and 4 in turn at 4 kHz.
        let counts = 14_000 * (self.ticks + 1) / u64::from(self.rate.hz())
            - 14_000 * self.ticks / u64::from(self.rate.hz());
        self.tick(counts as i16)
    }

    /// `ms` milliseconds of rubbing at 70 mm/s with an estimate of `wavelength_mm` every 10 ms.
    pub fn rub(&mut self, ms: u32, wavelength_mm: f32) {
        self.rub_while(ms, wavelength_mm, |_| true);
    }

    /// The same for as long as `goes_on`. Returns the ticks.
    pub fn rub_while(
        &mut self,
        most_ms: u32,
        wavelength_mm: f32,
        mut goes_on: impl FnMut(&Self) -> bool,
    ) -> u32 {
        let ticks = self.ticks(most_ms);
        for tick in 0..ticks {
            if self.ticks.is_multiple_of(u64::from(self.ticks(10))) {
                self.estimate(wavelength_mm);
            }
            self.move_on();
            if !goes_on(self) {
                return tick + 1;
            }
        }
        ticks
    }

    /// Ticks, at most those of `most_ms`, until all words are 0 V; the hand goes on and no estimate comes.
    pub fn silent_after(&mut self, most_ms: u32) -> Option<u32> {
        (1..=self.ticks(most_ms)).find(|_| {
            self.move_on();
            self.is_silent()
        })
    }

    /// The same, until they stay so up to `most_ms`: a sine crosses 0 V, too.
    pub fn stays_silent_after(&mut self, most_ms: u32) -> Option<u32> {
        let ticks = self.ticks(most_ms);
        let sounding = (1..=ticks).filter(|_| {
            self.move_on();
            !self.is_silent()
        });
        let last = sounding.last().unwrap_or(0);
        (last < ticks).then_some(last + 1)
    }
}

/// An estimate that nothing is wrong with.
pub fn sound(sequence: u32, wavelength_mm: f32) -> Estimate {
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
