//! What a map can change in a scene.

/// The scene's sections that knobs write to, in the order they are written.
pub const SECTIONS: [&str; 5] = ["surface", "motion", "arm", "contact", "gauges"];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Knob {
    pub section: &'static str,
    /// The CSV's: a scene's key, mostly.
    pub column: &'static str,
    /// The section's lines, with `$` for the value; nothing if the column is the key.
    lines: &'static str,
}

/// A knob and what it is turned to, as TOML writes it (texts without quotes).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    pub knob: Knob,
    pub value: String,
}

const fn key(section: &'static str, column: &'static str) -> Knob {
    lines(section, column, "")
}

const fn lines(section: &'static str, column: &'static str, lines: &'static str) -> Knob {
    Knob {
        section,
        column,
        lines,
    }
}

impl Knob {
    pub const WAVELENGTH: Self = lines(
        "surface",
        "wavelength_mm",
        "specimens = [{ wavelength_mm = $ }]\n",
    );
    pub const SPEED: Self = lines(
        "motion",
        "speed_mm_s",
        "kind = \"constant\"\nspeed_mm_s = $\n",
    );
    /// Of a sinusoidal v of the paper's highest speed (Okamoto et al. 2009, Fig. 7).
    pub const REVERSAL: Self = lines(
        "motion",
        "frequency_hz",
        "kind = \"sinusoid\"\namplitude_mm_s = 70.0\nfrequency_hz = $\n",
    );
    pub const ENCODER: Self = key("arm", "encoder_um");
    /// `none`, `mild`, `strong` or `severe`.
    pub const FRICTION: Self = lines("contact", "friction", "friction = \"$\"\n");
    pub const TANGENTIAL: Self = key("gauges", "tangential");
    pub const SNR: Self = key("gauges", "snr_db");
    pub const SKEW: Self = key("gauges", "skew_us");
    /// Relative to the fundamental.
    pub const SECOND_HARMONIC: Self = key("gauges", "second_harmonic");
    /// Relative to the fundamental at unit gain.
    pub const HUM: Self = key("gauges", "hum_50_hz");
    /// RMS of 1/f noise, relative to the fundamental at unit gain.
    pub const PINK: Self = key("gauges", "pink");
    /// RMS of heights at random, relative to the fundamental.
    pub const RANDOM: Self = key("surface", "random");
    /// Amplitude of a second wave, relative to the fundamental.
    pub const SECOND_WAVE: Self = key("surface", "second_wave");
    /// Its wavelength over λ.
    pub const SECOND_RATIO: Self = key("surface", "second_ratio");
    pub const WORN: Self = key("surface", "worn");

    pub fn at(self, value: f64) -> Setting {
        // Adding 0 takes the sign off −0.
        self.is(&(value + 0.0).to_string())
    }

    pub fn is(self, value: &str) -> Setting {
        Setting {
            knob: self,
            value: value.to_owned(),
        }
    }
}

impl Setting {
    pub fn entries(&self) -> String {
        match self.knob.lines {
            "" => format!("{} = {}\n", self.knob.column, self.value),
            lines => lines.replace('$', &self.value),
        }
    }
}
