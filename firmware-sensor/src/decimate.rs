//! From 4 kHz scans to 1 kHz samples, without aliases.
//!
//! A linear-phase FIR low-pass: a sinc of 500 Hz under a Kaiser window, 31 coefficients. Only the
//! scans' sums that become samples are computed (polyphase). A sinc of half the output's rate is 0 at
//! every fourth scan from its middle: of each millisecond's last scan, only the middle one's is needed. The
//! symmetry of the coefficients is not used: on a Cortex-M4F a pair costs two loads, an addition and a
//! multiply-accumulate either way.

use core::f64::consts::PI;

use protocol::CHANNELS;

use crate::{MID_RAIL_CODE, SAMPLE_RATE_HZ, SCAN_RATE_HZ, SCANS_PER_SAMPLE, Scan};

/// Attenuation that the Kaiser window is made for, in dB.
pub const ATTENUATION_DB: f64 = 80.0;
/// Half of the output's rate: what lies above would alias.
const CUTOFF_HZ: f64 = SAMPLE_RATE_HZ as f64 / 2.0;

/// Groups of [`SCANS_PER_SAMPLE`] scans that a sample depends on.
const GROUPS: usize = 8;
/// Scans that a sample depends on. The newest has weight 0, so that the middle is a scan.
const TAPS: usize = GROUPS * SCANS_PER_SAMPLE;
/// The middle coefficient, and so the delay in scans.
const MIDDLE: usize = TAPS / 2;

/// A sample belongs to the instant this long before its newest scan, at every frequency. In ms.
pub const DELAY_MS: usize = MIDDLE / SCANS_PER_SAMPLE;
const _: () = assert!(
    MIDDLE.is_multiple_of(SCANS_PER_SAMPLE),
    "the delay is a whole number of ms"
);

/// Power gain for white noise, Σh²: what is left of the scans' variance in a sample.
pub const NOISE_GAIN: f32 = 0.217_262;

/// Kaiser's rule for the window's shape, for attenuations above 50 dB.
const KAISER_BETA: f64 = 0.1102 * (ATTENUATION_DB - 8.7);

/// The scan of a group, oldest first, whose delays are those at which the sinc is 0, or its middle.
const LAST: usize = SCANS_PER_SAMPLE - 1;
/// The group with the middle scan.
const MIDDLE_GROUP: usize = MIDDLE / SCANS_PER_SAMPLE;
const _: () = assert!(
    CUTOFF_HZ * 2.0 * SCANS_PER_SAMPLE as f64 == SCAN_RATE_HZ as f64,
    "the sinc is 0 where `LAST` says"
);

/// The filter's coefficients, for any number of [`History`]s.
#[derive(Clone, Debug)]
pub struct AntiAlias {
    /// Newest group first; within a group, oldest scan first, as the ADC delivers them, without the last.
    taps: [[f32; LAST]; GROUPS],
    middle: f32,
}

/// The last scans, as differences from mid-rail.
#[derive(Clone, Debug)]
pub struct History {
    groups: [[[f32; CHANNELS]; SCANS_PER_SAMPLE]; GROUPS],
    /// Groups grow towards lower indices: the next one up is older.
    newest: usize,
}

impl Default for AntiAlias {
    fn default() -> Self {
        Self::new()
    }
}

impl AntiAlias {
    /// Computes the coefficients. Their sum, the gain at 0 Hz, is 1.
    pub fn new() -> Self {
        let mut ideal = [0.0; TAPS];
        let mut sum = 0.0;
        for (delay, tap) in ideal.iter_mut().enumerate().skip(1) {
            let from_middle = delay as f64 - MIDDLE as f64;
            *tap = sinc(2.0 * CUTOFF_HZ / f64::from(SCAN_RATE_HZ) * from_middle)
                * kaiser(from_middle / (MIDDLE - 1) as f64);
            sum += *tap;
        }
        let mut taps = [[0.0; LAST]; GROUPS];
        for (group, taps) in taps.iter_mut().enumerate() {
            for (scan, tap) in taps.iter_mut().enumerate() {
                *tap = (ideal[group * SCANS_PER_SAMPLE + SCANS_PER_SAMPLE - 1 - scan] / sum) as f32;
            }
        }
        let middle = (ideal[MIDDLE] / sum) as f32;
        Self { taps, middle }
    }

    /// Takes four scans, oldest first, and returns the sample of all channels that they complete,
    /// in ADC steps from mid-rail, [`DELAY_MS`] late.
    pub fn step(&self, history: &mut History, scans: &[Scan; SCANS_PER_SAMPLE]) -> [f32; CHANNELS] {
        history.newest = (history.newest + GROUPS - 1) % GROUPS;
        history.groups[history.newest] = scans.map(|scan| scan.map(from_mid_rail));
        let middle = &history.groups[(history.newest + MIDDLE_GROUP) % GROUPS][LAST];
        let mut sample = middle.map(|code| self.middle * code);
        for (age, taps) in self.taps.iter().enumerate() {
            let group = &history.groups[(history.newest + age) % GROUPS];
            for (tap, scan) in taps.iter().zip(group) {
                for (sum, code) in sample.iter_mut().zip(scan) {
                    *sum += tap * code;
                }
            }
        }
        sample
    }
}

impl History {
    /// A past in which every scan was this one, so that starting is no step.
    pub fn settled(scan: &Scan) -> Self {
        Self {
            groups: [[scan.map(from_mid_rail); SCANS_PER_SAMPLE]; GROUPS],
            newest: 0,
        }
    }
}

/// An ADC code as the signal it stands for, in ADC steps from mid-rail.
pub fn from_mid_rail(code: u16) -> f32 {
    (i32::from(code) - i32::from(MID_RAIL_CODE)) as f32
}

/// sin πx / πx.
pub fn sinc(x: f64) -> f64 {
    if x == 0.0 {
        1.0
    } else {
        libm::sin(PI * x) / (PI * x)
    }
}

/// The Kaiser window of [`ATTENUATION_DB`], 1 at 0, defined from −1 to 1.
pub fn kaiser(x: f64) -> f64 {
    bessel_i0(KAISER_BETA * libm::sqrt(1.0 - x * x)) / bessel_i0(KAISER_BETA)
}

/// The modified Bessel function of the first kind and order 0, by its power series.
fn bessel_i0(x: f64) -> f64 {
    let mut term = 1.0;
    let mut sum = 1.0;
    let mut k = 1.0;
    while term > sum * f64::EPSILON {
        term *= (x / (2.0 * k)) * (x / (2.0 * k));
        sum += term;
        k += 1.0;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The coefficient for each delay in scans.
    fn impulse_response() -> [f64; TAPS] {
        let filter = AntiAlias::new();
        core::array::from_fn(|delay| {
            let tap = SCANS_PER_SAMPLE - 1 - delay % SCANS_PER_SAMPLE;
            let tap = filter.taps[delay / SCANS_PER_SAMPLE].get(tap);
            let at_last = if delay == MIDDLE { filter.middle } else { 0.0 };
            f64::from(*tap.unwrap_or(&at_last))
        })
    }

    #[test]
    fn leaves_the_stated_share_of_white_noise() {
        let share: f64 = impulse_response().iter().map(|h| h * h).sum();
        assert!((share - f64::from(NOISE_GAIN)).abs() < 1e-6, "{share}");
    }

    fn gain_db(frequency_hz: f64) -> f64 {
        let (mut re, mut im) = (0.0, 0.0);
        for (delay, h) in impulse_response().iter().enumerate() {
            let angle = 2.0 * PI * frequency_hz * delay as f64 / f64::from(SCAN_RATE_HZ);
            re += h * libm::cos(angle);
            im -= h * libm::sin(angle);
        }
        20.0 * libm::log10(libm::hypot(re, im))
    }

    #[test]
    fn is_flat_within_a_tenth_of_a_decibel_up_to_100_hz() {
        for frequency_hz in 0..=100 {
            let db = gain_db(f64::from(frequency_hz));
            assert!(db.abs() < 0.1, "{db} dB at {frequency_hz} Hz");
        }
    }

    #[test]
    fn is_60_db_down_wherever_it_would_alias_into_the_band() {
        for frequency_hz in 900..=2_000 {
            let db = gain_db(f64::from(frequency_hz));
            assert!(db < -60.0, "{db} dB at {frequency_hz} Hz");
        }
    }

    #[test]
    fn delays_every_frequency_by_the_same_whole_number_of_milliseconds() {
        let h = impulse_response();
        assert_eq!(h[0], 0.0);
        for distance in 1..MIDDLE {
            assert_eq!(h[MIDDLE - distance], h[MIDDLE + distance]);
        }
        assert_eq!(DELAY_MS, 4);
    }

    #[test]
    fn computes_the_convolution_with_its_impulse_response() {
        let filter = AntiAlias::new();
        let h = impulse_response();
        let scan_at = |n: usize| -> Scan {
            core::array::from_fn(|channel| ((n * n * 37 + n * 101 + channel * 911) % 4_096) as u16)
        };
        let mut history = History::settled(&scan_at(0));
        // 32 products of at most 2 048, each with two roundings, in sums not above 2 048 · Σ|h|.
        let bound = 2_048.0 * h.iter().map(|h| h.abs()).sum::<f64>() * 33.0 * 2f64.powi(-24);
        for sample in 0..100 {
            let newest = sample * SCANS_PER_SAMPLE + SCANS_PER_SAMPLE - 1;
            let scans = core::array::from_fn(|i| scan_at(newest + 1 + i - SCANS_PER_SAMPLE));
            let got = filter.step(&mut history, &scans);
            for (channel, got) in got.iter().enumerate() {
                let want: f64 = h
                    .iter()
                    .enumerate()
                    .map(|(delay, h)| {
                        let code = scan_at(newest.saturating_sub(delay))[channel];
                        h * (f64::from(code) - f64::from(MID_RAIL_CODE))
                    })
                    .sum();
                assert!(
                    (f64::from(*got) - want).abs() <= bound,
                    "{got} is not {want}"
                );
            }
        }
    }

    #[test]
    fn starts_settled() {
        let filter = AntiAlias::new();
        let scan = [0, 4_095, 2_048, 1, 4_000, 700];
        let sample = filter.step(&mut History::settled(&scan), &[scan; SCANS_PER_SAMPLE]);
        for (x, code) in sample.iter().zip(scan) {
            let want = f32::from(code) - f32::from(MID_RAIL_CODE);
            assert!(
                (x - want).abs() <= 2_048.0 * 33.0 * f32::EPSILON,
                "{x} is not {want}"
            );
        }
    }
}
