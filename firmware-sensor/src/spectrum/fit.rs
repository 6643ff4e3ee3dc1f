//! One step of Gauss and Newton: a wave with a constant and a slope in each gauge, one wavenumber for all,
//! least squares over the last few waves of the path.
//!
//! s = c + d τ + a cos kx + b sin kx, each gauge with its own c, d, a, b. The slope over travel τ takes
//! drift. A pass goes through the knots once, from the newest back, and is solved each time it has covered
//! one of the asked-for lengths, so that all lengths cost no more than the longest.
//!
//! With white noise the wavenumber is as good as the Cramér–Rao bound of that length allows, once the pass
//! starts within a quarter of a cycle over the length; starting from the last estimate's result, it does.

use core::ops::Range;

use protocol::GAUGES;

use super::knots::{Backwards, Knot, Knots, spacing_for};
use crate::float::{larger, smaller, sqrt};
use crate::normal_equations::{NormalEquations, eliminate, eliminate_right};
use crate::phasor::phasor;
use crate::travel::{PLACES_PER_MM, Place};

/// The lengths that a pass is solved at, in waves.
pub(super) const LENGTHS: [f32; LENGTH_COUNT] = [1.5, 2.0, 3.0, 5.0, 8.0];
/// How many there are.
pub(super) const LENGTH_COUNT: usize = 5;

/// Fewer knots than unknowns and a few more say nothing.
const LEAST_KNOTS: u16 = 8;
/// Pivot below which the unknowns are not told apart: the path covers too little of a wave.
const LEAST_PIVOT: f32 = 1e-4;

/// Rest that no gauge is better than, relative to its energy. A gauge counts by the inverse of its rest: by its noise, as
/// least squares want it, whatever its gain.
const LEAST_REST: f32 = 0.1;
/// Rest that no gauge is better than, in ADC steps²: of the 1/12 that rounding leaves of a code some eighth is left behind
/// the anti-alias filter and in a knot's mean. A gauge whose codes stand still has less, and it is rounding.
const LEAST_NOISE: f32 = 0.01;

/// What a solution costs, in knots.
const SOLVING: usize = 4;

/// Unknowns of a gauge, and with the two derivatives of the wave by ln k.
const LINEAR: usize = 4;
const ALL: usize = 6;

/// What the last waves of the path say of a wavelength.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fitted {
    /// λ after the step, in mm.
    pub wavelength_mm: f32,
    /// Standard deviation of ln λ, if what is left is white.
    pub sigma: f32,
    /// The place that it is about: the mean of its knots'.
    pub centre: Place,
    /// Energy of the usable gauges around their lines, and of it what the wave explains, in ADC steps².
    pub total: f32,
    /// See `total`.
    pub explained: f32,
    /// The same of each gauge, whether usable or not.
    pub totals: [f32; GAUGES],
    /// See `totals`.
    pub explaineds: [f32; GAUGES],
}

impl Fitted {
    /// Share of the energy that the wave explains, 0 to 1.
    pub fn share(&self) -> f32 {
        if self.total > 0.0 {
            self.explained / self.total
        } else {
            0.0
        }
    }

    /// The mean of the `usable` gauges' own shares, 0 to 1: one that the wave has left counts as much as the others,
    /// also if there is little in it now. One whose codes stand still does not.
    pub fn gauges_share(&self, usable: u8) -> f32 {
        let (mut sum, mut count) = (0.0, 0_u8);
        for gauge in 0..GAUGES {
            if usable >> gauge & 1 == 1 && self.totals[gauge] > LEAST_NOISE {
                sum += self.explaineds[gauge] / self.totals[gauge];
                count += 1;
            }
        }
        sum / f32::from(count.max(1))
    }
}

/// A pass through the latest waves, in portions.
#[derive(Clone, Debug, Default)]
pub(super) struct Pass {
    wavelength_mm: f32,
    lengths: usize,
    /// Length that is next.
    next: usize,
    usable: u8,
    /// None before it has begun.
    reader: Option<Backwards>,
    origin: Option<Place>,
    increment: u32,
    radians_per_place: f32,
    base: [f32; GAUGES],
    sums: Sums,
    /// What was found at each length.
    pub found: [Option<Fitted>; LENGTH_COUNT],
    /// There are lengths to come.
    under_way: bool,
}

/// The normal equations so far.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    waves: f32,
    /// Sum of the knots' places, from the first one's.
    places: f32,
    knots: u16,
    /// f = (1, τ, cos, sin, θ cos, θ sin).
    normal: NormalEquations<ALL>,
}

impl Pass {
    /// Begins from the knot back that is then the newest, for those `lengths` of [`LENGTHS`], starting at
    /// `wavelength_mm` above 0. `base` is taken off the gauges: anything near their mean.
    pub fn begin(
        &mut self,
        wavelength_mm: f32,
        lengths: Range<usize>,
        usable: u8,
        base: [f32; GAUGES],
    ) {
        let places = wavelength_mm * PLACES_PER_MM as f32;
        self.wavelength_mm = wavelength_mm;
        self.lengths = lengths.end.min(LENGTH_COUNT);
        self.next = lengths.start;
        self.usable = usable;
        self.reader = None;
        self.origin = None;
        self.increment = (4_294_967_296.0 / places) as u32;
        self.radians_per_place = 2.0 * core::f32::consts::PI / places;
        self.base = base;
        self.sums = Sums::default();
        self.found = [None; LENGTH_COUNT];
        self.under_way = self.next < self.lengths;
    }

    /// Forgets what it has found.
    pub fn end(&mut self) {
        self.found = [None; LENGTH_COUNT];
        self.under_way = false;
    }

    /// Goes on for that much work: one for each knot, [`SOLVING`] for each solution. What is left of it.
    pub fn run(&mut self, path: &Knots, work: usize) -> usize {
        if work == 0 || !self.under_way {
            return work;
        }
        let mut left = work;
        let mut reader = match self.reader {
            Some(reader) => reader,
            None => {
                let (partial, reader) = path.backwards(spacing_for(self.wavelength_mm));
                if let Some(knot) = partial {
                    left -= 1;
                    self.take(&knot);
                }
                reader
            }
        };
        while self.under_way && left > 0 {
            let solved = self.next;
            match path.next(&mut reader) {
                Some(knot) => self.take(knot),
                None => self.under_way = false,
            }
            left = left.saturating_sub(1 + SOLVING * (self.next - solved));
        }
        self.reader = Some(reader);
        left
    }

    fn take(&mut self, knot: &Knot) {
        let origin = *self.origin.get_or_insert(knot.place);
        let away = knot.place.wrapping_sub(origin);
        let phasor = phasor((away as u32).wrapping_mul(self.increment));
        let angle = away as f32 * self.radians_per_place;
        let waves = knot.travel_mm / self.wavelength_mm;
        self.sums.places += away as f32;
        self.sums.add(waves, phasor, angle, knot, &self.base);
        // A length ends with the knot that is nearest to its end.
        while self.under_way && self.sums.waves + 0.5 * waves >= LENGTHS[self.next] {
            self.sums.normal.take_in();
            let mean = self.sums.places / f32::from(self.sums.knots);
            self.found[self.next] = self
                .sums
                .solve(self.wavelength_mm, LENGTHS[self.next], self.usable)
                .map(|fitted| Fitted {
                    centre: origin.wrapping_add(mean as i32),
                    ..fitted
                });
            self.next += 1;
            self.under_way = self.next < self.lengths;
        }
    }
}

impl Sums {
    /// Takes a knot of that many waves.
    #[inline]
    fn add(
        &mut self,
        waves: f32,
        [cos, sin]: [f32; 2],
        angle: f32,
        knot: &Knot,
        base: &[f32; GAUGES],
    ) {
        let tau = self.waves + 0.5 * waves;
        self.waves += waves;
        self.knots += 1;
        let terms = [1.0, tau, cos, sin, angle * cos, angle * sin];
        let felt = core::array::from_fn(|gauge| knot.gauges[gauge] - base[gauge]);
        self.normal.add(terms, felt);
    }

    /// The step, of a pass that started at `wavelength_mm`, over `waves`. `None` if the path does not tell
    /// the unknowns apart.
    fn solve(&self, wavelength_mm: f32, waves: f32, usable: u8) -> Option<Fitted> {
        if self.knots < LEAST_KNOTS {
            return None;
        }
        let scale = 1.0 / f32::from(self.knots);
        let mut a = self.normal.products.map(|row| row.map(|sum| sum * scale));
        let pivots: [f32; LINEAR] = eliminate(&mut a, |_| LEAST_PIVOT)?;
        let mut fitted = Fitted::default();
        let (mut along, mut curvature, mut rest, mut count) = (0.0, 0.0, 0.0, 0_u16);
        let mut weighed_total = 0.0;
        for gauge in 0..GAUGES {
            let mut y = self.normal.right[gauge].map(|sum| sum * scale);
            eliminate_right(&a, &mut y, LINEAR);
            let energy = |j: usize| y[j] * y[j] * pivots[j];
            let total = larger(
                self.normal.square[gauge] * scale - energy(0) - energy(1),
                0.0,
            );
            let explained = smaller(energy(2) + energy(3), total);
            fitted.totals[gauge] = total;
            fitted.explaineds[gauge] = explained;
            if usable >> gauge & 1 == 0 {
                continue;
            }
            let sine = y[3] * pivots[3];
            let cosine = y[2] * pivots[2] - a[3][2] * sine;
            // d/d ln k of a cos θ + b sin θ is θ (b cos θ − a sin θ).
            let left = total - explained;
            let weight = 1.0 / larger(left + LEAST_REST * total, LEAST_NOISE);
            along += weight * (sine * y[4] - cosine * y[5]);
            curvature += weight
                * (sine * sine * a[4][4] - 2.0 * cosine * sine * a[5][4]
                    + cosine * cosine * a[5][5]);
            fitted.total += total;
            fitted.explained += explained;
            rest += weight * left;
            weighed_total += weight * total;
            count += 1;
        }
        if curvature.is_nan() || curvature <= 0.0 {
            return None;
        }
        let most = 0.5 / waves;
        let step = (along / curvature).clamp(-most, most);
        let rest = larger(rest - along * along / curvature, 1e-9 * weighed_total);
        let free = self.knots * count;
        let unknowns = LINEAR as u16 * count + 2;
        fitted.sigma = sqrt(rest / curvature / f32::from(free.saturating_sub(unknowns).max(1)));
        fitted.wavelength_mm = wavelength_mm / (1.0 + step);
        Some(fitted)
    }
}
