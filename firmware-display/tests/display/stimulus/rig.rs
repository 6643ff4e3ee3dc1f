//! A stimulus with a hand.

use std::f64::consts::TAU;

use firmware_display::phase::Wavelength;
use firmware_display::{ACTUATORS, Stimulus};
use protocol::actuators::{Actuator, DEFAULT_ACTUATORS};
use protocol::{DisplayConfiguration, Mode, Rendering, UpdateRate};

pub const RATES: [UpdateRate; 2] = [UpdateRate::Hz2000, UpdateRate::Hz4000];
pub const MODES: [Mode; 2] = [Mode::Uniform, Mode::Travelling];
/// Volts of one DAC step.
pub const VOLT_PER_STEP: f64 = 10.0 / 65_536.0;
/// What a voltage is off by because of the DAC: half a step of rounding and, of the sine's 2⁻¹⁸ and the
/// 32 767 steps that stand for 5 V, another half.
pub const OFF_V: f64 = VOLT_PER_STEP;
/// The whole gain.
pub const FULL: u32 = 1 << 31;

pub type Volts = [f64; ACTUATORS];

pub struct Rig {
    pub stimulus: Stimulus,
    pub configuration: DisplayConfiguration,
    pub actuators: [Actuator; ACTUATORS],
    pub gain: u32,
    position: i64,
}

impl Rig {
    pub fn new(mode: Mode, update_rate: UpdateRate) -> Self {
        Self::with(
            DisplayConfiguration {
                mode,
                update_rate,
                ..DisplayConfiguration::DEFAULT
            },
            DEFAULT_ACTUATORS,
        )
    }

    pub fn with(configuration: DisplayConfiguration, actuators: [Actuator; ACTUATORS]) -> Self {
        Self {
            stimulus: Stimulus::new(&configuration, &actuators),
            configuration,
            actuators,
            gain: FULL,
            position: 0,
        }
    }

    pub fn hz(&self) -> f64 {
        self.configuration.update_rate.hz().into()
    }

    /// Ticks of so many seconds, to the nearest.
    pub fn ticks(&self, seconds: f64) -> usize {
        (seconds * self.hz()).round() as usize
    }

    pub fn follow(&mut self, wavelength_mm: f64) {
        self.stimulus.follow(wavelength(wavelength_mm), 100.0);
    }

    pub fn configure(&mut self, configuration: DisplayConfiguration) {
        self.configuration = configuration;
        self.stimulus.configure(&configuration, &self.actuators);
    }

    /// Another mode and rendering, and other actuators; `draw` is below its argument.
    pub fn describe(&mut self, draw: &mut impl FnMut(u32) -> u32) {
        let mut configuration = self.configuration;
        configuration.mode = MODES[draw(2) as usize];
        configuration.rendering =
            [Rendering::Fundamental, Rendering::Shape, Rendering::Texture][draw(3) as usize];
        let [differ, modelled] = [draw(2), draw(2)].map(|drawn| drawn == 0);
        self.actuators = DEFAULT_ACTUATORS;
        for actuator in &mut self.actuators {
            if differ {
                actuator.gain_q15 = [0, 1, 330, 16_384, 32_768][draw(5) as usize];
                actuator.inverted = draw(2) == 0;
                actuator.phase = 8_192 * draw(8) as u16;
            }
            if modelled {
                actuator.resonance_dhz = 1_800 + 100 * draw(4) as u16;
            }
        }
        self.configure(configuration);
    }

    pub fn tick(&mut self, counts: i16) -> Volts {
        self.position += i64::from(counts);
        self.stimulus.tick(counts, self.gain);
        self.volts()
    }

    /// `ticks` ticks of `counts` each.
    pub fn rub(&mut self, ticks: usize, counts: i16) -> Vec<Volts> {
        (0..ticks).map(|_| self.tick(counts)).collect()
    }

    /// `ticks` ticks of a hand that is at `position_mm` of the time in s since the first one; it begins
    /// where the hand is.
    pub fn stroke(&mut self, ticks: usize, position_mm: impl Fn(f64) -> f64) -> Vec<Volts> {
        let counts = |tick: usize| (position_mm(tick as f64 / self.hz()) / 0.005).floor() as i64;
        let travels: Vec<_> = (0..ticks)
            .map(|tick| (counts(tick + 1) - counts(tick)) as i16)
            .collect();
        travels
            .into_iter()
            .map(|counts| self.tick(counts))
            .collect()
    }

    /// Brings the hand to where the phase in the fingertip's middle is so many turns, and lets it rest.
    pub fn rest_at(&mut self, turns: f64, wavelength_mm: f64) {
        let target = (turns * wavelength_mm / 0.005).round() as i64;
        while self.position != target {
            self.tick((target - self.position).clamp(-5, 5) as i16);
        }
        let second = self.ticks(1.0);
        self.rub(second, 0);
        assert!(self.stimulus.is_resting());
    }

    /// Where the hand is, in mm from where it began.
    pub fn position_mm(&self) -> f64 {
        self.position as f64 * 0.005
    }

    pub fn volts(&self) -> Volts {
        self.stimulus
            .words()
            .map(|word| (f64::from(word) - 32_768.0) * VOLT_PER_STEP)
    }

    pub fn is_silent(&self) -> bool {
        *self.stimulus.words() == [firmware_display::ZERO_VOLT; ACTUATORS]
    }
}

pub fn wavelength(mm: f64) -> Wavelength {
    Wavelength::new(mm as f32).unwrap()
}

/// Actuators with phases and gains of their own.
pub fn trimmed() -> [Actuator; ACTUATORS] {
    let mut actuators = DEFAULT_ACTUATORS;
    for (index, actuator) in actuators.iter_mut().enumerate() {
        actuator.phase = (index as u16).wrapping_mul(7_919);
        actuator.gain_q15 = 32_768 - 300 * index as u16;
        actuator.inverted = index % 3 == 0;
    }
    actuators
}

/// The balance's corner frequency.
pub fn corner_hz() -> f64 {
    1.0 / (TAU * firmware_display::balance::TIME_CONSTANT_S)
}

/// Each actuator's mean.
pub fn means(volts: &[Volts]) -> Volts {
    std::array::from_fn(|actuator| {
        volts.iter().map(|volts| volts[actuator]).sum::<f64>() / volts.len() as f64
    })
}

/// The largest of all actuators', without its sign.
pub fn largest(volts: &Volts) -> f64 {
    volts
        .iter()
        .fold(0.0, |largest, volt| volt.abs().max(largest))
}
