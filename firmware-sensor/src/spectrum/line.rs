//! The line: what has stayed put over fresh ground, and how long it has.

use protocol::GAUGES;

use crate::float::{larger, smaller, sqrt};

use super::evidence::LineEvidence;
use super::fit::{Fitted, LENGTH_COUNT};
use super::survey::MATURE;
use super::trend::Trend;
use super::{MEMORY_WAVES, SAME, SHORTER_LENGTHS, STRONG, Spectrum, Supposition, is_common, off};

/// Share over three waves from which on, if it is the usual one, a wave that goes is missed.
const KNOWN: f32 = 0.75;
/// What a strong wave explains over three waves, relative to what it usually does, from which on it is all
/// there, and up to which it is gone.
const STAYS: f32 = 0.8;
/// See [`STAYS`].
const GONE: f32 = 0.5;
/// What a strong wave's usual share loses in a wave that explains less.
const FORGOTTEN: f32 = 0.01;
/// A short fit this close to the trend, in ln λ, is about the line.
const ON_THE_TREND: f32 = 0.15;
/// A fit this close to the line, relative to it, is about it; and one this close to the mean of what there is, is finer.
const NEAR: f32 = 0.06;
/// See [`NEAR`].
const CLOSE: f32 = 0.007;
/// Estimates for which a period that a fit has refused is not looked for again.
const REFUSED_ESTIMATES: u8 = 20;

/// The line, from one estimate to the next.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Line {
    pub(super) mm: f32,
    pub(super) held_waves: f32,
    /// The last fit, in mm, and its share over two waves; 0 without one.
    pub(super) fitted_mm: f32,
    pub(super) share: f32,
    /// Wavelengths to go until a line that took another's place stands by itself.
    pub(super) young_waves: f32,
    /// Averages over the line's memory, and their weight.
    pub(super) agreement: f32,
    pub(super) squares: [f32; 2],
    pub(super) shares: [f32; 2],
    /// Average over that memory of [`Fitted::gauges_share`] over three waves.
    pub(super) gauges_share: f32,
    /// What that has been lately, falling slowly.
    pub(super) usual: f32,
    /// 1 as long as a strong line is still there, falling to 0 as it goes.
    pub(super) there: f32,
    pub(super) weight: f32,
    /// Mean of ln λ here and its variance about the trend, over twice that memory.
    pub(super) mean: f32,
    pub(super) variance: f32,
}

/// What an estimate adds to the line.
struct Seen {
    fresh_mm: f32,
    /// ln λ of the line here, and how much the trend has changed it on the way here.
    ln_here: f32,
    drift: f32,
    /// See [`Survey::agree`].
    agrees: bool,
    /// Of the fits over three waves and over the longest length: how far from the line, and shares.
    wander: [f32; 2],
    shares: [f32; 2],
    /// See [`Fitted::gauges_share`].
    gauges_share: f32,
}

impl Spectrum {
    /// What is to be said of the line, where there is one.
    pub(super) fn weigh_line(&mut self) -> Option<Supposition> {
        let line_mm = self.survey.line_mm?;
        let mut found = self.survey.line_pass.found;
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
        if self.survey.longer && self.is_refused(&found, here_mm) {
            self.refused = REFUSED_ESTIMATES;
        }
        let share_over = |n: usize| found[n].map_or(0.0, |fitted| fitted.share());
        // What a fit explains speaks for the wave that it found, which on a short path may be another.
        let share = near(1, 0.2).map_or(0.0, share_over);
        let of_strong = (share > STRONG)
            .then(|| longest_that_agrees(&found))
            .flatten();
        let chosen = of_strong.or_else(|| (1..LENGTH_COUNT).rev().find_map(|n| near(n, NEAR)));
        let fitted = chosen.and_then(|n| found[n]);
        let ln_here = libm::logf(here_mm);
        let wavelength_mm = self.weighed_mm(&found, ln_here, of_strong);
        self.line.fitted_mm = chosen.map_or(0.0, |n| middles[n]);
        self.line.share = if fitted.is_some() { share } else { 0.0 };
        let wander = |n: usize| {
            found[n].map_or(0.15, |fitted| {
                smaller(off(fitted.wavelength_mm, here_mm), 0.15)
            })
        };
        // The longest that is configured says what the longest of all would.
        let longest = self.lengths.saturating_sub(1);
        let three = longest.min(2);
        let seen = Seen {
            fresh_mm: self.survey.fresh_mm,
            ln_here,
            drift,
            agrees: self.survey.agree,
            wander: [wander(three), wander(longest)],
            shares: [share_over(three), share_over(longest)],
            gauges_share: found[three].map_or(0.0, |fitted| fitted.gauges_share(self.touch.usable)),
        };
        self.line.follow(line_mm, &seen);
        // A strong wave that explains much less than it used to is going, whatever its past says.
        self.line.there = if self.line.usual > KNOWN {
            let share = seen.gauges_share / self.line.usual;
            ((share - GONE) / (STAYS - GONE)).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let evidence = LineEvidence {
            maturity: self.survey.maturity,
            travelled_waves: self.travelled_mm / line_mm,
            held_waves: self.line.held_waves,
            shares: [share, share_over(three), share_over(longest)],
            wander: self.line.squares.map(sqrt),
            agreement: self.line.agreement,
            distance: off(wavelength_mm, here_mm),
            presence: self.survey.presence,
            sharpness: self.survey.sharpness,
            spread: sqrt(self.line.variance),
            kept_shares: self.line.shares,
        };
        self.weighed.line = Some((wavelength_mm, evidence));
        let inherited = if self.line.young_waves > 0.0 && share > STRONG {
            share
        } else {
            0.0
        };
        let common = found[2]
            .or(found[1])
            .is_none_or(|fitted| is_common(&fitted, self.touch.usable));
        let probability = if common {
            let there = self.line.there;
            larger(there * there * evidence.probability(), inherited)
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

    /// Whether a fit is somewhere else than a period that the peaks tell. Beside its harmonics a weak period is off over
    /// three waves more often than over five. But five are not fitted at each estimate, and on a new surface they reach
    /// back over its border.
    fn is_refused(&self, found: &[Option<Fitted>; LENGTH_COUNT], here_mm: f32) -> bool {
        let is_young = self.survey.maturity < MATURE
            || self.line.young_waves > 0.0
            || self.lengths < LENGTH_COUNT - 1;
        let told = if is_young { 2 } else { 3 };
        let is_new = is_young || self.shorter_so_far == 0;
        is_new && found[told].is_some_and(|fitted| off(fitted.wavelength_mm, here_mm) >= 0.05)
    }

    /// λ here, of the average's peak there and of fits carried to here. Each may be off: a peak where two lines meet, a
    /// fit where little is explained, the trend where the surface changes. So the mean of those that agree first; then, of
    /// what is finest, all that is close to it.
    fn weighed_mm(
        &self,
        found: &[Option<Fitted>; LENGTH_COUNT],
        ln_here: f32,
        of_strong: Option<usize>,
    ) -> f32 {
        let strong_mm = of_strong
            .and_then(|n| found[n])
            .map(|fitted| fitted.wavelength_mm);
        if let Some(fit_mm) = strong_mm.filter(|_| self.line.held_waves <= MEMORY_WAVES) {
            return fit_mm;
        }
        let ln = |n: usize| found[n].map(|fitted| libm::logf(fitted.wavelength_mm));
        let (three, five) = (ln(2), ln(3));
        let course = self.trend.course().map(|course| course.here);
        // The peak of an average that is not full yet is still what it was begun with.
        let agreed = agreed(&[
            (Some(ln_here), self.survey.maturity),
            (course, 1.0),
            (three, 1.0),
            (five, 1.0),
        ]);
        let agreed_mm = libm::expf(agreed);
        if let Some(fit_mm) = strong_mm.filter(|&mm| off(mm, agreed_mm) < 0.05) {
            return fit_mm;
        }
        let longest = ln(4).or(five).or(three).or_else(|| ln(1));
        let (mut sum, mut count) = (0.0, 0_u8);
        for close in [longest, course]
            .into_iter()
            .flatten()
            .map(|ln| ln - agreed)
        {
            if close.abs() < CLOSE {
                sum += close;
                count += 1;
            }
        }
        agreed_mm * libm::expf(sum / f32::from(count.max(1)))
    }

    /// Goes on with the trend, and takes what a short fit says into it. λ of the line here, in mm, and how
    /// much ln λ has changed on the way here.
    fn follow_trend(&mut self, found: &[Option<Fitted>; LENGTH_COUNT], line_mm: f32) -> (f32, f32) {
        if off(line_mm, self.line.mm) >= SAME {
            self.trend = Trend::default();
        }
        let waves = self.survey.fresh_mm / line_mm;
        let moved_mm = self.trend.advance(self.touch.place, waves, line_mm);
        let here_mm = self.trend.of_average(line_mm);
        let expected = self.trend.course();
        let plausible = |fitted: &Fitted| {
            let fit_mm = self.trend.of_fit(fitted.wavelength_mm, fitted.centre);
            off(fit_mm, here_mm) < NEAR
                || expected
                    .is_some_and(|course| (libm::logf(fit_mm) - course.here).abs() < ON_THE_TREND)
        };
        let of_three = found[2].filter(plausible);
        if let Some(short) = of_three.or_else(|| found[1].filter(plausible)) {
            // A fit's variance goes with the third power of its length.
            let weight = if of_three.is_some() { 1.0 } else { 0.3 };
            self.trend
                .take(short.centre, short.wavelength_mm, weight * waves);
        }
        let slope = self.trend.course().map_or(0.0, |course| course.slope);
        (self.trend.of_average(line_mm), slope * moved_mm)
    }

    /// Whether most gauges feel a strong line as they did: what else there is has befallen the others.
    pub(super) fn line_goes_on(&self) -> bool {
        let Some(fitted) = self.survey.line_pass.found[2] else {
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
}

impl Line {
    /// There is no line, or a strong one is not there any more.
    pub(super) fn is_gone(&self) -> bool {
        self.there < 0.5
    }

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
        self.gauges_share += share * (seen.gauges_share - self.gauges_share);
        self.usual = larger(self.gauges_share, self.usual - FORGOTTEN * waves);
    }
}

/// The mean of what is near the median: each an ln λ, and what it counts for. The first must be there.
fn agreed(said: &[(Option<f32>, f32); 4]) -> f32 {
    let mut sorted = said.map(|(ln, _)| ln.unwrap_or(f32::INFINITY));
    sorted.sort_unstable_by(f32::total_cmp);
    let known = sorted.iter().filter(|ln| ln.is_finite()).count().max(1);
    let median = 0.5 * (sorted[(known - 1) / 2] + sorted[known / 2]);
    let (mut sum, mut total) = (0.0, f32::MIN_POSITIVE);
    for &(ln, weight) in said {
        let away = ln.unwrap_or(f32::INFINITY) - median;
        if away.abs() < NEAR {
            sum += weight * away;
            total += weight;
        }
    }
    median + sum / total
}

/// Which is the longest fit whose λ̂ all shorter ones contain in their intervals, from two waves on; none if the one over
/// three waves contradicts that over two, as where the arm turns.
fn longest_that_agrees(found: &[Option<Fitted>; LENGTH_COUNT]) -> Option<usize> {
    let shortest = found[1]?;
    let (mut low, mut high) = (0.0_f32, f32::MAX);
    let mut longest = None;
    let all = found.iter().enumerate().skip(1);
    for (n, fitted) in all.map_while(|(n, fitted)| Some((n, (*fitted)?))) {
        let interval = larger(4.0 * fitted.sigma, 0.003);
        low = larger(low, fitted.wavelength_mm * (1.0 - interval));
        high = smaller(high, fitted.wavelength_mm * (1.0 + interval));
        if low > high || fitted.share() < STRONG * shortest.share() {
            break;
        }
        longest = Some(n);
    }
    longest.filter(|&n| n > 1 || found[2].is_none())
}
