//! What the numbers of a scene may be.

/// What a number may be, and the words for saying so.
pub(super) struct Bounds {
    /// "is not {what}"
    pub what: &'static str,
    /// "give {give}"
    pub give: &'static str,
    /// Never called with a number that is not finite.
    pub allows: fn(f64) -> bool,
}

/// Faster than any hand, and than the arm's drive allows.
pub(super) const MOST_SPEED_MM_S: f64 = 1000.0;

pub(super) const DURATION: Bounds = Bounds {
    what: "a duration",
    give: "a time above 0 in s, 600 at most",
    allows: |s| s > 0.0 && s <= 600.0,
};
pub(super) const WAVELENGTH: Bounds = Bounds {
    what: "a wavelength",
    give: "a length above 0 in mm (0.01 to 100)",
    allows: |mm| (0.01..=100.0).contains(&mm),
};
pub(super) const LENGTH: Bounds = Bounds {
    what: "a length",
    give: "a length above 0 in mm, 100 000 at most",
    allows: |mm| mm > 0.0 && mm <= 100_000.0,
};
pub(super) const PLACE: Bounds = Bounds {
    what: "a place",
    give: "a place within ± 100 000 mm",
    allows: |mm| mm.abs() <= 100_000.0,
};
pub(super) const SPEED: Bounds = Bounds {
    what: "a speed of a hand",
    give: "a speed in mm/s, −1000 to 1000",
    allows: |mm_s| mm_s.abs() <= MOST_SPEED_MM_S,
};
pub(super) const AMPLITUDE: Bounds = Bounds {
    what: "a hand's highest speed",
    give: "a speed in mm/s, 0 to 1000",
    allows: |mm_s| (0.0..=MOST_SPEED_MM_S).contains(&mm_s),
};
pub(super) const FREQUENCY: Bounds = Bounds {
    what: "a frequency of a hand",
    give: "a frequency above 0 in Hz, 20 at most",
    allows: |hz| hz > 0.0 && hz <= 20.0,
};
pub(super) const LAG: Bounds = Bounds {
    what: "a lag",
    give: "a time in ms, 0 to 1000",
    allows: |ms| (0.0..=1000.0).contains(&ms),
};
pub(super) const DELAY: Bounds = Bounds {
    what: "a delay",
    give: "a time in ms, 0 to 10 000",
    allows: |ms| (0.0..=10_000.0).contains(&ms),
};
pub(super) const SHARE: Bounds = Bounds {
    what: "a share",
    give: "a number from 0 to 1",
    allows: |share| (0.0..=1.0).contains(&share),
};
pub(super) const RATIO: Bounds = Bounds {
    what: "a ratio of two wavelengths",
    give: "a number from 0.1 to 10",
    allows: |ratio| (0.1..=10.0).contains(&ratio),
};
pub(super) const WORN: Bounds = Bounds {
    what: "a share of missing ridges",
    give: "a number from 0 to 0.9",
    allows: |share| (0.0..=0.9).contains(&share),
};
pub(super) const SNR: Bounds = Bounds {
    what: "a signal-to-noise ratio",
    give: "a ratio in dB, −40 to 120, or take it out for no noise",
    allows: |db| (-40.0..=120.0).contains(&db),
};
pub(super) const HUM: Bounds = Bounds {
    what: "an amplitude of hum",
    give: "a number from 0 to 10, relative to the signal",
    allows: |ratio| (0.0..=10.0).contains(&ratio),
};
pub(super) const MAINS_OFF: Bounds = Bounds {
    what: "an offset of the mains",
    give: "a number of Hz, −2 to 2",
    allows: |hz| (-2.0..=2.0).contains(&hz),
};
pub(super) const BOUND: Bounds = Bounds {
    what: "a bound",
    give: "a number above 0",
    allows: |bound| bound > 0.0,
};
pub(super) const ENCODER_STEP: Bounds = Bounds {
    what: "an encoder's resolution",
    give: "a whole multiple of 5 in µm, 5 to 500",
    allows: |um| (5.0..=500.0).contains(&um) && um % 5.0 == 0.0,
};
pub(super) const FORCE_SCALE: Bounds = Bounds {
    what: "a scale of a force channel",
    give: "newton per volt, 0.05 to 20",
    allows: |n_per_v| (0.05..=20.0).contains(&n_per_v),
};
pub(super) const STIFFNESS: Bounds = Bounds {
    what: "a fingertip's stiffness",
    give: "a stiffness in N/m, 10 to 10 000",
    allows: |n_per_m| (10.0..=10_000.0).contains(&n_per_m),
};
pub(super) const STEP: Bounds = Bounds {
    what: "a step",
    give: "a time in µs, 0.1 to 250 (a scan)",
    allows: |us| (0.1..=250.0).contains(&us),
};
pub(super) const RESONANCE: Bounds = Bounds {
    what: "a resonance",
    give: "a frequency in Hz, 10 to 2000, or take it out for none",
    allows: |hz| (10.0..=2000.0).contains(&hz),
};
pub(super) const DAMPING: Bounds = Bounds {
    what: "a damping ratio",
    give: "a number from 0.01 to 0.99",
    allows: |zeta| (0.01..=0.99).contains(&zeta),
};
pub(super) const RELATIVE: Bounds = Bounds {
    what: "a disturbance",
    give: "a number from 0 to 10, relative to the signal",
    allows: |ratio| (0.0..=10.0).contains(&ratio),
};
pub(super) const SKEW: Bounds = Bounds {
    what: "a skew",
    give: "a time in µs, −5000 to 5000",
    allows: |us| us.abs() <= 5000.0,
};
pub(super) const INSTANT: Bounds = Bounds {
    what: "an instant",
    give: "a time in s, 0 to 600",
    allows: |s| (0.0..=600.0).contains(&s),
};
pub(super) const SCALE: Bounds = Bounds {
    what: "a scale",
    give: "a number other than 0, within ± 1e9",
    allows: |scale| scale != 0.0 && scale.abs() <= 1e9,
};
pub(super) const OFFSET_V: Bounds = Bounds {
    what: "an offset at an ADC pin",
    give: "a voltage within ± 1000 V; 1.65 is in the middle of the ADC's range",
    allows: |volts| volts.abs() <= 1000.0,
};
pub(super) const RATE: Bounds = Bounds {
    what: "a recording's rate",
    give: "a rate in Hz, 1 to 10 000 000",
    allows: |hz| (1.0..=1e7).contains(&hz),
};
pub(super) const SPACING: Bounds = Bounds {
    what: "a spacing of samples",
    give: "a length above 0 in mm, 10 at most",
    allows: |mm| mm > 0.0 && mm <= 10.0,
};
pub(super) const FILE_INSTANT: Bounds = Bounds {
    what: "an instant of a recording",
    give: "a time in s within ± 1e10",
    allows: |s| s.abs() <= 1e10,
};
