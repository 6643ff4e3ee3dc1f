//! The boards' settings by name, as a person changes them.

use protocol::{Configuration, DisplayConfiguration, Refusal, Role, SensorConfiguration};

use super::words::{METHODS, MODES, RATES, RENDERINGS, SWITCH, word};

/// How a setting is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A whole number, typed.
    Number,
    /// Numbers of gauges, typed without anything between them.
    Gauges,
    /// One of some words.
    Choice(&'static [&'static str]),
}

/// A setting.
#[derive(Debug)]
pub struct Setting {
    /// Its name, as in the scenes.
    pub name: &'static str,
    /// Its unit; empty if it has none.
    pub unit: &'static str,
    /// How it is given.
    pub kind: Kind,
    get: fn(&Configuration) -> Option<String>,
    set: fn(&mut Configuration, &str) -> Option<()>,
}

/// Why a text is no value of a setting.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name}: {text:?} is none of its values: give {wanted}")]
pub struct Misread {
    name: &'static str,
    text: String,
    wanted: String,
}

impl Setting {
    /// Its value in words; none if the configuration is the other board's.
    pub fn value(&self, configuration: &Configuration) -> Option<String> {
        (self.get)(configuration)
    }

    /// The configuration with this setting changed. The board checks its range.
    ///
    /// # Errors
    /// If the text is no value of it at all.
    pub fn changed(
        &self,
        configuration: Configuration,
        text: &str,
    ) -> Result<Configuration, Misread> {
        let mut changed = configuration;
        (self.set)(&mut changed, text.trim())
            .map(|()| changed)
            .ok_or_else(|| Misread {
                name: self.name,
                text: text.to_owned(),
                wanted: self.wanted(&configuration),
            })
    }

    /// What may be given, in words: by the protocol's own check, which names the range of a value that is
    /// beyond it.
    pub fn wanted(&self, configuration: &Configuration) -> String {
        match self.kind {
            Kind::Choice(words) => words.join(" or "),
            Kind::Gauges => "some of 01234".to_owned(),
            Kind::Number => ["4294967295", "65535", "255"]
                .into_iter()
                .find_map(|most| {
                    let mut beyond = *configuration;
                    (self.set)(&mut beyond, most)?;
                    let Refusal { low, high, .. } = check(&beyond).err()?;
                    Some(format!("{low} to {high}"))
                })
                .unwrap_or_else(|| "a whole number".to_owned()),
        }
    }
}

fn check(configuration: &Configuration) -> Result<(), Refusal> {
    match configuration {
        Configuration::Sensor(sensor) => sensor.check(),
        Configuration::Display(display) => display.check(),
    }
}

const fn sensor(configuration: &Configuration) -> Option<&SensorConfiguration> {
    match configuration {
        Configuration::Sensor(sensor) => Some(sensor),
        Configuration::Display(_) => None,
    }
}

const fn sensor_mut(configuration: &mut Configuration) -> Option<&mut SensorConfiguration> {
    match configuration {
        Configuration::Sensor(sensor) => Some(sensor),
        Configuration::Display(_) => None,
    }
}

const fn display(configuration: &Configuration) -> Option<&DisplayConfiguration> {
    match configuration {
        Configuration::Display(display) => Some(display),
        Configuration::Sensor(_) => None,
    }
}

const fn display_mut(configuration: &mut Configuration) -> Option<&mut DisplayConfiguration> {
    match configuration {
        Configuration::Display(display) => Some(display),
        Configuration::Sensor(_) => None,
    }
}

fn meaning<T: Copy>(words: &[(&str, T)], text: &str) -> Option<T> {
    words
        .iter()
        .find(|(word, _)| *word == text)
        .map(|(_, value)| *value)
}

fn gauges(mask: u8) -> String {
    (0..8)
        .filter(|gauge| mask & (1 << gauge) != 0)
        .map(|gauge| gauge.to_string())
        .collect()
}

fn mask(text: &str) -> Option<u8> {
    text.chars().try_fold(0, |mask, digit| {
        Some(mask | 1_u8.checked_shl(digit.to_digit(8)?)?)
    })
}

/// A setting that is a whole number.
macro_rules! number {
    ($of:ident, $of_mut:ident, $field:ident, $unit:literal) => {
        Setting {
            name: stringify!($field),
            unit: $unit,
            kind: Kind::Number,
            get: |configuration| Some($of(configuration)?.$field.to_string()),
            set: |configuration, text| {
                $of_mut(configuration)?.$field = text.parse().ok()?;
                Some(())
            },
        }
    };
}

/// A setting that is one of some words.
macro_rules! choice {
    ($of:ident, $of_mut:ident, $field:ident, $unit:literal, $words:ident) => {
        Setting {
            name: stringify!($field),
            unit: $unit,
            kind: Kind::Choice(&{
                let mut words = [""; $words.len()];
                let mut index = 0;
                while index < words.len() {
                    words[index] = $words[index].0;
                    index += 1;
                }
                words
            }),
            get: |configuration| Some(word(&$words, $of(configuration)?.$field).to_owned()),
            set: |configuration, text| {
                $of_mut(configuration)?.$field = meaning(&$words, text)?;
                Some(())
            },
        }
    };
}

/// The sensor board's settings.
pub static SENSOR: [Setting; 10] = [
    choice!(sensor, sensor_mut, method, "", METHODS),
    number!(sensor, sensor_mut, window_ms, "ms"),
    number!(sensor, sensor_mut, counted_gauge, ""),
    Setting {
        name: "gauges",
        unit: "",
        kind: Kind::Gauges,
        get: |configuration| Some(gauges(sensor(configuration)?.gauges)),
        set: |configuration, text| {
            sensor_mut(configuration)?.gauges = mask(text)?;
            Some(())
        },
    },
    number!(sensor, sensor_mut, waves, "λ"),
    number!(sensor, sensor_mut, valid_percent, "%"),
    choice!(sensor, sensor_mut, force_channel, "", SWITCH),
    number!(sensor, sensor_mut, force_mn_per_v, "mN/V"),
    number!(sensor, sensor_mut, stiffness_n_per_m, "N/m"),
    number!(sensor, sensor_mut, arm_full_scale_um_s, "µm/s"),
];

/// The display board's settings, but for its array, which takes more than a line to describe.
pub static DISPLAY: [Setting; 11] = [
    choice!(display, display_mut, mode, "", MODES),
    choice!(display, display_mut, rendering, "", RENDERINGS),
    choice!(display, display_mut, update_rate, "Hz", RATES),
    number!(display, display_mut, max_age_ms, "ms"),
    number!(display, display_mut, fade_in_ms, "ms"),
    number!(display, display_mut, fade_out_ms, "ms"),
    number!(display, display_mut, glide_ms, "ms"),
    number!(display, display_mut, amplitude_mv, "mV"),
    number!(display, display_mut, reference_lsb, "LSB"),
    number!(display, display_mut, reference_mn, "mN"),
    number!(display, display_mut, full_drive_s, "s"),
];

/// The settings of the board of `role`.
pub fn of(role: Role) -> &'static [Setting] {
    match role {
        Role::Sensor => &SENSOR,
        Role::Display => &DISPLAY,
        Role::Host => &[],
    }
}
