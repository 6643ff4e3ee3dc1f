//! The default estimator: a spectrum over travel, averaged over fresh ground, and a fit to its line.
//!
//! ```text
//! touches ─> knots ─┬─> periodogram ─> the line: where it has stayed put ─┐
//!                   │        └───────> the wave: what there is now ───────┼─> fits ─> evidence ─> λ̂, confidence
//!                   └──────────────────────────────────────────────────────┘
//! ```
//!
//! Position, not time, is the independent variable, so a change of speed or direction changes nothing. On
//! a real surface the wave explains a quarter of what the gauges say, and chance explains nearly as much:
//! what tells them apart is whether a line stays where it is over fresh ground. So each estimate has two
//! suppositions. The *line* is the highest peak of the averaged spectrum; the *wave* is the highest peak of
//! the moment, where that is elsewhere: a new surface. Either is refined by least squares over the last
//! waves of the path, and weighed by [`evidence`]; the more probable one is λ̂.
//!
//! λ̂ is the period: a line at 2 λ or 3 λ that is at least 0.4 times as high as one at λ is taken for the
//! fundamental, if a fit over three waves finds it there. Of waves that have no common period the
//! strongest is λ̂.
//!
//! The work of an estimate is spread over the ten milliseconds before it: see [`Spectrum::push`].

use protocol::{GAUGES, SensorConfiguration};

use crate::SAMPLE_RATE_HZ;
use crate::estimator::{Estimator, Finding, MIN_AMPLITUDE_LSB, Touch};
use crate::root::sqrt;
use crate::travel::Travel;
use crate::travel::{PLACES_PER_MM, PLACES_PER_UM};

use evidence::{LineEvidence, WaveEvidence, best_of};
use fit::{Fitted, LENGTH_COUNT, LENGTHS, Pass};
use jerk::Jerk;
use knots::Knots;
use periodogram::{
    CANDIDATES, PER_OCTAVE, Periodogram, Spectrum as Energies, highest_peak, is_peak, sharpness,
    vertex_mm,
};
use play::Play;
use trend::Trend;

pub mod evidence;
mod fit;
mod jerk;
mod knots;
mod periodogram;
mod play;
#[cfg(test)]
mod tests;
mod trend;

/// The shortest and the longest wavelength that are stood by, in mm.
pub const SHORTEST_MM: f32 = 0.6;
/// See [`SHORTEST_MM`].
pub const LONGEST_MM: f32 = 8.0;
/// The lowest and the highest frequency v/λ̂ that are stood by, in Hz, 2.5 and 150 with 4 % for what v and λ̂
/// may be off: below, drift is not told from texture; above, the sensor's resonance and the anti-aliasing
/// filter are.
pub const LOWEST_HZ: f32 = 2.4;
/// See [`LOWEST_HZ`].
pub const HIGHEST_HZ: f32 = 156.0;

/// Half the width, in µm, of the play that a movement must overcome to count as travel: two counts of
/// the encoder, so that one that dithers between counts is no travel. The force channel's noise, some
/// 5 µm, needs a little more.
const PLAY_UM: i32 = 10;
/// See [`PLAY_UM`].
const PLAY_WITH_FORCE_UM: i32 = 12;
/// What is kept of the highest speed from one estimate to the next, e^(−10 / 300): as long as the jerk is.
const SPEED_KEPT: f32 = 0.967;
/// Samples without travel after which nothing is stood by any more.
const REST_SAMPLES: u32 = SAMPLE_RATE_HZ / 2;
/// Share over two waves from which on a wave is strong: its fit needs no average to lean on.
const STRONG: f32 = 0.8;
/// Share over three waves from which on, if it is the usual one, a wave that goes is missed.
const KNOWN: f32 = 0.75;
/// What a strong wave explains over three waves, relative to what it usually does, from which on it is all
/// there, and up to which it is gone.
const STAYS: f32 = 0.8;
/// See [`STAYS`].
const GONE: f32 = 0.5;
/// What a strong wave's usual share loses in a wave that explains less.
const FORGOTTEN: f32 = 0.01;
/// A supposition that moves by more than this share is another one.
const SAME: f32 = 0.1;
/// A short fit this close to the trend, in ln λ, is about the line.
const ON_THE_TREND: f32 = 0.15;
/// The line's memory in wavelengths, as the periodogram's.
const MEMORY_WAVES: f32 = 8.0;
/// Probability of a wave from which on it is the surface, once it has been there for a wavelength.
const CONVINCING: f32 = 0.8;
/// Estimates for which a period that a fit has refused is not looked for again.
const REFUSED_ESTIMATES: u8 = 20;
/// What is left of a probability where the gauges hint at stick and slip, without a force channel: below the
/// default level. A fingertip that hops over ridges makes a clean wave of another λ.
const WHERE_JERKY: f32 = 0.55;
/// Millisecond of the ten before an estimate in which its work begins. In those after it the line is fitted,
/// then the wave of the moment.
const SURVEY_SLOT: u8 = 3;
/// What is done of that in a millisecond, as a pass counts it.
const WORK_OF_A_SLOT: usize = 34;
/// Lengths that each estimate fits the line over. The longer ones change slowly: one estimate of so many has
/// them, and those after it take them over.
const SHORTER_LENGTHS: usize = 3;
/// See [`SHORTER_LENGTHS`].
const LONGER_EVERY: u8 = 3;

/// The estimator.
#[derive(Clone, Debug)]
pub struct Spectrum {
    force_channel: bool,
    /// Lengths of [`LENGTHS`] that a fit may have.
    lengths: usize,
    level: f32,
    play: Play,
    knots: Knots,
    periodogram: Periodogram,
    jerk: Jerk,
    touch: Touch,
    rested: u32,
    /// Speed in mm/s, falling no faster than the jerk is forgotten.
    speed_mm_s: f32,
    /// Travel since the last survey, and since the start or the last change of surface, in mm.
    fresh_mm: f32,
    travelled_mm: f32,
    /// Milliseconds since the last estimate.
    slot: u8,
    survey: Survey,
    line: Line,
    wave: Wave,
    /// Estimates since the line was last fitted over the longer lengths, and what was found there.
    shorter_so_far: u8,
    longer_fits: [Option<Fitted>; LENGTH_COUNT - SHORTER_LENGTHS],
    /// Estimates for which no longer period is looked for.
    refused: u8,
    weighed: Weighed,
    /// The last estimate that was stood by, in mm, and the share over two waves since; 0 before.
    known_mm: f32,
    known_share: f32,
    /// How λ of the line changes along the way.
    trend: Trend,
}

/// The spectra's peaks, and what fits are under way.
#[derive(Clone, Debug, Default)]
struct Survey {
    /// Travel that it is about.
    fresh_mm: f32,
    energies: Energies,
    line_mm: Option<f32>,
    maturity: f32,
    presence: f32,
    sharpness: f32,
    /// The moment's highest peak is the line's.
    agree: bool,
    /// The line is twice or three times as long as the highest peak.
    longer: bool,
    line_pass: Option<Pass>,
    wave_pass: Option<Pass>,
}

/// The line, from one estimate to the next.
#[derive(Clone, Copy, Debug, Default)]
struct Line {
    mm: f32,
    held_waves: f32,
    /// The last fit, in mm, and its share over two waves; 0 without one.
    fitted_mm: f32,
    share: f32,
    /// Wavelengths to go until a line that took another's place stands by itself.
    young_waves: f32,
    /// Averages over the line's memory, and their weight.
    agreement: f32,
    squares: [f32; 2],
    shares: [f32; 2],
    /// The share over three waves that it has had lately, falling slowly.
    usual: f32,
    /// 1 as long as a strong line is still there, falling to 0 as it goes.
    there: f32,
    weight: f32,
    /// Mean of ln λ here and its variance about the trend, over twice that memory.
    mean: f32,
    variance: f32,
}

/// What an estimate adds to the line.
struct Seen {
    fresh_mm: f32,
    /// ln λ of the line here, and how much the trend has changed it on the way here.
    ln_here: f32,
    drift: f32,
    /// See [`Survey::agree`].
    agrees: bool,
    /// Of the fits over three and eight waves: how far from the line, and shares.
    wander: [f32; 2],
    shares: [f32; 2],
}

/// The wave of the moment, from one estimate to the next.
#[derive(Clone, Copy, Debug, Default)]
struct Wave {
    mm: f32,
    held_waves: f32,
}

/// The suppositions of an estimate: λ̂ in mm, and the evidence for it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Weighed {
    /// The line.
    pub line: Option<(f32, LineEvidence)>,
    /// The wave of the moment, where the line is another.
    pub wave: Option<(f32, WaveEvidence)>,
}

/// A supposition with what speaks for it.
#[derive(Clone, Copy, Debug)]
struct Supposition {
    wavelength_mm: f32,
    probability: f32,
    fitted: Option<Fitted>,
    /// What was felt before a change of surface is no sign of stick and slip after it.
    new: bool,
}

impl Spectrum {
    /// Before its first touch, as `configuration` wants it; that must have passed its check.
    pub fn new(configuration: &SensorConfiguration) -> Self {
        let play_um = if configuration.force_channel {
            PLAY_WITH_FORCE_UM
        } else {
            PLAY_UM
        };
        let waves = f32::from(configuration.waves);
        Self {
            force_channel: configuration.force_channel,
            lengths: LENGTHS.iter().filter(|&&length| length <= waves).count(),
            level: f32::from(configuration.valid_percent) / 100.0,
            play: Play::new(play_um * PLACES_PER_UM),
            knots: Knots::new(),
            periodogram: Periodogram::new(),
            jerk: Jerk::default(),
            touch: Touch::default(),
            rested: 0,
            speed_mm_s: 0.0,
            fresh_mm: 0.0,
            travelled_mm: 0.0,
            slot: 0,
            survey: Survey::default(),
            line: Line::default(),
            wave: Wave::default(),
            shorter_so_far: 0,
            longer_fits: [None; LENGTH_COUNT - SHORTER_LENGTHS],
            refused: 0,
            weighed: Weighed::default(),
            known_mm: 0.0,
            known_share: 0.0,
            trend: Trend::default(),
        }
    }

    /// What the last estimate was weighed by.
    pub fn weighed(&self) -> &Weighed {
        &self.weighed
    }

    /// Finds the peaks, and prepares the fits.
    fn survey(&mut self) {
        let usable = self.touch.usable;
        let fresh_mm = core::mem::take(&mut self.fresh_mm);
        let (short, energies) = self.periodogram.energies(usable);
        self.periodogram.average(&energies, fresh_mm);
        let averaged = self.periodogram.averaged();
        // In place: the passes are large.
        let survey = &mut self.survey;
        (survey.line_mm, survey.line_pass, survey.wave_pass) = (None, None, None);
        (survey.fresh_mm, survey.energies) = (fresh_mm, energies);
        let (Some(highest), Some(momentary)) = (highest_peak(&averaged), highest_peak(&energies))
        else {
            return;
        };
        // What is highest at an end lies beyond it: a peak is then a harmonic of a longer wave, or the image of a
        // shorter one in knots that are too long for it.
        if averaged[highest] < averaged[0].max(averaged[CANDIDATES - 1]) {
            return;
        }
        let kept = self.kept_peak(&averaged, highest);
        let (number, line_mm) = self
            .longer_period(&averaged, &energies, kept)
            .unwrap_or((kept, vertex_mm(&averaged, kept, true)));
        let momentary = fundamental_of(&energies, momentary, number, line_mm);
        let momentary_mm = vertex_mm(&energies, momentary, true);
        let survey = &mut self.survey;
        survey.line_mm = Some(line_mm);
        survey.longer = number != kept;
        survey.sharpness = sharpness(&averaged, number);
        survey.maturity = self.periodogram.maturity(number);
        let total: f32 = energies.iter().sum();
        survey.presence = energies[number] / (total * averaged[number]).max(f32::MIN_POSITIVE);
        let here_mm = self.trend.of_average(line_mm);
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
        self.shorter_so_far = (self.shorter_so_far + 1) % LONGER_EVERY;
        let lengths = if self.shorter_so_far == 0 {
            self.lengths
        } else {
            SHORTER_LENGTHS.min(self.lengths)
        };
        survey.line_pass = Some(Pass::new(start_mm, 1..lengths, usable, base));
        // The short kernel sees a new surface first.
        let newest = highest_peak(&short)
            .map(|number| vertex_mm(&short, number, false))
            .filter(|&mm| {
                let known = self.known_mm > 0.0 && off(mm, self.known_mm) > 0.25;
                off(mm, here_mm) > 0.12 && (known || off(mm, self.wave.mm) < SAME)
            });
        let wave_mm = newest.or((!survey.agree).then_some(momentary_mm));
        survey.wave_pass = wave_mm.map(|mm| {
            let start_mm = if off(self.wave.mm, mm) < 0.06 {
                self.wave.mm
            } else {
                mm
            };
            Pass::new(start_mm, 0..3.min(self.lengths), usable, base)
        });
    }

    /// The peak where the line was, as long as there is one that is not much lower than the highest.
    fn kept_peak(&self, averaged: &Energies, highest: usize) -> usize {
        let was_mm = self.line.mm;
        (1..CANDIDATES - 1)
            .filter(|&i| is_peak(averaged, i) && averaged[i] > 0.4 * averaged[highest])
            .find(|&i| {
                was_mm > 0.0
                    && self.line.held_waves > 3.0
                    && off(periodogram::wavelength_mm(i), was_mm) < 0.11
            })
            .unwrap_or(highest)
    }

    /// A period of which the peak is the second or third harmonic, and its candidate.
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
        for (ratio, up) in [(2.0, PER_OCTAVE), (3.0, 10)] {
            for i in [peak + up, peak + up - 1, peak + up + 1] {
                if i + 1 < CANDIDATES
                    && is_peak(averaged, i)
                    && averaged[i] > 0.4 * averaged[peak]
                    && energies[i] > 0.09 * energies[peak]
                    && off(vertex_mm(averaged, i, true), ratio * peak_mm) < 0.06
                {
                    return Some((i, ratio * peak_mm));
                }
            }
        }
        None
    }

    /// What is to be said of the line, where there is one.
    fn weigh_line(&mut self) -> Option<Supposition> {
        let line_mm = self.survey.line_mm?;
        let mut found = self.survey.line_pass.as_ref()?.found;
        let longer = &mut found[SHORTER_LENGTHS..];
        if self.shorter_so_far == 0 {
            self.longer_fits.copy_from_slice(longer);
        } else {
            longer.copy_from_slice(&self.longer_fits);
        }
        let (here_mm, drift) = self.follow_trend(&found, line_mm);
        // What they say of λ here.
        let middles = found.map(|fitted| fitted.map_or(0.0, |fitted| fitted.wavelength_mm));
        for fitted in found.iter_mut().flatten() {
            fitted.wavelength_mm = self.trend.of_fit(fitted.wavelength_mm, fitted.centre);
        }
        let near = |n: usize, share: f32| {
            found[n]
                .filter(|fitted| off(fitted.wavelength_mm, here_mm) < share)
                .map(|_| n)
        };
        if self.survey.longer && found[2].is_some() && near(2, 0.05).is_none() {
            self.refused = REFUSED_ESTIMATES;
        }
        let share_over = |n: usize| found[n].map_or(0.0, |fitted| fitted.share());
        let share = near(1, 0.2).map_or(0.0, share_over);
        let strong = (share > STRONG).then(|| longest_that_agrees(&found));
        let chosen = strong
            .flatten()
            .or_else(|| (1..LENGTH_COUNT).rev().find_map(|n| near(n, 0.06)));
        let fitted = chosen.and_then(|n| found[n]);
        // A weak line's fit wanders: the trend knows better.
        let wavelength_mm = match (fitted, self.trend.course()) {
            (Some(fitted), Some(course)) => {
                let trust = ((fitted.share() - 0.3) / 0.5).clamp(0.0, 1.0);
                let fit = libm::logf(fitted.wavelength_mm);
                libm::expf(course.here + trust * (fit - course.here))
            }
            (Some(fitted), None) => fitted.wavelength_mm,
            (None, Some(course)) => libm::expf(course.here),
            (None, None) => here_mm,
        };
        self.line.fitted_mm = chosen.map_or(0.0, |n| middles[n]);
        self.line.share = if fitted.is_some() { share } else { 0.0 };
        let wander =
            |n: usize| found[n].map_or(0.15, |fitted| off(fitted.wavelength_mm, here_mm).min(0.15));
        let seen = Seen {
            fresh_mm: self.survey.fresh_mm,
            ln_here: libm::logf(here_mm),
            drift,
            agrees: self.survey.agree,
            wander: [wander(2), wander(4)],
            shares: [share_over(2), share_over(4)],
        };
        self.line.follow(line_mm, &seen);
        // A strong wave that explains much less than it used to is going, whatever its past says.
        self.line.there = if self.line.usual > KNOWN {
            let share = share_over(2) / self.line.usual;
            ((share - GONE) / (STAYS - GONE)).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let evidence = LineEvidence {
            maturity: self.survey.maturity,
            travelled_waves: self.travelled_mm / line_mm,
            held_waves: self.line.held_waves,
            shares: [share_over(1), share_over(2), share_over(4)],
            wander: self.line.squares.map(sqrt),
            agreement: self.line.agreement,
            distance: off(wavelength_mm, here_mm),
            presence: self.survey.presence,
            sharpness: self.survey.sharpness,
            spread: sqrt(self.line.variance),
            kept_shares: self.line.shares,
        };
        self.weighed.line = Some((wavelength_mm, evidence));
        let inherited = if self.line.young_waves > 0.0 && share_over(1) > STRONG {
            share_over(1)
        } else {
            0.0
        };
        let common = found[2]
            .or(found[1])
            .is_none_or(|fitted| is_common(&fitted, self.touch.usable));
        let probability = if common {
            (self.line.there * self.line.there * evidence.probability()).max(inherited)
        } else {
            0.0
        };
        Some(Supposition {
            wavelength_mm,
            probability,
            fitted: found[2].or(found[1]).or(fitted),
            new: false,
        })
    }

    /// Goes on with the trend, and takes what a short fit says into it. λ of the line here, in mm, and how
    /// much ln λ has changed on the way here.
    fn follow_trend(&mut self, found: &[Option<Fitted>; LENGTH_COUNT], line_mm: f32) -> (f32, f32) {
        if off(line_mm, self.line.mm) >= SAME {
            self.trend = Trend::default();
        }
        let waves = self.survey.fresh_mm / line_mm;
        let moved_mm = self.trend.advance(self.touch.place, waves);
        let here_mm = self.trend.of_average(line_mm);
        let expected = self.trend.course();
        let plausible = |fitted: &Fitted| {
            let fit_mm = self.trend.of_fit(fitted.wavelength_mm, fitted.centre);
            off(fit_mm, here_mm) < 0.06
                || expected
                    .is_some_and(|course| (libm::logf(fit_mm) - course.here).abs() < ON_THE_TREND)
        };
        let of_three = found[2].filter(plausible);
        if let Some(short) = of_three.or(found[1].filter(plausible)) {
            // A fit's variance goes with the third power of its length.
            let weight = if of_three.is_some() { 1.0 } else { 0.3 };
            self.trend
                .take(short.centre, short.wavelength_mm, weight * waves);
        }
        let slope = self.trend.course().map_or(0.0, |course| course.slope);
        (self.trend.of_average(line_mm), slope * moved_mm)
    }

    /// Whether most gauges feel a strong line as they did: what else there is has befallen the others.
    fn line_goes_on(&self) -> bool {
        let pass = self.survey.line_pass.as_ref();
        let Some(fitted) = pass.and_then(|pass| pass.found[2]) else {
            return false;
        };
        let usable = self.touch.usable;
        let as_before = (0..GAUGES)
            .filter(|&gauge| usable >> gauge & 1 == 1)
            .filter(|&gauge| {
                fitted.explaineds[gauge] > STRONG * self.line.usual * fitted.totals[gauge]
            })
            .count();
        self.line.usual > STRONG && 2 * as_before > usable.count_ones() as usize
    }

    /// What is to be said of a wave that the line is not.
    fn weigh_wave(&mut self) -> Option<Supposition> {
        let found = self.survey.wave_pass.as_ref().map(|pass| pass.found);
        let best = found.as_ref().and_then(|found| best_of(&found[..3]));
        let (Some(found), Some((best, _))) = (found, best) else {
            self.wave = Wave::default();
            return None;
        };
        if off(best.wavelength_mm, self.wave.mm) < SAME {
            self.wave.held_waves += self.survey.fresh_mm / best.wavelength_mm;
        } else {
            self.wave.held_waves = 0.0;
        }
        self.wave.mm = best.wavelength_mm;
        let evidence = WaveEvidence::of(&found, self.wave.held_waves, self.known_share)?;
        self.weighed.wave = Some((best.wavelength_mm, evidence));
        if !is_common(&best, self.touch.usable) {
            return None;
        }
        // Where a strong line has gone, something has taken its place.
        let follows = self.line.there < 0.5 && self.wave.held_waves > 0.0;
        let least = if follows { best.share() } else { 0.0 };
        Some(Supposition {
            wavelength_mm: best.wavelength_mm,
            probability: evidence.probability().max(least),
            fitted: Some(best),
            new: follows,
        })
    }
}

impl Spectrum {
    /// The wave of the moment is the surface from now on.
    fn begin_anew(&mut self) {
        self.periodogram.restart(&self.survey.energies, 0.3);
        self.travelled_mm = self.wave.held_waves * self.wave.mm;
        self.line = Line {
            mm: self.wave.mm,
            held_waves: self.wave.held_waves,
            fitted_mm: self.wave.mm,
            young_waves: MEMORY_WAVES,
            ..Line::default()
        };
        self.refused = 0;
        self.longer_fits = Default::default();
        self.trend = Trend::default();
        self.jerk.restart();
    }

    /// What is said of the likelier supposition.
    fn say(&mut self, said: &Supposition) -> Finding {
        let usable = self.touch.usable;
        let count = usable.count_ones().max(1) as f32;
        let fitted = said.fitted.unwrap_or_default();
        let amplitude_lsb = sqrt(2.0 * fitted.explained / count);
        let hz = self.speed_mm_s / said.wavelength_mm;
        let noise: f32 = (0..GAUGES)
            .filter(|gauge| usable >> gauge & 1 == 1)
            .map(|gauge| self.touch.noise[gauge])
            .sum();
        let jerky = !self.force_channel
            && !said.new
            && self.jerk.is_slip(
                said.wavelength_mm,
                hz,
                fitted.explained,
                noise,
                usable.count_ones(),
            );
        let in_range = (SHORTEST_MM..=LONGEST_MM).contains(&said.wavelength_mm)
            && (LOWEST_HZ..=HIGHEST_HZ).contains(&hz)
            && amplitude_lsb >= MIN_AMPLITUDE_LSB
            && self.rested < REST_SAMPLES;
        let stands = in_range && usable != 0 && !self.touch.pickup.hides(amplitude_lsb, hz);
        let confidence = match (stands, jerky) {
            (true, false) => said.probability,
            (true, true) => WHERE_JERKY * said.probability,
            (false, _) => 0.0,
        };
        let valid = confidence >= self.level;
        if valid {
            self.known_mm = said.wavelength_mm;
            self.known_share += 0.1 * (fitted.share() - self.known_share);
        }
        Finding {
            wavelength_mm: Some(said.wavelength_mm).filter(|mm| mm.is_finite() && *mm > 0.0),
            valid,
            confidence,
            amplitude_lsb,
            gauges_used: usable,
            misfits: misfits(&fitted, usable, valid),
            jerky,
        }
    }
}

/// Whether at least two gauges have the wave, if there are two: a ridge passes under all of them, what hums or drifts
/// in one is no surface.
fn is_common(fitted: &Fitted, usable: u8) -> bool {
    let least = 0.5 * fitted.share();
    let taking_part = (0..GAUGES)
        .filter(|&gauge| usable >> gauge & 1 == 1)
        .filter(|&gauge| fitted.explaineds[gauge] >= least * fitted.totals[gauge])
        .count();
    taking_part >= 2.min(usable.count_ones() as usize)
}

/// Gauges that the wave explains less than half of, though it explains the others: all of them where λ̂ is
/// stood by, else one alone, and only if the others agree well.
fn misfits(fitted: &Fitted, usable: u8, valid: bool) -> u8 {
    let mut misfits = 0;
    for gauge in 0..GAUGES {
        let (mut total, mut explained) = (fitted.total, fitted.explained);
        if usable >> gauge & 1 == 1 {
            total -= fitted.totals[gauge];
            explained -= fitted.explaineds[gauge];
        }
        let others_agree = explained > STRONG * total && total > 0.0;
        if others_agree && fitted.explaineds[gauge] < 0.5 * fitted.totals[gauge] {
            misfits |= 1 << gauge;
        }
    }
    if valid || (misfits & usable).is_power_of_two() {
        misfits
    } else {
        0
    }
}

impl Line {
    /// Goes on at `mm`.
    fn follow(&mut self, mm: f32, seen: &Seen) {
        let waves = seen.fresh_mm / mm;
        self.young_waves -= waves;
        if off(mm, self.mm) < SAME {
            self.held_waves += waves;
        } else {
            self.held_waves = 0.0;
            self.weight = 0.0;
            self.mean = seen.ln_here;
            self.variance = 0.0;
            self.usual = 0.0;
            self.young_waves = 0.0;
        }
        self.mm = mm;
        let slow = waves / (2.0 * MEMORY_WAVES + waves);
        self.mean += seen.drift;
        let away = seen.ln_here - self.mean;
        self.mean += slow * away;
        self.variance += slow * (away * away - self.variance);
        let follow = waves / (MEMORY_WAVES + waves);
        self.weight += follow * (1.0 - self.weight);
        let share = if self.weight > follow {
            follow / self.weight
        } else {
            1.0
        };
        self.agreement += share * (f32::from(u8::from(seen.agrees)) - self.agreement);
        for (square, wander) in self.squares.iter_mut().zip(seen.wander) {
            *square += share * (wander * wander - *square);
        }
        for (kept, now) in self.shares.iter_mut().zip(seen.shares) {
            *kept += share * (now - *kept);
        }
        self.usual = self.shares[0].max(self.usual - FORGOTTEN * waves);
    }
}

/// Which is the longest fit whose λ̂ all shorter ones contain in their intervals, from two waves on; none if the one over
/// three waves contradicts that over two, as where the arm turns.
fn longest_that_agrees(found: &[Option<Fitted>; LENGTH_COUNT]) -> Option<usize> {
    let shortest = found[1]?;
    let (mut low, mut high) = (0.0_f32, f32::MAX);
    let mut longest = None;
    let all = found.iter().enumerate().skip(1);
    for (n, fitted) in all.map_while(|(n, fitted)| Some((n, (*fitted)?))) {
        let interval = (4.0 * fitted.sigma).max(0.003);
        low = low.max(fitted.wavelength_mm * (1.0 - interval));
        high = high.min(fitted.wavelength_mm * (1.0 + interval));
        if low > high || fitted.share() < STRONG * shortest.share() {
            break;
        }
        longest = Some(n);
    }
    longest.filter(|&n| n > 1 || found[2].is_none())
}

/// The moment's highest peak, or the line's where that peak is its second or third harmonic.
fn fundamental_of(energies: &Energies, peak: usize, line: usize, line_mm: f32) -> usize {
    let ratio = line_mm / periodogram::wavelength_mm(peak);
    if (ratio - 2.0).abs() < 0.2 || (ratio - 3.0).abs() < 0.3 {
        for i in [line, line - 1, line + 1] {
            if is_peak(energies, i) && energies[i] > 0.09 * energies[peak] {
                return i;
            }
        }
    }
    peak
}

/// Relative distance.
fn off(one: f32, other: f32) -> f32 {
    (one / other - 1.0).abs()
}

impl Estimator for Spectrum {
    /// Gathers knots, and works on the next estimate: the peaks five milliseconds before it, then the fits.
    fn push(&mut self, touch: &Touch) {
        self.touch = *touch;
        let travel = self.play.follow(touch.place);
        self.jerk.push(touch, travel);
        if travel == 0 {
            self.rested = self.rested.saturating_add(1);
        } else {
            self.rested = 0;
            let completed = self.knots.push(touch.place, travel.abs(), &touch.gauges);
            self.periodogram.push(&completed);
            let mm = travel.abs() as f32 * (1.0 / PLACES_PER_MM as f32);
            self.fresh_mm += mm;
            self.travelled_mm += mm;
        }
        match self.slot {
            SURVEY_SLOT => self.survey(),
            slot if slot > SURVEY_SLOT => {
                let survey = &mut self.survey;
                let passes = [&mut survey.line_pass, &mut survey.wave_pass];
                passes
                    .into_iter()
                    .flatten()
                    .fold(WORK_OF_A_SLOT, |left, pass| pass.run(&self.knots, left));
            }
            _ => {}
        }
        self.slot = (self.slot + 1).min(9);
    }

    fn find(&mut self, travel: &Travel) -> Finding {
        self.slot = 0;
        let speed_mm_s = travel.velocity_mm_s(0).abs();
        self.speed_mm_s = speed_mm_s.max(self.speed_mm_s * SPEED_KEPT);
        self.weighed = Weighed::default();
        let line = self.weigh_line();
        let wave = self.weigh_wave().filter(|_| !self.line_goes_on());
        if let Some(wave) = &wave
            && wave.probability > CONVINCING
            && self.wave.held_waves > 1.0
        {
            self.begin_anew();
        }
        let likelier = |one: Supposition, other: Supposition| {
            if other.probability > one.probability {
                other
            } else {
                one
            }
        };
        let said = match (line, wave) {
            (Some(line), Some(wave)) => likelier(line, wave),
            (line, wave) => match line.or(wave) {
                Some(said) => said,
                None => return Finding::default(),
            },
        };
        self.say(&said)
    }
}
