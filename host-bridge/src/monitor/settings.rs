//! The boards' settings by name, as a person changes them: fields of the configuration on the wire.

use protocol::{Configuration, GAUGES, Refusal, Role};
use serde_json::{Value, json};

/// How a setting is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A whole number, typed.
    Number,
    /// Numbers of gauges, typed without anything between them.
    Gauges,
    /// One of some words, each beside its name on the wire.
    Choice(&'static [(&'static str, &'static str)]),
}

/// A setting.
#[derive(Debug)]
pub struct Setting {
    /// Its name, as on the wire and in the scenes.
    pub name: &'static str,
    /// Its unit; empty if it has none.
    pub unit: &'static str,
    /// How it is given.
    pub kind: Kind,
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
        let value = match configuration {
            Configuration::Sensor(sensor) => json!(sensor),
            Configuration::Display(display) => json!(display),
        };
        let value = value.get(self.name)?;
        let text = value
            .as_str()
            .map_or_else(|| value.to_string(), str::to_owned);
        Some(match self.kind {
            Kind::Number => text,
            Kind::Gauges => gauges(value.as_u64()?),
            Kind::Choice(words) => words.iter().find(|word| word.1 == text)?.0.to_owned(),
        })
    }

    /// The configuration with this setting changed. The board checks its range. Fails if the text is no value of it
    /// at all.
    pub fn changed(
        &self,
        configuration: Configuration,
        text: &str,
    ) -> Result<Configuration, Misread> {
        self.set(configuration, text.trim()).ok_or_else(|| Misread {
            name: self.name,
            text: text.to_owned(),
            wanted: self.wanted(&configuration),
        })
    }

    fn set(&self, configuration: Configuration, text: &str) -> Option<Configuration> {
        let value = match self.kind {
            Kind::Number => json!(text.parse::<u64>().ok()?),
            Kind::Gauges => json!(mask(text)?),
            Kind::Choice(words) => {
                let name = words.iter().find(|word| word.0 == text)?.1;
                name.parse::<bool>()
                    .map_or_else(|_| json!(name), Value::Bool)
            }
        };
        let mut changed = json!(configuration);
        let fields = changed.as_object_mut()?.values_mut().next()?;
        *fields.get_mut(self.name)? = value;
        serde_json::from_value(changed).ok()
    }

    /// What may be given, in words: by the protocol's own check, which names the range of a value that is
    /// beyond it.
    pub fn wanted(&self, configuration: &Configuration) -> String {
        let beyond = |most: &str| {
            let Refusal { low, high, .. } = check(&self.set(*configuration, most)?).err()?;
            Some(format!("{low} to {high}"))
        };
        match self.kind {
            Kind::Choice(words) => {
                let words: Vec<&str> = words.iter().map(|word| word.0).collect();
                words.join(" or ")
            }
            Kind::Gauges => "some of 01234".to_owned(),
            Kind::Number => ["4294967295", "65535", "255"]
                .into_iter()
                .find_map(beyond)
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

fn gauges(mask: u64) -> String {
    let used = (0..8).filter(|gauge| mask & (1 << gauge) != 0);
    used.map(|gauge| gauge.to_string()).collect()
}

fn mask(text: &str) -> Option<u8> {
    let mask = text.chars().try_fold(0, |mask, digit| {
        let gauge = digit.to_digit(10).filter(|gauge| *gauge < GAUGES as u32)?;
        Some(mask | 1_u8.checked_shl(gauge)?)
    })?;
    (mask != 0).then_some(mask)
}

const fn number(name: &'static str, unit: &'static str) -> Setting {
    let kind = Kind::Number;
    Setting { name, unit, kind }
}

const fn choice(
    name: &'static str,
    unit: &'static str,
    words: &'static [(&'static str, &'static str)],
) -> Setting {
    let kind = Kind::Choice(words);
    Setting { name, unit, kind }
}

const METHODS: &[(&str, &str)] = &[
    ("spectrum", "Spectrum"),
    ("counting", "Counting"),
    ("counting-adapted", "AdaptedCounting"),
    ("crossings", "Crossings"),
];
const MODES: &[(&str, &str)] = &[("uniform", "Uniform"), ("travelling", "Travelling")];
const RENDERINGS: &[(&str, &str)] = &[
    ("fundamental", "Fundamental"),
    ("shape", "Shape"),
    ("texture", "Texture"),
];
const RATES: &[(&str, &str)] = &[("2000", "Hz2000"), ("4000", "Hz4000")];
const SWITCH: &[(&str, &str)] = &[("off", "false"), ("on", "true")];

/// The sensor board's settings.
pub static SENSOR: [Setting; 10] = [
    choice("method", "", METHODS),
    number("window_ms", "ms"),
    number("counted_gauge", ""),
    Setting {
        name: "gauges",
        unit: "",
        kind: Kind::Gauges,
    },
    number("waves", "λ"),
    number("valid_percent", "%"),
    choice("force_channel", "", SWITCH),
    number("force_mn_per_v", "mN/V"),
    number("stiffness_n_per_m", "N/m"),
    number("arm_full_scale_um_s", "µm/s"),
];

/// The display board's settings, but for its array, which takes more than a line to describe.
pub static DISPLAY: [Setting; 11] = [
    choice("mode", "", MODES),
    choice("rendering", "", RENDERINGS),
    choice("update_rate", "Hz", RATES),
    number("max_age_ms", "ms"),
    number("fade_in_ms", "ms"),
    number("fade_out_ms", "ms"),
    number("glide_ms", "ms"),
    number("amplitude_mv", "mV"),
    number("reference_lsb", "LSB"),
    number("reference_mn", "mN"),
    number("full_drive_s", "s"),
];

/// The settings of the board of `role`.
pub fn of(role: Role) -> &'static [Setting] {
    match role {
        Role::Sensor => &SENSOR,
        Role::Display => &DISPLAY,
        Role::Host => &[],
    }
}

/// Whose a configuration is.
pub const fn role_of(configuration: &Configuration) -> Role {
    match configuration {
        Configuration::Sensor(_) => Role::Sensor,
        Configuration::Display(_) => Role::Display,
    }
}

#[cfg(test)]
mod tests {
    use postcard_schema::Schema;
    use postcard_schema::schema::DataModelType;
    use protocol::{DisplayConfiguration, SensorConfiguration};

    use super::*;

    #[test]
    fn a_refusal_names_a_setting_as_it_is_typed() {
        for configuration in [
            Configuration::Sensor(SensorConfiguration::DEFAULT),
            Configuration::Display(DisplayConfiguration::DEFAULT),
        ] {
            for setting in of(role_of(&configuration)) {
                let refusals = ["4294967295", "65535", "255"]
                    .into_iter()
                    .filter_map(|beyond| {
                        let set = setting.set(configuration, beyond)?;
                        check(&set).err()
                    });
                let names: Vec<_> = refusals.map(|refusal| refusal.setting.name()).collect();
                assert!(names.iter().all(|name| *name == setting.name), "{names:?}");
                assert_eq!(
                    names.is_empty(),
                    setting.kind != Kind::Number,
                    "{}",
                    setting.name
                );
            }
        }
    }

    #[test]
    fn gauges_are_named_by_their_digits_and_no_others() {
        assert_eq!(mask("01234"), Some(31));
        assert_eq!(mask("31"), Some(0b1010));
        for text in ["", "5", "012345", "a", "9"] {
            assert_eq!(mask(text), None, "{text}");
        }
    }

    #[test]
    fn every_setting_is_a_field_on_the_wire_and_every_variant_of_it_has_a_word() {
        for (shape, settings) in [
            (SensorConfiguration::SCHEMA, &SENSOR[..]),
            (DisplayConfiguration::SCHEMA, &DISPLAY[..]),
        ] {
            let DataModelType::Struct(fields) = shape.ty else {
                panic!("{} is no struct", shape.name);
            };
            for setting in settings {
                let field = fields.iter().find(|field| field.name == setting.name);
                let kind = field.expect(setting.name).ty.ty;
                if let (Kind::Choice(words), DataModelType::Enum(variants)) = (setting.kind, kind) {
                    let named = |name| words.iter().any(|word| word.1 == name);
                    assert!(variants.iter().all(|variant| named(variant.name)));
                    assert_eq!(variants.len(), words.len());
                }
            }
        }
    }
}
