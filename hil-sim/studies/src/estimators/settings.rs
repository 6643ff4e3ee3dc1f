//! The firmware's own estimators and where their knobs are set. Shared with the example `estimator_cost` of
//! `firmware-sensor`, which counts what each costs: part k there is entry k here.

use protocol::{Method, SensorConfiguration};

/// What is swept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knob {
    /// The longest fit in wavelengths of travel.
    Waves,
    /// How many gauges take part.
    Gauges,
    /// Which gauges take part, bit g for gauge g.
    GaugeSet,
    /// The counting window A in ms.
    Window,
    /// Nothing.
    Fixed,
}

/// One of the firmware's estimators with one of its knobs set; the others are at their defaults.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// The estimator.
    pub method: Method,
    /// The knob.
    pub knob: Knob,
    /// Its value.
    pub value: u16,
}

const fn setting(method: Method, knob: Knob, value: u16) -> Setting {
    Setting {
        method,
        knob,
        value,
    }
}

/// All of them. A knob's values rise.
pub const SETTINGS: [Setting; 14] = [
    setting(Method::Spectrum, Knob::Waves, 2),
    setting(Method::Spectrum, Knob::Waves, 3),
    setting(Method::Spectrum, Knob::Waves, 5),
    setting(Method::Spectrum, Knob::Waves, 8),
    setting(Method::Spectrum, Knob::Gauges, 1),
    setting(Method::Spectrum, Knob::Gauges, 3),
    setting(Method::Spectrum, Knob::Gauges, 5),
    setting(Method::Crossings, Knob::Gauges, 1),
    setting(Method::Crossings, Knob::Gauges, 3),
    setting(Method::Crossings, Knob::Gauges, 5),
    setting(Method::Counting, Knob::Window, 40),
    setting(Method::Counting, Knob::Window, 80),
    setting(Method::Counting, Knob::Window, 160),
    setting(Method::AdaptedCounting, Knob::Fixed, 0),
];

impl Setting {
    /// The setting on top of what a scene asks for.
    pub fn on(&self, scene: SensorConfiguration) -> SensorConfiguration {
        let defaults = SensorConfiguration::DEFAULT;
        let mut configuration = SensorConfiguration {
            method: self.method,
            window_ms: defaults.window_ms,
            gauges: defaults.gauges,
            waves: defaults.waves,
            valid_percent: defaults.valid_percent,
            ..scene
        };
        match self.knob {
            Knob::Waves => configuration.waves = self.value as u8,
            Knob::Gauges => {
                configuration.gauges = match self.value {
                    // The counted one; the outermost ones too; all.
                    1 => 0b00100,
                    3 => 0b10101,
                    _ => 0b11111,
                }
            }
            Knob::GaugeSet => configuration.gauges = self.value as u8,
            Knob::Window => configuration.window_ms = self.value,
            Knob::Fixed => {}
        }
        configuration
    }

    /// The method's name in the chart.
    pub const fn method_name(&self) -> &'static str {
        match self.method {
            Method::Spectrum => "spectrum",
            Method::Crossings => "crossings",
            Method::Counting => "counting",
            Method::AdaptedCounting => "adapted count",
        }
    }

    /// The knob's name in the CSV.
    pub const fn knob_name(&self) -> &'static str {
        match self.knob {
            Knob::Waves => "waves",
            Knob::Gauges => "gauges",
            Knob::GaugeSet => "gauge_set",
            Knob::Window => "window_ms",
            Knob::Fixed => "",
        }
    }
}
