//! The path in knots: what the gauges say, gathered by travel instead of time.
//!
//! A knot is the mean place and the mean of each gauge over a piece of travel. Knots follow the path, so a
//! reversal needs nothing special, and a slow arm costs no more than a fast one. Short pieces are merged
//! to longer ones for long waves, so that a wave is never more than some twenty knots.

use protocol::GAUGES;

use crate::travel::{PLACES_PER_MM, Place};

/// Travel of a knot at each spacing, in mm.
pub(super) const SPACINGS_MM: [f32; SPACINGS] = [0.1, 0.25, 0.5];
/// Number of spacings.
pub(super) const SPACINGS: usize = 3;
/// From these wavelengths on, in mm, the next coarser spacing serves. That leaves 6.8 knots a wave, which
/// keep sinc²(1/6.8) = 0.93 of what there is to know of the wavelength.
const COARSER_FROM_MM: [f32; SPACINGS - 1] = [1.7, 3.4];
/// Knots kept at each spacing: eight waves of the longest wavelength that it serves, at the shortest that a
/// knot becomes, and those that come while a fit goes through them. A fine knot is two thirds of its spacing at
/// least, where a millisecond travels so far; the others are made of fine ones.
const KEPT: [usize; SPACINGS] = [
    8 * 17 * 3 / 2 + SPARE,
    8 * 14 * 5 / 4 + SPARE,
    8 * 17 * 5 / 4 + SPARE,
];
/// Where each spacing's begin among all.
const FIRST: [usize; SPACINGS] = [0, KEPT[0], KEPT[0] + KEPT[1]];
/// All that are kept.
const ALL_KEPT: usize = KEPT[0] + KEPT[1] + KEPT[2];
/// Those that may come while a fit goes through them: one a millisecond at most, of seven.
const SPARE: usize = 8;

/// The spacing that serves a wavelength.
pub(super) const fn spacing_for(wavelength_mm: f32) -> usize {
    (wavelength_mm >= COARSER_FROM_MM[0]) as usize + (wavelength_mm >= COARSER_FROM_MM[1]) as usize
}

/// A piece of travel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Knot {
    /// Its mean place.
    pub place: Place,
    /// Its travel in mm.
    pub travel_mm: f32,
    /// The mean of each gauge over it, in ADC steps from mid-rail.
    pub gauges: [f32; GAUGES],
}

/// A knot that is not complete.
#[derive(Clone, Copy, Debug, Default)]
struct Gathering {
    first: Place,
    travel_mm: f32,
    /// Travel times places from `first`, and times gauges.
    moment: f32,
    gauges: [f32; GAUGES],
}

impl Gathering {
    fn add(&mut self, piece: &Knot) {
        if self.travel_mm == 0.0 {
            self.first = piece.place;
        }
        self.travel_mm += piece.travel_mm;
        self.moment += piece.travel_mm * piece.place.wrapping_sub(self.first) as f32;
        for (sum, x) in self.gauges.iter_mut().zip(piece.gauges) {
            *sum += piece.travel_mm * x;
        }
    }

    fn knot(&self) -> Option<Knot> {
        (self.travel_mm > 0.0).then(|| {
            let scale = 1.0 / self.travel_mm;
            Knot {
                place: self.first.wrapping_add((self.moment * scale) as i32),
                travel_mm: self.travel_mm,
                gauges: self.gauges.map(|sum| sum * scale),
            }
        })
    }
}

/// What is known of the knots at one spacing.
#[derive(Clone, Copy, Debug, Default)]
struct Ring {
    gathering: Gathering,
    /// Where the next one goes, and how many there are.
    next: usize,
    count: usize,
}

/// The latest path, at every spacing.
#[derive(Clone, Debug)]
pub(super) struct Knots {
    rings: [Ring; SPACINGS],
    /// One spacing's after the other's.
    knots: [Knot; ALL_KEPT],
}

impl Knots {
    /// No path yet.
    pub fn new() -> Self {
        Self {
            rings: [Ring::default(); SPACINGS],
            knots: [Knot::default(); ALL_KEPT],
        }
    }

    /// The path begins here.
    pub fn restart(&mut self) {
        self.rings = [Ring::default(); SPACINGS];
    }

    /// Takes a millisecond that travelled, `places` above 0 in quarters of a µm. `tell` hears each knot that it
    /// completes, and at which spacing.
    #[inline]
    pub fn push(
        &mut self,
        place: Place,
        places: i32,
        gauges: &[f32; GAUGES],
        mut tell: impl FnMut(usize, &Knot),
    ) {
        let piece = Knot {
            place,
            travel_mm: places as f32 * (1.0 / PLACES_PER_MM as f32),
            gauges: *gauges,
        };
        let Some(fine) = self.gather(0, &piece) else {
            return;
        };
        tell(0, &fine);
        for spacing in 1..SPACINGS {
            if let Some(knot) = self.gather(spacing, &fine) {
                tell(spacing, &knot);
            }
        }
    }

    /// The knot that `piece` completes, if it does.
    fn gather(&mut self, spacing: usize, piece: &Knot) -> Option<Knot> {
        let ring = &mut self.rings[spacing];
        ring.gathering.add(piece);
        // Ends as near to its spacing as pieces allow.
        if ring.gathering.travel_mm + 0.5 * piece.travel_mm < SPACINGS_MM[spacing] {
            return None;
        }
        let knot = ring.gathering.knot()?;
        ring.gathering = Gathering::default();
        self.knots[FIRST[spacing] + ring.next] = knot;
        ring.next = if ring.next + 1 < KEPT[spacing] {
            ring.next + 1
        } else {
            0
        };
        ring.count = (ring.count + 1).min(KEPT[spacing]);
        Some(knot)
    }

    /// The path as it is now, from its end backwards: what is not a whole knot yet, if it is half of one, and a reader of
    /// the knots before it. Good for as long as no more than [`SPARE`] knots have come.
    pub fn backwards(&self, spacing: usize) -> (Option<Knot>, Backwards) {
        let ring = &self.rings[spacing];
        let partial = ring
            .gathering
            .knot()
            .filter(|knot| knot.travel_mm > 0.5 * SPACINGS_MM[spacing]);
        let reader = Backwards {
            spacing,
            place: ring.next,
            left: ring.count.min(KEPT[spacing] - SPARE),
        };
        (partial, reader)
    }

    /// Variance over the last `travel_mm` of the path, summed over the `usable` gauges, in ADC steps².
    pub fn latest_power(&self, spacing: usize, travel_mm: f32, usable: u8) -> f32 {
        let (_, mut reader) = self.backwards(spacing);
        let (mut sums, mut squares) = ([0.0; GAUGES], [0.0; GAUGES]);
        let (mut travelled_mm, mut count) = (0.0, 0.0);
        let mut first = None;
        while travelled_mm < travel_mm
            && let Some(knot) = self.next(&mut reader)
        {
            let first = first.get_or_insert(knot.gauges);
            for gauge in 0..GAUGES {
                let x = knot.gauges[gauge] - first[gauge];
                sums[gauge] += x;
                squares[gauge] += x * x;
            }
            travelled_mm += knot.travel_mm;
            count += 1.0;
        }
        if count == 0.0 {
            return 0.0;
        }
        let share = 1.0 / count;
        (0..GAUGES)
            .filter(|gauge| usable >> gauge & 1 == 1)
            .map(|gauge| share * (squares[gauge] - share * sums[gauge] * sums[gauge]))
            .sum()
    }

    /// The next knot back of a reader.
    #[inline]
    pub fn next(&self, reader: &mut Backwards) -> Option<&Knot> {
        reader.left = reader.left.checked_sub(1)?;
        let place = reader.place.checked_sub(1);
        reader.place = place.unwrap_or(KEPT[reader.spacing] - 1);
        self.knots.get(FIRST[reader.spacing] + reader.place)
    }
}

/// See [`Knots::backwards`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Backwards {
    spacing: usize,
    /// In the ring, of the knot that was last.
    place: usize,
    left: usize,
}
