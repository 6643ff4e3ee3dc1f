//! A block of ground: its knots, and the least-squares fit of a wave with its partials to each gauge.

use protocol::GAUGES;
use protocol::texture::PARTIALS;

use super::{Complex, times};
use crate::float::sqrt;
use crate::normal_equations::{NormalEquations, eliminate, eliminate_right};
use crate::phasor::phasor;

/// Knots in a block.
pub(super) const KNOTS: usize = 48;
/// Share of a block that is a knot.
const KNOT: f32 = 1.0 / KNOTS as f32;
/// Partials with the fundamental.
pub(super) const WAVES: usize = 1 + PARTIALS;
/// Unknowns of a gauge: constant, slope, cosine and sine of three partials.
pub(super) const TERMS: usize = 2 + 2 * WAVES;
/// Pivot relative to its diagonal below which the unknowns are not told apart.
const LEAST_PIVOT: f32 = 1e-3;

/// Cosine and sine of each wave at a phase, in 2⁻³² cycles.
pub(super) fn waves(phase: u32) -> [f32; 2 * WAVES] {
    let [c1, s1] = phasor(phase);
    let [c2, s2] = [c1 * c1 - s1 * s1, 2.0 * s1 * c1];
    let [c3, s3] = [c2 * c1 - s2 * s1, s2 * c1 + c2 * s1];
    [c1, s1, c2, s2, c3, s3]
}

/// What is fitted at a knot: a constant, a slope that is -½ to ½ over the block, so that the two have little in common,
/// and the waves.
pub(super) fn terms(knot: usize, [c1, s1, c2, s2, c3, s3]: [f32; 2 * WAVES]) -> [f32; TERMS] {
    let tau = (knot as f32 + 0.5) * KNOT - 0.5;
    [1.0, tau, c1, s1, c2, s2, c3, s3]
}

/// A knot that is not complete: sums over its touches.
#[derive(Clone, Copy, Debug, Default)]
struct Knot {
    touches: f32,
    travel_mm: f32,
    waves: [f32; 2 * WAVES],
    gauges: [f32; GAUGES],
    first_phase: u32,
}

/// The block that is being gathered.
#[derive(Clone, Debug)]
pub(super) struct Block {
    length_mm: f32,
    /// Travel in mm at which the knot is due.
    due_mm: f32,
    /// Travel in mm, touches and number of the complete knots.
    pub travel_mm: f32,
    /// See `travel_mm`.
    pub touches: f32,
    /// See `travel_mm`.
    pub knots: usize,
    /// λ̂ was stood by all the time.
    pub sound: bool,
    knot: Knot,
    normal: NormalEquations<TERMS>,
    /// The gauge that is kept: the loudest of the last block.
    pub loudest: usize,
    /// That gauge, knot by knot.
    pub ground: Ground,
}

/// Middle phase of each knot, in 2⁻¹⁶ cycles, and what one gauge says there, in ADC steps.
#[derive(Clone, Debug)]
pub(super) struct Ground {
    pub phases: [u16; KNOTS],
    pub felt: [f32; KNOTS],
}

impl Block {
    pub fn new(length_mm: f32) -> Self {
        Self {
            length_mm,
            due_mm: length_mm * KNOT,
            travel_mm: 0.0,
            touches: 0.0,
            knots: 0,
            sound: true,
            knot: Knot::default(),
            normal: NormalEquations::default(),
            loudest: GAUGES / 2,
            ground: Ground {
                phases: [0; KNOTS],
                felt: [0.0; KNOTS],
            },
        }
    }

    /// The ground may stay: it is written before it is read.
    pub fn restart(&mut self, length_mm: f32) {
        self.length_mm = length_mm;
        self.due_mm = length_mm * KNOT;
        self.travel_mm = 0.0;
        self.touches = 0.0;
        self.knots = 0;
        self.sound = true;
        self.knot = Knot::default();
        self.normal = NormalEquations::default();
    }

    /// Whether there is something in it that counts.
    pub fn is_begun(&self) -> bool {
        self.knots > 0 || self.sound && self.knot.touches > 0.0
    }

    pub const fn is_complete(&self) -> bool {
        self.knots == KNOTS
    }

    /// Takes a touch that travelled to that phase, in 2⁻³² cycles. Not to be called once it is complete.
    #[inline]
    pub fn add(&mut self, gauges: &[f32; GAUGES], phase: u32, travel_mm: f32) {
        let knot = &mut self.knot;
        if knot.touches == 0.0 {
            knot.first_phase = phase;
        }
        for (sum, wave) in knot.waves.iter_mut().zip(waves(phase)) {
            *sum += wave;
        }
        for (sum, x) in knot.gauges.iter_mut().zip(gauges) {
            *sum += x;
        }
        knot.touches += 1.0;
        knot.travel_mm += travel_mm;
        // Ends as near to its length as touches allow, and makes up for what the last one had too much.
        if self.travel_mm + knot.travel_mm + 0.5 * travel_mm >= self.due_mm {
            let half = phase.wrapping_sub(knot.first_phase).cast_signed() / 2;
            let middle = knot.first_phase.wrapping_add_signed(half);
            self.take(middle);
        }
    }

    /// Takes the knot, whose middle is there.
    #[inline(never)]
    fn take(&mut self, middle: u32) {
        let knot = core::mem::take(&mut self.knot);
        let scale = 1.0 / knot.touches;
        let gauges = knot.gauges.map(|sum| sum * scale);
        self.normal
            .add(terms(self.knots, knot.waves.map(|sum| sum * scale)), gauges);
        if self.knots < KNOTS {
            self.ground.phases[self.knots] = (middle >> 16) as u16;
            self.ground.felt[self.knots] = gauges[self.loudest];
        }
        self.knots += 1;
        self.due_mm = self.length_mm * KNOT * (self.knots + 1) as f32;
        self.touches += knot.touches;
        self.travel_mm += knot.travel_mm;
    }

    /// The gauges' fits. `None` if the block does not tell the unknowns apart.
    pub fn fits(&self) -> Option<[Fit; GAUGES]> {
        let mut a = self.normal.products;
        let pivots: [f32; TERMS] = eliminate(&mut a, |j| LEAST_PIVOT * self.normal.products[j][j])?;
        let free = (self.knots - TERMS) as f32;
        // Cosine and sine have half of the knots' power.
        let per_coefficient = 2.0 / (self.knots as f32 * free);
        let mut fits = [Fit::default(); GAUGES];
        for (gauge, fit) in fits.iter_mut().enumerate() {
            let mut y = self.normal.right[gauge];
            let mut rest = self.normal.square[gauge];
            eliminate_right(&a, &mut y, TERMS);
            for j in 0..TERMS {
                rest -= y[j] * y[j] * pivots[j];
                y[j] *= pivots[j];
            }
            for i in (0..TERMS).rev() {
                for j in 0..i {
                    y[j] -= a[i][j] * y[i];
                }
            }
            fit.coefficients = y;
            fit.variance = rest.max(0.0) * per_coefficient;
        }
        Some(fits)
    }
}

/// A gauge's fit.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fit {
    pub coefficients: [f32; TERMS],
    /// Variance of a coefficient by what is left.
    pub variance: f32,
}

impl Fit {
    /// Zₙ: the nth partial is |Zₙ| sin(nθ + arg Zₙ).
    fn partial(&self, n: usize) -> Complex {
        [self.coefficients[2 * n + 1], self.coefficients[2 * n]]
    }

    /// |Zₙ|².
    pub fn power(&self, n: usize) -> f32 {
        let [re, im] = self.partial(n);
        re * re + im * im
    }

    /// Zₙ (Z̄₁/|Z₁|)ⁿ |Z₁|: the second and third partial relative to the fundamental's phase, times its amplitude.
    pub fn relative(&self) -> [Complex; PARTIALS] {
        let first = self.partial(1);
        let power = self.power(1);
        let scale = 1.0 / sqrt(power).max(f32::MIN_POSITIVE);
        let back = [first[0] * scale, -first[1] * scale];
        core::array::from_fn(|at| {
            let n = at + 2;
            let relative = (0..n).fold(self.partial(n), |z, _| times(z, back));
            relative.map(|part| part * power * scale)
        })
    }
}
