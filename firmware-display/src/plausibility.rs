//! Which estimates are to be trusted.
//!
//! | an estimate is | if | then |
//! | --- | --- | --- |
//! | flooding | more come than a sensor sends, see [`crate::flood`] | not used, and a hold until the flood is over |
//! | late | its sequence is not after the last one's, and no new beginning | not used |
//! | out of range | it is valid, and λ is missing, not finite or not a [`Wavelength`] | not used; counts as distrust |
//! | implausible | it contradicts itself, see [`contradicts_itself`] | not used; counts as distrust |
//! | doubtful | its estimator does not stand by it | not used; the last trusted λ is held, unless this may be right about another: see [`Plausibility::is_fresh`] |
//! | surprising | λ differs from the one held by more than a factor of 2.1 | kept until the next valid one: if that is within a tenth of it, that one is trusted; if not, the surprise counts as distrust |
//! | trusted | none of these | λ is followed |
//!
//! Five that count as distrust within half a second are a hold, until half a second has passed without.

use protocol::{Estimate, GAUGES};

use crate::flood::Flood;
use crate::order::{Order, SENSORS, order};
use crate::pace::quarters;
use crate::phase::Wavelength;

/// A λ that differs from the one held by more than this factor is a surprise. The paper's count is a
/// whole number: from one estimate to the next it may go from 1 to 2 and back.
const SURPRISE: f32 = 2.1;
/// Estimates are about the same λ if they differ by no more than this factor: so does one that confirms a surprise.
const CONFIRMATION: f32 = 1.1;
/// So many that count as distrust, within [`DISTRUST_QUARTERS`], are too many.
const DISTRUSTED: usize = 5;
const DISTRUST_QUARTERS: u32 = quarters(500);
/// The largest amplitude that a 12-bit converter can show: the fundamental of a square wave from end to
/// end, 4/π · 2 048 steps.
const LARGEST_AMPLITUDE_LSB: f32 = 2_608.0;
/// No arm is faster: ten times the fastest that can be configured, in µm/s.
const FASTEST_ARM_UM_S: u32 = 20_000_000;
/// From here on the arm is said to move, in µm/s.
const MOVING_UM_S: u32 = 10_000;
/// The arm may go on for so long after the hand: the link there and back, and the arm's own ramps.
const CONTRADICTION_QUARTERS: u32 = quarters(3_000);
/// An arm that stands still for no longer than this only turns back.
const REVERSAL_QUARTERS: u32 = quarters(500);
/// What the sensor said last counts for so long.
const HEARD_QUARTERS: u32 = quarters(250);
/// A λ is held for so many times as long as its surface was known: the first one may have been chance.
const HELD_TIMES: u32 = 5;
/// It is held for so long at least: a link of 50 ms of jitter that loses every fifth is no reason to stop.
const LEAST_HELD_QUARTERS: u32 = quarters(150);
/// Confidence from which on a doubtful estimate is more likely right than wrong.
const LIKELY: f32 = 0.5;
/// Confidence from which on a doubtful estimate of another λ ends the hold: half of the default `valid_percent`; methods other
/// than the spectrum never say so much. The λ held was right for a fifth of the time by which this shortens holds (`hil-sim jury
/// --seed 1 --surfaces 6000`).
const POSSIBLE: f32 = 0.3;

/// What is to be done with an estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// Its λ is to be followed.
    Trusted(Wavelength),
    /// It changes nothing: its estimator does not stand by it, or it is a first surprise.
    Idle,
    /// It was sent before one that was seen already.
    Late,
    /// It is valid, and its λ is missing or none that can be followed.
    OutOfRange,
    /// It contradicts itself.
    Implausible,
    /// It is one too many.
    Flooding,
}

/// The estimates so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Plausibility {
    last_sequence: Option<u32>,
    /// How many more estimates in order have to come until a greeting was asked for without a new beginning.
    greeted: u32,
    /// See [`Plausibility::take_beginning`].
    began_anew: bool,
    held: Option<Wavelength>,
    surprise: Option<Wavelength>,
    /// Surprises that were not confirmed, to be counted by the caller.
    unconfirmed: u32,
    /// Time since the last trusted estimate, in quarters of a millisecond.
    age: u32,
    /// Time since the first trusted estimate of this surface, in quarters of a millisecond.
    since: u32,
    /// How much of that had passed at the last estimate that was trusted, or that is [`LIKELY`] and about the λ held.
    known: u32,
    /// Since then, one that may be right was about another λ.
    is_doubted: bool,
    flood: Flood,
    distrust: Distrust,
    contradiction: Contradiction,
}

impl Plausibility {
    /// Before the first estimate.
    pub const fn new() -> Self {
        Self {
            last_sequence: None,
            greeted: 0,
            began_anew: false,
            held: None,
            surprise: None,
            unconfirmed: 0,
            age: u32::MAX,
            since: 0,
            known: 0,
            is_doubted: false,
            flood: Flood::OF_ESTIMATES,
            distrust: Distrust::NONE,
            contradiction: Contradiction::NONE,
        }
    }

    /// Who sends estimates asks for a greeting, as a sensor does that has started again. On a slow link the first that
    /// come after it are no longer its first.
    pub const fn on_greeting(&mut self) {
        self.greeted = SENSORS.reordered_at_most;
    }

    /// An estimate has come, while the last trusted λ counts for `max_age_ms`.
    pub fn judge(&mut self, estimate: &Estimate, max_age_ms: u16) -> Verdict {
        if !self.flood.take() {
            return Verdict::Flooding;
        }
        let may_begin = self.may_begin();
        match order(self.last_sequence, estimate.sequence, may_begin, &SENSORS) {
            Order::Late => return Verdict::Late,
            Order::Later => self.greeted = self.greeted.saturating_sub(1),
            // Another surface, for all that is known.
            Order::Anew => {
                self.began_anew = true;
                self.greeted = 0;
                self.forget();
            }
        }
        self.last_sequence = Some(estimate.sequence);
        if contradicts_itself(estimate) {
            self.distrust.count();
            return Verdict::Implausible;
        }
        self.contradiction.hear(estimate.velocity_um_s);
        let wavelength = estimate.wavelength_mm.and_then(Wavelength::new);
        if !estimate.valid {
            if let Some((guess, held)) = wavelength.zip(self.held) {
                self.doubt(guess, held, estimate.confidence);
            }
            return Verdict::Idle;
        }
        let Some(wavelength) = wavelength else {
            self.distrust.count();
            return Verdict::OutOfRange;
        };
        if self.age > quarters(max_age_ms.into()) {
            self.forget();
        }
        self.weigh(wavelength)
    }

    /// A λ that its estimator does not stand by speaks for the one held, or against it.
    fn doubt(&mut self, guess: Wavelength, held: Wavelength, confidence: f32) {
        if !are_about_the_same(guess, held) {
            self.is_doubted |= confidence >= POSSIBLE;
        } else if confidence >= LIKELY {
            self.known = self.since;
            self.is_doubted = false;
        }
    }

    /// A tick of `quarters` of a millisecond has passed, with the hand at rest or not.
    pub fn elapse(&mut self, quarters: u32, hand_rests: bool) {
        self.age = self.age.saturating_add(quarters);
        self.since = self.since.saturating_add(quarters);
        self.flood.elapse(quarters);
        self.distrust.elapse(quarters);
        self.contradiction.elapse(quarters, hand_rests);
    }

    /// Whether the last trusted λ is no older than this, nor older than five times as long as this surface has been
    /// known, or 150 ms if that is longer; and nothing that may be right has been said of another since.
    pub fn is_fresh(&self, max_age_ms: u16) -> bool {
        let earned = self
            .known
            .saturating_mul(HELD_TIMES)
            .max(LEAST_HELD_QUARTERS);
        !self.is_doubted && self.age <= quarters(max_age_ms.into()).min(earned)
    }

    /// Whether there are more estimates than a sensor sends.
    pub const fn floods(&self) -> bool {
        self.flood.floods()
    }

    /// Whether too many estimates were not to be trusted.
    pub const fn distrusts(&self) -> bool {
        self.distrust.too_many
    }

    /// Whether the arm has been said to move for 3 s in which the hand rested.
    pub const fn contradicts(&self) -> bool {
        self.contradiction.lasted >= CONTRADICTION_QUARTERS
    }

    /// The surprises that were not confirmed since the last call.
    pub const fn take_unconfirmed(&mut self) -> u32 {
        core::mem::replace(&mut self.unconfirmed, 0)
    }

    /// Whether what comes next may be of a sensor that has started again.
    pub const fn may_begin(&self) -> bool {
        self.greeted > 0
    }

    /// Whether the sensor has started again since this was asked last.
    pub fn take_beginning(&mut self) -> bool {
        core::mem::take(&mut self.began_anew)
    }

    /// Nothing is known of the surface any more.
    fn forget(&mut self) {
        self.held = None;
        self.dismiss_surprise();
    }

    fn weigh(&mut self, wavelength: Wavelength) -> Verdict {
        let is_new = self
            .held
            .is_none_or(|held| is_another_surface(held, wavelength));
        if is_new && self.held.is_some() {
            let confirmed = self
                .surprise
                .is_some_and(|surprise| are_about_the_same(wavelength, surprise));
            if !confirmed {
                self.dismiss_surprise();
                self.surprise = Some(wavelength);
                return Verdict::Idle;
            }
            self.surprise = None;
        }
        self.dismiss_surprise();
        if is_new {
            self.since = 0;
        }
        self.known = self.since;
        self.is_doubted = false;
        self.held = Some(wavelength);
        self.age = 0;
        Verdict::Trusted(wavelength)
    }

    fn dismiss_surprise(&mut self) {
        if self.surprise.take().is_some() {
            self.unconfirmed = self.unconfirmed.wrapping_add(1);
            self.distrust.count();
        }
    }
}

impl Default for Plausibility {
    fn default() -> Self {
        Self::new()
    }
}

/// Whether λ has changed by so much that it is no drift, but another surface, or an error.
pub fn is_another_surface(before: Wavelength, now: Wavelength) -> bool {
    !are_within(now, before, SURPRISE)
}

/// Whether two estimates are about the same λ, but for what estimates are off by.
pub fn are_about_the_same(one: Wavelength, other: Wavelength) -> bool {
    are_within(one, other, CONFIRMATION)
}

/// Whether two wavelengths differ by no more than a factor.
fn are_within(one: Wavelength, other: Wavelength, factor: f32) -> bool {
    one.mm() <= other.mm() * factor && other.mm() <= one.mm() * factor
}

/// Whether no sensor can have said this: a confidence outside of 0 to 1; an amplitude that is negative or
/// more than the converter shows; an arm faster than 20 m/s; gauges that a fingertip does not have; valid
/// without a gauge that took part. A number that is none is in no range.
pub fn contradicts_itself(estimate: &Estimate) -> bool {
    const ALL_GAUGES: u8 = (1 << GAUGES) - 1;
    !(0.0..=1.0).contains(&estimate.confidence)
        || !(0.0..=LARGEST_AMPLITUDE_LSB).contains(&estimate.amplitude_lsb)
        || estimate.velocity_um_s.unsigned_abs() > FASTEST_ARM_UM_S
        || estimate.gauges_used & !ALL_GAUGES != 0
        || (estimate.valid && estimate.gauges_used == 0)
}

/// The last few estimates that were not to be trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Distrust {
    /// Ages in quarters of a millisecond, the youngest first.
    ages: [u32; DISTRUSTED],
    too_many: bool,
}

impl Distrust {
    const NONE: Self = Self {
        ages: [u32::MAX; DISTRUSTED],
        too_many: false,
    };

    fn count(&mut self) {
        self.ages.rotate_right(1);
        self.ages[0] = 0;
        self.too_many |= self.ages[DISTRUSTED - 1] <= DISTRUST_QUARTERS;
    }

    fn elapse(&mut self, quarters: u32) {
        for age in &mut self.ages {
            *age = age.saturating_add(quarters);
        }
        self.too_many &= self.ages[0] < DISTRUST_QUARTERS;
    }
}

/// How long the arm has been said to move while the hand rested.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Contradiction {
    arm_moves: bool,
    /// Time since the sensor was heard last, since it said last that the arm moves, and since the
    /// contradiction began, in quarters of a millisecond.
    heard: u32,
    moved: u32,
    lasted: u32,
}

impl Contradiction {
    const NONE: Self = Self {
        arm_moves: false,
        heard: u32::MAX,
        moved: u32::MAX,
        lasted: 0,
    };

    fn hear(&mut self, velocity_um_s: i32) {
        self.arm_moves = velocity_um_s.unsigned_abs() > MOVING_UM_S;
        self.heard = 0;
    }

    fn elapse(&mut self, quarters: u32, hand_rests: bool) {
        self.heard = self.heard.saturating_add(quarters);
        self.moved = if self.arm_moves {
            0
        } else {
            self.moved.saturating_add(quarters)
        };
        let turns_back = self.moved <= REVERSAL_QUARTERS;
        if !hand_rests || !turns_back || self.heard > HEARD_QUARTERS {
            self.lasted = 0;
        } else if self.arm_moves {
            self.lasted = self.lasted.saturating_add(quarters);
        }
    }
}
