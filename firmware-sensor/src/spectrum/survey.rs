//! What the spectra have to be fitted: their peaks, and whether one is a harmonic of a longer wave.

use super::fit::Pass;
use super::periodogram::{
    CANDIDATES, Spectrum as Energies, clearest_peak, highest_peak, is_peak, rise, sharpness,
    vertex_mm, wavelength_mm,
};
use super::{MEMORY_WAVES, SAME, SHORTER_LENGTHS, STRONG, Spectrum, off, sidebands};
use crate::float::{larger, smaller};

/// One estimate of so many asks what a peak is a sideband of, and fits the line over the longer lengths, too; those after it
/// take over what it found.
const LONGER_EVERY: u8 = 5;
/// How much higher than the peak an end of the spectrum is where the wave lies beyond it. A random part alone lifts the
/// long end.
const BEYOND: f32 = 1.5;

/// A period of which a peak is the second or third harmonic.
struct Comb {
    /// Waves of the peak in a period, and how many candidates up that is.
    waves: f32,
    up: i8,
    /// The period's other harmonics that are none of the peak's wavelength: of which order, and how many candidates up.
    others: &'static [(f32, i8)],
}
const COMBS: [Comb; 2] = [
    Comb {
        waves: 2.0,
        up: 6,
        others: &[(3.0, -4), (5.0, -8)],
    },
    Comb {
        waves: 3.0,
        up: 10,
        others: &[(2.0, 4), (4.0, -2), (5.0, -4)],
    },
];
/// How high the period's lines stand together, relative to the peak, where the peak's wavelength is not the period. Half of
/// that will do where there are two: chance seldom makes two that fit, the lower one a quarter of the other.
const PERIOD: f32 = 0.4;
/// See [`PERIOD`].
const SECOND: f32 = 0.25;
/// Weight of the average from which on a line is told from the slope that it stands on: some seven waves from a start.
/// Before, how high it is has to do: a strong wave is stood by sooner.
pub(super) const MATURE: f32 = 0.25;

/// A line that has been held for longer than its memory, and has less than this share of its usual energy, is missing. Once it
/// has been for a wave it is gone: another surface has come. The average would hold on to it for ten waves and more, where
/// the new wave is too weak to begin anew; so what it holds counts for less from then on. It goes on all the same if it comes
/// back.
const MISSING: f32 = 0.4;
/// Steps that a wave's travel is counted in: between estimates it is 2.4 of them at least, at the lowest frequency.
pub(super) const STEPS_A_WAVE: u8 = 100;
/// See [`MISSING`].
const KEPT: f32 = 0.3;

/// The spectra's peaks, and what fits are under way.
#[derive(Clone, Debug, Default)]
pub(super) struct Survey {
    /// Travel that it is about.
    pub(super) fresh_mm: f32,
    pub(super) energies: Energies,
    pub(super) line_mm: Option<f32>,
    pub(super) maturity: f32,
    pub(super) presence: f32,
    pub(super) sharpness: f32,
    /// The moment's clearest peak is the line's.
    pub(super) agree: bool,
    /// The line is twice or three times as long as the clearest peak.
    pub(super) longer: bool,
    /// The last peak that was asked about, and the wave that it is a sideband of, or itself.
    pub(super) sideband: (usize, usize),
    pub(super) line_pass: Pass,
    pub(super) wave_pass: Pass,
}

impl Spectrum {
    /// Finds the peaks, and prepares the fits.
    pub(super) fn survey(&mut self) {
        let usable = self.touch.usable;
        let fresh_mm = core::mem::take(&mut self.fresh_mm);
        let now = self.periodogram.energies(usable);
        let (short, energies) = (now.short, now.long);
        let survey = &mut self.survey;
        survey.line_mm = None;
        survey.line_pass.end();
        survey.wave_pass.end();
        if self.periodogram.lands(&now, usable) {
            self.land();
            return;
        }
        self.periodogram.average(&now, fresh_mm);
        let averaged = self.periodogram.averaged();
        let survey = &mut self.survey;
        (survey.fresh_mm, survey.energies) = (fresh_mm, energies);
        let (Some(clearest), Some(momentary)) =
            (clearest_peak(&averaged), clearest_peak(&energies))
        else {
            return;
        };
        // What is highest at an end lies beyond it: a peak is then a harmonic of a longer wave, or the image of a
        // shorter one in knots that are too long for it.
        if BEYOND * averaged[clearest] < larger(averaged[0], averaged[CANDIDATES - 1]) {
            return;
        }
        let kept = if self.line.held_waves > 3.0 {
            peak_at(&averaged, self.line.mm, clearest).unwrap_or(clearest)
        } else {
            clearest
        };
        let longer = self.longer_period(&averaged, &energies, kept);
        let found = longer.map_or(kept, |(period, _)| period);
        self.shorter_so_far = (self.shorter_so_far + 1) % LONGER_EVERY;
        if self.shorter_so_far == 0 {
            let wave = if self.touch.deflection_known {
                found
            } else {
                sidebands::wave_of(&self.periodogram, &averaged, found, usable)
            };
            self.survey.sideband = (found, wave);
        }
        let (sideband, wave) = self.survey.sideband;
        let number = if found == sideband { wave } else { found };
        let longer = longer.filter(|_| number == found);
        let line_mm = longer.map_or_else(|| vertex_mm(&averaged, number, true), |(_, mm)| mm);
        let momentary = fundamental_of(&energies, momentary, number, line_mm);
        let momentary_mm = vertex_mm(&energies, momentary, true);
        let survey = &mut self.survey;
        survey.line_mm = Some(line_mm);
        survey.longer = longer.is_some();
        survey.sharpness = sharpness(&averaged, number);
        survey.maturity = self.periodogram.maturity(number);
        let total: f32 = energies.iter().sum();
        survey.presence = energies[number] / larger(total * averaged[number], f32::MIN_POSITIVE);
        self.forget_what_is_gone(line_mm);
        let here_mm = self.trend.of_average(line_mm);
        let survey = &mut self.survey;
        survey.agree = off(momentary_mm, here_mm) < 0.12;

        let base = self.periodogram.level();
        let strong = self.line.share > STRONG;
        let near = if strong { 0.2 } else { 0.06 };
        let start_mm = if off(self.line.fitted_mm, here_mm) < near
            && (!strong || off(self.line.fitted_mm, momentary_mm) < 0.15)
        {
            self.line.fitted_mm
        } else if survey.agree && !survey.longer {
            momentary_mm
        } else {
            here_mm
        };
        let lengths = if self.shorter_so_far == 0 {
            self.lengths
        } else {
            SHORTER_LENGTHS.min(self.lengths)
        };
        survey.line_pass.begin(start_mm, 1..lengths, usable, base);
        // The short kernel sees a new surface first. What takes a line's place goes on as long as it has a peak.
        let highest = highest_peak(&short);
        let goes_on = self
            .line
            .is_gone()
            .then_some(highest)
            .flatten()
            .and_then(|highest| peak_at(&short, self.wave.mm, highest))
            .map(|_| self.wave.mm);
        let newest = highest
            .map(|number| vertex_mm(&short, number, false))
            .filter(|&mm| {
                let known = self.known_mm > 0.0 && off(mm, self.known_mm) > 0.25;
                off(mm, here_mm) > 0.12 && (known || off(mm, self.wave.mm) < SAME)
            });
        let wave_mm = goes_on
            .or(newest)
            .or((!survey.agree).then_some(momentary_mm));
        if let Some(mm) = wave_mm {
            let start_mm = if off(self.wave.mm, mm) < 0.06 {
                self.wave.mm
            } else {
                mm
            };
            let lengths = 0..3.min(self.lengths);
            survey.wave_pass.begin(start_mm, lengths, usable, base);
        }
    }

    /// See [`MISSING`].
    #[inline(never)]
    fn forget_what_is_gone(&mut self, line_mm: f32) {
        let is_missing = self.line.held_waves > MEMORY_WAVES && self.survey.presence < MISSING;
        if !is_missing {
            self.missing_steps = 0;
            return;
        }
        let steps = f32::from(STEPS_A_WAVE) * self.survey.fresh_mm / line_mm + 0.5;
        self.missing_steps = self.missing_steps.saturating_add(steps as u8);
        if self.missing_steps > STEPS_A_WAVE {
            self.missing_steps = 0;
            self.periodogram.forget(KEPT);
        }
    }

    /// A period of which the peak is the second or third harmonic, and its candidate. What tells it is the lines that it
    /// explains and the peak's wavelength does not: of a weave they are high, though the period's own may be the least.
    fn longer_period(
        &mut self,
        averaged: &Energies,
        energies: &Energies,
        peak: usize,
    ) -> Option<(usize, f32)> {
        if self.refused > 0 {
            self.refused -= 1;
            return None;
        }
        let peak_mm = vertex_mm(averaged, peak, true);
        for comb in &COMBS {
            let period_mm = comb.waves * peak_mm;
            let Some(period) = line_at(averaged, peak, comb.up, period_mm) else {
                continue;
            };
            let young = self.periodogram.maturity(period) < MATURE;
            let is_high = young && averaged[period] > PERIOD * averaged[peak];
            let own = rise(averaged, period);
            if own <= 0.0 && !is_high {
                continue;
            }
            let (mut sum, mut highest, mut second) = (own, own, 0.0);
            let mut now = energies[period];
            for &(order, up) in comb.others {
                if let Some(number) = line_at(averaged, peak, up, period_mm / order) {
                    let height = larger(rise(averaged, number), 0.0);
                    sum += height;
                    now += energies[number];
                    second = larger(second, smaller(height, highest));
                    highest = larger(highest, height);
                }
            }
            let least = PERIOD * rise(averaged, peak);
            let are_two = second > SECOND * highest && sum > 0.5 * least;
            let explains = own > 0.0 && (sum > least || are_two);
            if now > 0.09 * energies[peak] && (explains || is_high) {
                return Some((period, period_mm));
            }
        }
        None
    }
}

/// The peak `up` candidates from `peak`, or beside that, whose line is at `mm`.
fn line_at(energies: &Energies, peak: usize, up: i8, mm: f32) -> Option<usize> {
    let near = peak.checked_add_signed(isize::from(up))?;
    (near.saturating_sub(1)..near + 2)
        .find(|&i| is_peak(energies, i) && off(vertex_mm(energies, i, true), mm) < 0.06)
}

/// The peak at `mm`, if there is one that is not much lower than peak `number`.
fn peak_at(energies: &Energies, mm: f32, number: usize) -> Option<usize> {
    (1..CANDIDATES - 1)
        .filter(|&i| is_peak(energies, i) && energies[i] > 0.4 * energies[number])
        .find(|&i| mm > 0.0 && off(wavelength_mm(i), mm) < 0.11)
}

/// The moment's clearest peak, or the line's where that peak is its second or third harmonic.
fn fundamental_of(energies: &Energies, peak: usize, line: usize, line_mm: f32) -> usize {
    let ratio = line_mm / wavelength_mm(peak);
    if (ratio - 2.0).abs() < 0.2 || (ratio - 3.0).abs() < 0.3 {
        for i in [line, line - 1, line + 1] {
            if is_peak(energies, i) && energies[i] > 0.09 * energies[peak] {
                return i;
            }
        }
    }
    peak
}

#[cfg(test)]
mod tests {
    use protocol::SensorConfiguration;

    use super::super::periodogram::PER_OCTAVE;
    use super::*;

    const PEAK: usize = 9;

    /// A peak, and one that is a period of two or three of its waves, so high by comparison.
    fn energies(up: usize, height: f32) -> Energies {
        let mut energies = [0.001; CANDIDATES];
        energies[PEAK] = 3.0;
        energies[PEAK + up] = 3.0 * height;
        energies
    }

    #[test]
    fn a_peak_at_twice_or_three_times_the_wavelength_is_the_period() {
        for (up, ratio) in [(PER_OCTAVE, 2.0), (10, 3.0)] {
            let found = |averaged, now| {
                Spectrum::new(&SensorConfiguration::DEFAULT).longer_period(
                    &energies(up, averaged),
                    &energies(up, now),
                    PEAK,
                )
            };
            let (number, mm) = found(0.41, 0.1).expect("a period");
            assert_eq!(number, PEAK + up);
            assert!(off(mm, ratio * wavelength_mm(PEAK)) < 0.02, "{mm} mm");
            // Much lower on the average, or hardly there at the moment.
            assert_eq!(found(0.39, 0.1), None);
            assert_eq!(found(0.41, 0.08), None);
        }
        // A candidate further or less far it is one only within 6 % of twice or three times.
        for (up, is_period) in [(5, false), (7, false), (8, false), (9, true), (11, false)] {
            let askew = energies(up, 0.9);
            let mut spectrum = Spectrum::new(&SensorConfiguration::DEFAULT);
            let found = spectrum.longer_period(&askew, &askew, PEAK);
            let wanted = is_period.then_some(PEAK + up);
            assert_eq!(found.map(|found| found.0), wanted, "{up} candidates up");
        }
    }

    #[test]
    fn a_comb_has_its_lines_at_the_candidates_next_to_them() {
        let nearest =
            |waves: f32, order: f32| (PER_OCTAVE as f32 * libm::log2f(waves / order)).round() as i8;
        for comb in &COMBS {
            assert_eq!(comb.up, nearest(comb.waves, 1.0));
            for &(order, up) in comb.others {
                assert_ne!(order % comb.waves, 0.0, "the peak's own");
                assert_eq!(up, nearest(comb.waves, order), "{order} of {}", comb.waves);
            }
        }
    }

    #[test]
    fn a_periods_other_lines_tell_it_together() {
        let found = |period: f32, third: f32| {
            let mut weave = [0.001; CANDIDATES];
            for (number, height) in [(PEAK, 1.0), (PEAK + PER_OCTAVE, period), (PEAK - 4, third)] {
                weave[number] = height;
            }
            let mut spectrum = Spectrum::new(&SensorConfiguration::DEFAULT);
            spectrum
                .longer_period(&weave, &weave, PEAK)
                .map(|(number, _)| number)
        };
        let twice = Some(PEAK + PER_OCTAVE);
        assert_eq!(found(0.05, 0.4), twice);
        // Two that agree may be lower than one, and one that is much lower than the other does not agree.
        assert_eq!(found(0.11, 0.11), twice);
        assert_eq!(found(0.1, 0.28), twice);
        assert_eq!(found(0.09, 0.09), None);
        assert_eq!(found(0.05, 0.28), None);
        // Without a line of its own there is no period.
        assert_eq!(found(0.001, 0.9), None);
    }

    #[test]
    fn what_is_high_and_flat_is_no_period_once_that_can_be_told() {
        let mut slope = energies(PER_OCTAVE, 0.45);
        for beside in [1, 2] {
            slope[PEAK + PER_OCTAVE + beside] = 1.3;
            slope[PEAK + PER_OCTAVE - beside] = 1.3;
        }
        for (weight, is_period) in [(0.24, true), (0.26, false)] {
            let mut spectrum = Spectrum::new(&SensorConfiguration::DEFAULT);
            spectrum.periodogram.restart(&slope, weight);
            let found = spectrum.longer_period(&slope, &slope, PEAK);
            assert_eq!(found.is_some(), is_period, "weight {weight}");
        }
    }

    #[test]
    fn a_period_that_was_refused_is_not_asked_about_for_a_while() {
        let twice = energies(PER_OCTAVE, 0.9);
        let mut spectrum = Spectrum::new(&SensorConfiguration::DEFAULT);
        spectrum.refused = 2;
        for _ in 0..2 {
            assert_eq!(spectrum.longer_period(&twice, &twice, PEAK), None);
        }
        assert!(spectrum.longer_period(&twice, &twice, PEAK).is_some());
    }

    #[test]
    fn the_line_takes_the_place_of_a_peak_that_is_its_second_or_third_harmonic() {
        for (up, ratio) in [(PER_OCTAVE, 2.0), (10, 3.0)] {
            let line = PEAK + up;
            let at = |height, beside: usize, off_by: f32| {
                let energies = energies(up + beside - 1, height);
                let line_mm = (ratio + off_by) * wavelength_mm(PEAK);
                fundamental_of(&energies, PEAK, line, line_mm)
            };
            for beside in 0..3 {
                assert_eq!(at(0.1, beside, 0.0), line + beside - 1);
                assert_eq!(at(0.08, beside, 0.0), PEAK);
            }
            for off_by in [0.19, -0.19] {
                assert_eq!(at(0.1, 1, off_by), line);
            }
            for off_by in [0.31, -0.31] {
                assert_eq!(at(0.1, 1, off_by), PEAK);
            }
        }
        assert_eq!(
            fundamental_of(&energies(PER_OCTAVE, 1.0), PEAK, PEAK, wavelength_mm(PEAK)),
            PEAK
        );
    }

    #[test]
    fn a_peak_is_found_where_it_is_expected_unless_it_is_much_lower() {
        let twice_mm = 2.0 * wavelength_mm(PEAK);
        let found = |height, mm| peak_at(&energies(PER_OCTAVE, height), mm, PEAK);
        assert_eq!(found(0.41, 1.1 * twice_mm), Some(PEAK + PER_OCTAVE));
        assert_eq!(found(0.41, twice_mm / 1.1), Some(PEAK + PER_OCTAVE));
        for (height, mm) in [(0.39, twice_mm), (0.9, 1.13 * twice_mm), (0.9, 0.0)] {
            assert_eq!(found(height, mm), None);
        }
    }
}
