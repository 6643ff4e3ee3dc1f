//! What a map can change in a scene.

/// The scene's sections that knobs write to, in the order they are written.
pub const SECTIONS: [&str; 5] = ["surface", "motion", "arm", "contact", "gauges"];
/// The highest speed of every reversing motion, in mm/s: the paper's (Okamoto et al. 2009, Fig. 7).
pub const AMPLITUDE_MM_S: f64 = 70.0;

/// Something that a map changes, named as the CSV's column: a scene's key, mostly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knob {
    /// λ in mm of the one specimen.
    Wavelength,
    /// v in mm/s, constant.
    Speed,
    /// Hz of a sinusoidal v of [`AMPLITUDE_MM_S`].
    Reversal,
    /// The arm encoder's resolution in µm.
    Encoder,
    /// `none`, `mild`, `strong` or `severe`.
    Friction,
    /// Whether the tangential force is measured.
    Tangential,
    /// dB.
    Snr,
    /// How late the gauges' samples are in µs.
    Skew,
    /// Relative to the fundamental.
    SecondHarmonic,
    /// Relative to the fundamental at unit gain.
    Hum,
    /// RMS of 1/f noise, relative to the fundamental at unit gain.
    Pink,
    /// RMS of heights at random, relative to the fundamental.
    Random,
    /// Amplitude of a second wave, relative to the fundamental.
    SecondWave,
    /// Its wavelength over λ.
    SecondRatio,
    /// Share of missing ridges.
    Worn,
}

/// A knob and what it is turned to, as TOML writes it (texts without quotes).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// What is changed.
    pub knob: Knob,
    /// To what.
    pub value: String,
}

impl Knob {
    /// The knob turned to a number.
    pub fn at(self, value: f64) -> Setting {
        // Adding 0 takes the sign off −0.
        self.is(&(value + 0.0).to_string())
    }

    /// The knob turned to a word.
    pub fn is(self, value: &str) -> Setting {
        Setting {
            knob: self,
            value: value.to_owned(),
        }
    }

    /// The CSV's column.
    pub const fn column(self) -> &'static str {
        match self {
            Knob::Wavelength => "wavelength_mm",
            Knob::Speed => "speed_mm_s",
            Knob::Reversal => "frequency_hz",
            Knob::Encoder => "encoder_um",
            Knob::Friction => "friction",
            Knob::Tangential => "tangential",
            Knob::Snr => "snr_db",
            Knob::Skew => "skew_us",
            Knob::SecondHarmonic => "second_harmonic",
            Knob::Hum => "hum_50_hz",
            Knob::Pink => "pink",
            Knob::Random => "random",
            Knob::SecondWave => "second_wave",
            Knob::SecondRatio => "second_ratio",
            Knob::Worn => "worn",
        }
    }

    /// The scene's section, one of [`SECTIONS`].
    pub const fn section(self) -> &'static str {
        match self {
            Knob::Wavelength | Knob::Random | Knob::SecondWave | Knob::SecondRatio | Knob::Worn => {
                "surface"
            }
            Knob::Speed | Knob::Reversal => "motion",
            Knob::Encoder => "arm",
            Knob::Friction => "contact",
            Knob::Tangential
            | Knob::Snr
            | Knob::Skew
            | Knob::SecondHarmonic
            | Knob::Hum
            | Knob::Pink => "gauges",
        }
    }

    /// The section's lines for a value.
    pub fn entries(self, value: &str) -> String {
        match self {
            Knob::Wavelength => format!("specimens = [{{ wavelength_mm = {value} }}]\n"),
            Knob::Speed => format!("kind = \"constant\"\nspeed_mm_s = {value}\n"),
            Knob::Reversal => format!(
                "kind = \"sinusoid\"\namplitude_mm_s = {AMPLITUDE_MM_S:.1}\nfrequency_hz = {value}\n"
            ),
            Knob::Friction => format!("friction = \"{value}\"\n"),
            _ => format!("{} = {value}\n", self.column()),
        }
    }
}
