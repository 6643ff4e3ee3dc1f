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
//! suppositions. The *line* is the clearest peak of the averaged spectrum, the one that stands highest above
//! its flanks; the *wave* is a peak of the moment, where that is elsewhere: a new surface. Either is
//! refined by least squares over the last waves of the path, and weighed by [`evidence`]; the more probable one is λ̂.
//!
//! λ̂ is the period: that of the clearest peak is taken for its half or third, if lines stand there that the peak's
//! wavelength does not explain and that period does, its own among them, and a fit finds it there. Of waves that have no
//! common period the clearest is λ̂.
//!
//! The work of an estimate is spread over the ten milliseconds before it: see [`Spectrum::push`].

use protocol::{GAUGES, SensorConfiguration};

use crate::SAMPLE_RATE_HZ;
use crate::estimator::{Estimator, Finding, MIN_AMPLITUDE_LSB, Touch};
use crate::float::{larger, sqrt};
use crate::travel::{PLACES_PER_MM, PLACES_PER_UM, Travel};
use crate::vibration::{self, Vibration};

use evidence::{LineEvidence, WaveEvidence};
use fit::{Fitted, LENGTH_COUNT, LENGTHS};
use jerk::Jerk;
use knots::{Knot, Knots};
use line::Line;
use periodogram::Periodogram;
use play::Play;
use survey::Survey;
use trend::Trend;
use wave::Wave;

pub mod evidence;
mod fit;
mod jerk;
mod knots;
mod line;
mod periodogram;
mod play;
mod sidebands;
mod survey;
#[cfg(test)]
mod tests;
mod trend;
mod wave;

/// The shortest and the longest wavelength that are stood by, in mm, to within 1 % ([`MARGIN`]): an estimate of one of
/// them scatters to both sides of it.
pub const SHORTEST_MM: f32 = 0.6;
/// See [`SHORTEST_MM`].
pub const LONGEST_MM: f32 = 8.0;
/// The lowest and the highest frequency v/λ̂ that are stood by, in Hz: below, drift is not told from texture; above, the
/// sensor's resonance and the anti-aliasing filter are. 2.5 and 150 Hz are promised; v and λ̂ may be 4 % off.
pub const LOWEST_HZ: f32 = 2.4;
/// See [`LOWEST_HZ`].
pub const HIGHEST_HZ: f32 = 156.0;
/// See [`SHORTEST_MM`].
pub const MARGIN: f32 = 1.01;

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
/// Of its last third of a wave a wave that goes on has more than this share of its power: a gauge that has just met a crest has
/// 0.045, the others have more.
const LATEST_WAVES: f32 = 1.0 / 3.0;
/// See [`LATEST_WAVES`].
const LATEST_POWER: f32 = 0.05;
/// Share over two waves from which on a wave is strong: its fit needs no average to lean on.
const STRONG: f32 = 0.8;
/// Estimates in a row that must find a weak wave that is not known yet before it is stood by: chance makes such a wave, and
/// seldom twice the same.
const TIMES: u8 = 5;
/// Share of a gauge's energy from which on a wave fills it: there is hardly anything else.
const FILLS: f32 = 0.9;
/// A supposition that moves by more than this share is another one.
const SAME: f32 = 0.1;
/// The line's memory in wavelengths.
const MEMORY_WAVES: f32 = 8.0;
/// Probability of a wave from which on it is the surface, once it has been there for a wavelength.
const CONVINCING: f32 = 0.8;
/// What is left of a probability where the gauges hint at stick and slip that no force channel tells: below the
/// default level. A fingertip that hops over ridges makes a clean wave of another λ.
const WHERE_JERKY: f32 = 0.55;
/// Millisecond of the ten before an estimate in which its work begins. In those after it the line is fitted,
/// then the wave of the moment.
const SURVEY_SLOT: u8 = 3;
/// The millisecond of the estimate.
const LAST_SLOT: u8 = SURVEY_SLOT + WORK.len() as u8;
/// What is done of that in each of them, as a pass counts it: most where no length ends, and little in the last one,
/// which has the estimate to find.
const WORK: [usize; 6] = [34, 34, 34, 44, 44, 20];
/// Lengths that each estimate fits the line over. The longer ones change slowly: see [`survey::LONGER_EVERY`].
const SHORTER_LENGTHS: usize = 3;

/// The estimator.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// Lengths of [`LENGTHS`] that a fit may have.
    lengths: usize,
    level: f32,
    play: Play,
    knots: Knots,
    periodogram: Periodogram,
    jerk: Jerk,
    vibration: Vibration,
    touch: Touch,
    rested: u32,
    /// See [`Finding::landed`].
    landed: bool,
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
    /// Travel for which an established line has been missing, in hundredths of its wavelength
    /// ([`survey::STEPS_A_WAVE`]): as a byte it moves no other field, which would cost 30 instructions a millisecond.
    missing_steps: u8,
    weighed: Weighed,
    /// The last estimate that was stood by, in mm, and the share over two waves since; 0 before. The share is forgotten where the
    /// line goes: a surface that was clear says nothing of the next one.
    known_mm: f32,
    known_share: f32,
    /// The last λ̂ in mm, and how many times in a row it was probable enough: up to [`TIMES`].
    sure_mm: f32,
    sure_times: u8,
    /// How λ of the line changes along the way.
    trend: Trend,
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
            lengths: LENGTHS.iter().filter(|&&length| length <= waves).count(),
            level: f32::from(configuration.valid_percent) / 100.0,
            play: Play::new(play_um * PLACES_PER_UM),
            knots: Knots::new(),
            periodogram: Periodogram::new(),
            jerk: Jerk::default(),
            vibration: Vibration::default(),
            touch: Touch::default(),
            rested: 0,
            landed: false,
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
            missing_steps: 0,
            weighed: Weighed::default(),
            known_mm: 0.0,
            known_share: 0.0,
            sure_mm: 0.0,
            sure_times: 0,
            trend: Trend::default(),
        }
    }

    /// What the last estimate was weighed by.
    pub fn weighed(&self) -> &Weighed {
        &self.weighed
    }

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
        self.forget_fits();
        self.jerk.restart();
    }

    /// The surface begins here. What was felt before was none; the step of a landing would go on in all long waves.
    fn land(&mut self) {
        self.landed = true;
        self.periodogram = Periodogram::new();
        self.knots.restart();
        self.travelled_mm = 0.0;
        self.line = Line::default();
        self.wave = Wave::default();
        self.forget_fits();
        self.jerk = Jerk::default();
    }

    /// What was found on another surface says nothing of this one.
    fn forget_fits(&mut self) {
        self.refused = 0;
        self.survey.sideband = (0, 0);
        self.longer_fits = Default::default();
        self.trend = Trend::default();
    }

    /// Whether a wave that explains so much `power` is felt still. A step, such as a fingertip's that is lifted and springs
    /// back, looks like a wave, and leaves nothing behind.
    fn goes_on(&self, wavelength_mm: f32, power: f32) -> bool {
        let spacing = knots::spacing_for(wavelength_mm);
        let latest_mm = LATEST_WAVES * wavelength_mm;
        let latest = self
            .knots
            .latest_power(spacing, latest_mm, self.touch.usable);
        latest > LATEST_POWER * power
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
        let jerky = !self.touch.deflection_known
            && !said.new
            && self.jerk.is_slip(
                said.wavelength_mm,
                hz,
                fitted.explained,
                noise,
                usable.count_ones(),
            );
        let in_range = (SHORTEST_MM / MARGIN..=LONGEST_MM * MARGIN).contains(&said.wavelength_mm)
            && (LOWEST_HZ..=HIGHEST_HZ).contains(&hz)
            && amplitude_lsb >= MIN_AMPLITUDE_LSB
            && self.rested < REST_SAMPLES;
        let stands = in_range && usable != 0 && !self.touch.pickup.hides(amplitude_lsb, hz);
        let is_new = off(said.wavelength_mm, self.known_mm) >= SAME;
        let fades = stands
            && is_new
            && said.probability >= self.level
            && !self.goes_on(said.wavelength_mm, fitted.explained);
        let confidence = match (stands && !fades, jerky) {
            (true, false) => said.probability,
            (true, true) => WHERE_JERKY * said.probability,
            (false, _) => 0.0,
        };
        let is_sure = confidence >= self.level;
        // Under a crest nothing is told of it, for or against.
        if !is_sure && !fades || off(said.wavelength_mm, self.sure_mm) >= SAME {
            self.sure_times = 0;
        }
        self.sure_times = (self.sure_times + u8::from(is_sure)).min(TIMES);
        self.sure_mm = said.wavelength_mm;
        let at_once = said.new || fitted.share() > STRONG || !is_new;
        let valid = is_sure && (at_once || self.sure_times == TIMES);
        Finding {
            wavelength_mm: Some(said.wavelength_mm).filter(|mm| mm.is_finite() && *mm > 0.0),
            valid,
            confidence,
            amplitude_lsb,
            gauges_used: usable,
            misfits: misfits(&fitted, usable, valid),
            jerky,
            ..Finding::default()
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

/// Whether the wave fills two `usable` gauges at least. A boundary passes them one after another, and those that it has not passed
/// yet say nothing for or against.
fn fills_some(fitted: &Fitted, usable: u8) -> bool {
    let filled = (0..GAUGES)
        .filter(|&gauge| usable >> gauge & 1 == 1)
        .filter(|&gauge| fitted.explaineds[gauge] > FILLS * fitted.totals[gauge])
        .count();
    filled >= 2.min(usable.count_ones() as usize)
}

/// Relative distance.
fn off(one: f32, other: f32) -> f32 {
    (one / other - 1.0).abs()
}

impl Estimator for Spectrum {
    /// Gathers knots, and works on the next estimate: the peaks six milliseconds before it, then the fits.
    fn push(&mut self, touch: &Touch) {
        // A gauge that fails jumps, which is no sign of stick and slip.
        if touch.usable != self.touch.usable {
            self.jerk.restart();
        }
        if matches!(self.slot, SURVEY_SLOT | LAST_SLOT) {
            // What is worked out in these is about it.
            self.touch = *touch;
        } else {
            self.touch.usable = touch.usable;
        }
        let travel = self.play.follow(touch.place);
        self.jerk.push(touch, travel);
        if u32::from(self.slot) % vibration::PERIOD_MS == 0 {
            self.vibration.push(touch);
        }
        if travel == 0 {
            self.rested = self.rested.saturating_add(1);
        } else {
            self.rested = 0;
            let periodogram = &mut self.periodogram;
            let tell = |spacing, knot: &Knot| periodogram.push(spacing, knot);
            self.knots
                .push(touch.place, travel.abs(), &touch.gauges, tell);
            let mm = travel.abs() as f32 * (1.0 / PLACES_PER_MM as f32);
            self.fresh_mm += mm;
            self.travelled_mm += mm;
        }
        match self.slot {
            SURVEY_SLOT => self.survey(),
            slot if slot > SURVEY_SLOT => {
                let work = WORK[usize::from(slot - SURVEY_SLOT - 1)];
                let survey = &mut self.survey;
                let left = survey.line_pass.run(&self.knots, work);
                survey.wave_pass.run(&self.knots, left);
            }
            _ => {}
        }
        self.slot = (self.slot + 1).min(LAST_SLOT);
    }

    fn find(&mut self, travel: &Travel) -> Finding {
        self.slot = 0;
        let landed = core::mem::take(&mut self.landed);
        let speed_mm_s = travel.velocity_mm_s(0).abs();
        self.speed_mm_s = larger(speed_mm_s, self.speed_mm_s * SPEED_KEPT);
        self.weighed = Weighed::default();
        let was_gone = self.line.is_gone();
        let line = self.weigh_line();
        if line.is_none() || self.line.is_gone() && !was_gone {
            self.known_share = 0.0;
        }
        let wave = self.weigh_wave().filter(|_| !self.line_goes_on());
        if wave.is_some() && self.wave.is_surface {
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
            (Some(line), Some(wave)) => Some(likelier(line, wave)),
            (line, wave) => line.or(wave),
        };
        let finding = if let Some(said) = said {
            self.say(&said)
        } else {
            self.sure_times = 0;
            Finding::default()
        };
        let mut finding = Finding { landed, ..finding };
        self.vibration.withhold(&mut finding, speed_mm_s);
        if let Some(said) = said.filter(|_| finding.valid) {
            let share = said.fitted.unwrap_or_default().share();
            self.known_mm = said.wavelength_mm;
            self.known_share += 0.1 * (share - self.known_share);
        }
        finding
    }
}
