//! Which estimates a display is to trust, and when it must not drive at all: the rules of docs' safety page,
//! written down a second time. Nothing here comes from the firmware, so that an error there shows.

use std::collections::VecDeque;

use protocol::{Estimate, GAUGES, Hold};

/// A λ counts for so many times as long as estimates have said about the same, and for so long at least.
const EARNED: u64 = 5;
/// Confidence of one that says so without being stood by.
const LIKELY: f32 = 0.5;
/// Confidence of one that is not stood by, and tells another λ, that ends the hold.
const POSSIBLE: f32 = 0.3;
const LEAST_AGE_NS: u64 = 150_000_000;
/// λ that can be played, in mm.
const PLAYABLE_MM: std::ops::RangeInclusive<f32> = 0.1..=50.0;
/// A λ that differs by more than this factor from the one held has to be confirmed by the next one.
const SURPRISE: f32 = 2.1;
/// It is if that is about the same λ: if they differ by no more than this factor.
const CONFIRMATION: f32 = 1.1;
/// So many that can't be true within [`DISTRUST_NS`] are a reason not to drive, until so long has passed without.
const DISTRUSTED: usize = 5;
const DISTRUST_NS: u64 = 500_000_000;
/// So many estimates may come at once, and so many a second for longer.
const FLOOD: f64 = 40.0;
const FLOOD_HZ: f64 = 400.0;
/// A number that is behind the last by no more than this is an old one.
const OLD: u32 = 1_000;
/// Behind by more than [`REORDERED`], one of these numbers is a sensor's first.
const FIRST: u32 = 10;
const REORDERED: u32 = 32;
/// The fundamental of a square wave from end to end of the converter, in its steps.
const LARGEST_AMPLITUDE_LSB: f32 = 2_608.0;
/// In µm/s.
const FASTEST_ARM_UM_S: u32 = 20_000_000;

/// What the estimates that arrived so far ask of a display. Instants are those of its ticks, in ns since the scene's
/// start: a board counts by ticks, and hears what has arrived once the next one's words are on their way.
#[derive(Clone, Debug, Default)]
pub struct Trust {
    max_age_ns: u64,
    sequence: Option<u32>,
    /// How many more estimates in order have to come until a greeting was asked for by a sensor that has not started again.
    asked: u32,
    held_mm: Option<f32>,
    surprise_mm: Option<f32>,
    trusted_ns: Option<u64>,
    /// When the first λ that was followed on this surface came.
    since_ns: u64,
    /// When an estimate said about that λ last, whether it was to be followed or not.
    said_ns: u64,
    /// Since then, one that may be right was about another λ.
    is_doubted: bool,
    /// Estimates that have come and have not run out, and when.
    bucket: (f64, u64),
    floods: bool,
    /// When what can't be true came.
    untrue_ns: VecDeque<u64>,
    distrusts: bool,
}

impl Trust {
    /// Before the first estimate; an estimate counts for `max_age_ms`, less where its λ is new.
    pub fn new(max_age_ms: u16) -> Self {
        Self {
            max_age_ns: u64::from(max_age_ms) * 1_000_000,
            ..Self::default()
        }
    }

    /// Who sends estimates has asked for a greeting, as a sensor does that has started again.
    pub fn greet(&mut self) {
        self.asked = REORDERED;
    }

    /// An estimate is heard: the λ to be followed from now on, in mm, if it is one to follow.
    pub fn hear(&mut self, at_ns: u64, estimate: &Estimate) -> Option<f64> {
        self.elapse(at_ns);
        self.bucket.0 = (self.bucket.0 + 1.0).min(FLOOD + 1.0);
        self.floods |= self.bucket.0 > FLOOD;
        if self.floods || !self.is_next(estimate.sequence) {
            return None;
        }
        self.sequence = Some(estimate.sequence);
        if is_absurd(estimate) {
            self.distrust(at_ns);
            return None;
        }
        let playable_mm = estimate.wavelength_mm.filter(|mm| PLAYABLE_MM.contains(mm));
        if !estimate.valid {
            if let Some((mm, held_mm)) = playable_mm.zip(self.held_mm) {
                let is_another = !are_about_the_same(mm, held_mm);
                if is_another && estimate.confidence >= POSSIBLE {
                    self.is_doubted = true;
                } else if !is_another && estimate.confidence >= LIKELY {
                    self.is_doubted = false;
                    self.said_ns = at_ns;
                }
            }
            return None;
        }
        let Some(mm) = playable_mm else {
            self.distrust(at_ns);
            return None;
        };
        if self.is_older(at_ns, self.max_age_ns) {
            self.forget(at_ns);
        }
        let is_new = self
            .held_mm
            .is_none_or(|held_mm| differ(mm, held_mm, SURPRISE));
        if is_new && self.held_mm.is_some() {
            let confirmed = self
                .surprise_mm
                .take_if(|surprise_mm| are_about_the_same(mm, *surprise_mm));
            if confirmed.is_none() {
                self.dismiss(at_ns);
                self.surprise_mm = Some(mm);
                return None;
            }
        }
        self.dismiss(at_ns);
        if is_new {
            self.since_ns = at_ns;
        }
        self.held_mm = Some(mm);
        self.said_ns = at_ns;
        self.is_doubted = false;
        self.trusted_ns = Some(at_ns);
        Some(f64::from(mm))
    }

    /// The reasons not to drive that there are at an instant. Before the first estimate that is trusted, there is
    /// no more than [`Hold::Stale`].
    pub fn holds(&mut self, at_ns: u64) -> impl Iterator<Item = Hold> {
        self.elapse(at_ns);
        let stale = self.is_stale(at_ns).then_some(Hold::Stale);
        let distrust = self.distrusts.then_some(Hold::Distrust);
        let flood = self.floods.then_some(Hold::Flood);
        [flood, distrust, stale].into_iter().flatten()
    }

    fn elapse(&mut self, at_ns: u64) {
        let (level, since_ns) = self.bucket;
        let run_out = FLOOD_HZ * at_ns.saturating_sub(since_ns) as f64 * 1e-9;
        self.bucket = ((level - run_out).max(0.0), at_ns.max(since_ns));
        self.floods &= self.bucket.0 > 0.0;
        self.distrusts &= self
            .untrue_ns
            .back()
            .is_some_and(|&last_ns| at_ns <= last_ns + DISTRUST_NS);
    }

    fn is_stale(&self, at_ns: u64) -> bool {
        let known_ns = self.said_ns.saturating_sub(self.since_ns);
        let earned_ns = (EARNED * known_ns).max(LEAST_AGE_NS);
        self.is_doubted || self.is_older(at_ns, self.max_age_ns.min(earned_ns))
    }

    fn is_older(&self, at_ns: u64, age_ns: u64) -> bool {
        self.trusted_ns
            .is_none_or(|trusted_ns| at_ns > trusted_ns + age_ns)
    }

    /// Whether it was sent after the last one. Of a sensor that has started again, everything is forgotten.
    fn is_next(&mut self, sequence: u32) -> bool {
        let Some(last) = self.sequence else {
            return true;
        };
        let behind = last.wrapping_sub(sequence);
        if behind > i32::MAX as u32 {
            self.asked = self.asked.saturating_sub(1);
            return true;
        }
        let is_first = sequence <= FIRST || self.asked > 0;
        let begins = behind > OLD || (is_first && behind > REORDERED);
        if begins {
            self.asked = 0;
            self.held_mm = None;
            if self.surprise_mm.take().is_some() {
                self.distrust(self.bucket.1);
            }
        }
        begins
    }

    fn forget(&mut self, at_ns: u64) {
        self.held_mm = None;
        self.dismiss(at_ns);
    }

    /// A surprise that was not confirmed.
    fn dismiss(&mut self, at_ns: u64) {
        if self.surprise_mm.take().is_some() {
            self.distrust(at_ns);
        }
    }

    fn distrust(&mut self, at_ns: u64) {
        // Half a second has passed without, if only just.
        self.distrusts &= self
            .untrue_ns
            .back()
            .is_some_and(|&last_ns| at_ns < last_ns + DISTRUST_NS);
        self.untrue_ns.push_back(at_ns);
        if self.untrue_ns.len() > DISTRUSTED {
            self.untrue_ns.pop_front();
        }
        let oldest_ns = self.untrue_ns.front().copied().unwrap_or(at_ns);
        self.distrusts |= self.untrue_ns.len() == DISTRUSTED && at_ns <= oldest_ns + DISTRUST_NS;
    }
}

/// Whether two estimates are about the same λ, in mm.
pub fn are_about_the_same(one_mm: f32, other_mm: f32) -> bool {
    !differ(one_mm, other_mm, CONFIRMATION)
}

/// Whether one is more than a factor of the other.
fn differ(one_mm: f32, other_mm: f32, factor: f32) -> bool {
    one_mm > other_mm * factor || other_mm > one_mm * factor
}

fn is_absurd(estimate: &Estimate) -> bool {
    !(0.0..=1.0).contains(&estimate.confidence)
        || !(0.0..=LARGEST_AMPLITUDE_LSB).contains(&estimate.amplitude_lsb)
        || estimate.velocity_um_s.unsigned_abs() > FASTEST_ARM_UM_S
        || u32::from(estimate.gauges_used) >= 1 << GAUGES
        || (estimate.valid && estimate.gauges_used == 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::synthetic::Run;

    const MS: u64 = 1_000_000;

    /// An estimate of `mm` every 10 ms, from 0 on: what is followed.
    fn followed(trust: &mut Trust, from: u32, wavelengths_mm: &[f32]) -> Vec<Option<f64>> {
        let plain = Run::steady(50.0, 2.0).record().estimates[0].estimate;
        let heard = wavelengths_mm.iter().zip(from..).map(|(&mm, sequence)| {
            let mut estimate = plain;
            estimate.sequence = sequence;
            estimate.wavelength_mm = Some(mm);
            trust.hear(u64::from(sequence) * 10 * MS, &estimate)
        });
        heard.collect()
    }

    fn holds(trust: &mut Trust, at_ms: u64) -> Vec<Hold> {
        trust.holds(at_ms * MS).collect()
    }

    #[test]
    fn a_jump_is_followed_once_it_is_confirmed() {
        let mut trust = Trust::new(500);
        let heard = followed(&mut trust, 0, &[2.0, 4.2, 2.0, 5.0, 5.4, 11.0, 5.5]);
        let expected = [2.0, 4.2, 2.0, 0.0, 5.4, 11.0, 5.5].map(|mm: f32| f64::from(mm));
        let expected = expected.map(|mm| (mm > 0.0).then_some(mm));
        assert_eq!(heard, expected);
        assert_eq!(
            followed(&mut trust, 7, &[20.0, 5.0, 20.0]),
            [None, Some(5.0), None]
        );
    }

    #[test]
    fn five_in_half_a_second_that_cannot_be_true_are_distrusted_for_half_a_second() {
        let mut trust = Trust::new(500);
        followed(&mut trust, 0, &[2.0, 0.05, 0.05, f32::NAN, 2_000.0]);
        assert_eq!(holds(&mut trust, 45), []);
        followed(&mut trust, 5, &[0.0]);
        assert_eq!(holds(&mut trust, 50), [Hold::Distrust]);
        followed(&mut trust, 6, &[2.0; 20]);
        assert_eq!(holds(&mut trust, 550), [Hold::Distrust]);
        assert_eq!(holds(&mut trust, 551), []);
    }

    #[test]
    fn one_that_cannot_be_true_prolongs_distrust_within_half_a_second_and_not_after_it() {
        for (next, prolongs) in [(54, true), (55, false)] {
            let mut trust = Trust::new(2_000);
            followed(&mut trust, 0, &[2.0, 0.05, 0.05, f32::NAN, 2_000.0, 0.0]);
            followed(&mut trust, next, &[0.0]);
            let held = holds(&mut trust, 600).contains(&Hold::Distrust);
            assert_eq!(held, prolongs, "{next}");
        }
    }

    #[test]
    fn an_estimate_counts_for_its_time_and_an_old_one_for_nothing() {
        let mut trust = Trust::new(500);
        assert_eq!(holds(&mut trust, 0), [Hold::Stale]);
        followed(&mut trust, 5, &[2.0; 20]);
        assert_eq!(holds(&mut trust, 240 + 500), []);
        assert_eq!(holds(&mut trust, 240 + 501), [Hold::Stale]);
        // What was sent before it, or is sent again, changes nothing; a sensor's first does, and so does what comes once
        // a sensor has asked for a greeting.
        let mut late = Run::steady(50.0, 2.0).record().estimates[0].estimate;
        late.sequence = 24;
        assert_eq!(trust.hear(750 * MS, &late), None);
        late.sequence = 23;
        assert_eq!(trust.hear(750 * MS, &late), None);
        assert_eq!(followed(&mut trust, 100, &[2.0]), [Some(2.0)]);
        late.sequence = 0;
        assert_eq!(trust.hear(1_001 * MS, &late), Some(2.0));
        followed(&mut trust, 300, &[2.0]);
        late.sequence = 200;
        assert_eq!(trust.hear(3_001 * MS, &late), None);
        for (in_order, expected) in [(31, Some(2.0)), (32, None)] {
            trust.greet();
            followed(&mut trust, 301, &vec![2.0; in_order]);
            assert_eq!(trust.hear(3_400 * MS, &late), expected, "{in_order}");
        }
    }

    #[test]
    fn a_surface_that_was_met_just_now_counts_for_less() {
        let mut trust = Trust::new(500);
        followed(&mut trust, 5, &[2.0]);
        assert_eq!(holds(&mut trust, 50 + 150), []);
        assert_eq!(holds(&mut trust, 50 + 151), [Hold::Stale]);
        // Known for 60 ms.
        followed(&mut trust, 100, &[2.0; 7]);
        assert_eq!(holds(&mut trust, 1_060 + 300), []);
        assert_eq!(holds(&mut trust, 1_060 + 301), [Hold::Stale]);
        // What likely says the same makes it known, even if it is not to be followed.
        followed(&mut trust, 150, &[2.0]);
        let plain = Run::steady(50.0, 2.0).record().estimates[0].estimate;
        for (sequence, confidence, mm) in [(151, 0.5, 2.1), (152, 0.49, 2.0), (153, 0.29, 2.3)] {
            let doubtful = Estimate {
                sequence,
                confidence,
                valid: false,
                wavelength_mm: Some(mm),
                ..plain
            };
            assert_eq!(trust.hear(1_600 * MS, &doubtful), None);
        }
        assert_eq!(holds(&mut trust, 1_500 + 500), []);
        assert_eq!(holds(&mut trust, 1_500 + 501), [Hold::Stale]);
        // Another one has to be known anew.
        followed(&mut trust, 250, &[2.0; 20]);
        followed(&mut trust, 270, &[5.0, 5.0]);
        assert_eq!(holds(&mut trust, 2_710 + 150), []);
        assert_eq!(holds(&mut trust, 2_710 + 151), [Hold::Stale]);
    }

    #[test]
    fn what_may_be_another_surface_ends_the_hold_of_the_one_before() {
        let mut trust = Trust::new(500);
        followed(&mut trust, 20, &[2.0; 20]);
        let plain = Run::steady(50.0, 2.0).record().estimates[0].estimate;
        let stale = [Hold::Stale].as_slice();
        for (sequence, confidence, valid, mm, expected) in [
            (40, 0.3, false, 2.1, [].as_slice()),
            (41, 0.29, false, 2.3, &[]),
            (42, 0.3, false, 2.3, stale),
            (43, 0.49, false, 2.0, stale),
            (44, 0.5, false, 2.0, &[]),
            (45, 0.3, false, 1.75, stale),
            (46, 0.9, true, 2.0, &[]),
        ] {
            let said = Estimate {
                sequence,
                confidence,
                valid,
                wavelength_mm: Some(mm),
                ..plain
            };
            trust.hear(410 * MS, &said);
            assert_eq!(holds(&mut trust, 420), expected, "{sequence}");
        }
    }

    #[test]
    fn more_than_forty_at_once_are_a_flood_for_a_tenth_of_a_second() {
        let mut trust = Trust::new(500);
        let plain = Run::steady(50.0, 2.0).record().estimates[0].estimate;
        for sequence in 0..41 {
            assert!(!holds(&mut trust, 10).contains(&Hold::Flood));
            trust.hear(10 * MS, &Estimate { sequence, ..plain });
        }
        assert_eq!(holds(&mut trust, 112), [Hold::Flood]);
        assert_eq!(holds(&mut trust, 113), []);
    }

    #[test]
    fn what_no_sensor_can_have_said_is_told_field_by_field() {
        let plain = Run::steady(50.0, 2.0).record().estimates[0].estimate;
        let possible: [fn(&mut Estimate); 6] = [
            |said| said.confidence = 0.0,
            |said| said.confidence = 1.0,
            |said| said.amplitude_lsb = LARGEST_AMPLITUDE_LSB,
            |said| said.velocity_um_s = -20_000_000,
            |said| said.gauges_used = 0b1_1111,
            |said| (said.valid, said.gauges_used) = (false, 0),
        ];
        let absurd: [fn(&mut Estimate); 8] = [
            |said| said.confidence = -0.01,
            |said| said.confidence = f32::NAN,
            |said| said.amplitude_lsb = -0.01,
            |said| said.amplitude_lsb = 2_608.5,
            |said| said.velocity_um_s = 20_000_001,
            |said| said.velocity_um_s = i32::MIN,
            |said| said.gauges_used = 0b10_0000,
            |said| (said.valid, said.gauges_used) = (true, 0),
        ];
        let judged = |change: fn(&mut Estimate)| {
            let mut said = plain;
            change(&mut said);
            is_absurd(&said)
        };
        assert_eq!(possible.map(judged), [false; 6]);
        assert_eq!(absurd.map(judged), [true; 8]);
    }
}
