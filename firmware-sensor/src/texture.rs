//! What the surface is besides λ: the partials of its wave, what does not repeat, how it rubs.
//!
//! ```text
//! touches ─> knots of equal travel ─> a block of three waves ─> least squares ─┬─> partials ──> averages ─> Texture
//!                                                                               └─> what is left ─> spectrum ─┘
//! ```
//!
//! A block is 48 knots over three waves, or 6 mm if that is more, one way. Constant, slope and three partials are
//! fitted to each gauge at λ̂. The places where a wave begins under each gauge are of no interest, so each gauge's
//! partials are taken relative to its own fundamental: of Zₙ = Aₙ e^(iαₙ) counts Zₙ (Z̄₁/|Z₁|)ⁿ, which no shift of place
//! changes. An error of λ̂ shifts all of a block alike, and drops out too. Weighed by the fundamental's amplitude and
//! averaged over gauges and blocks that is unbiased.
//!
//! What is left of one gauge after the fit has a spectrum over wavenumber; the noise of the gauge is white in time, so
//! of a known density in wavenumber at a known speed, and is taken off.
//!
//! Only what the sensor feels counts: a partial beyond [`HIGHEST_HZ`] in a block is left out of its average.

use protocol::texture::{BANDS, LARGEST_RATIO, LOWEST_BAND_PER_MM, PARTIALS, UNITY};
use protocol::{Friction, GAUGES, Partial, Texture};

use crate::SAMPLE_RATE_HZ;
use crate::estimator::{Finding, MIN_AMPLITUDE_LSB, Touch};
use crate::phasor::phasor;
use crate::root::sqrt;
use crate::travel::{PLACES_PER_MM, PLACES_PER_UM, Place};

/// Textures a second.
pub const TEXTURE_RATE_HZ: u32 = 20;
/// The highest frequency in Hz at which a partial, or a band, is believed: above, the sensor's resonance and the
/// anti-aliasing filter are.
pub const HIGHEST_HZ: f32 = 200.0;

/// Knots in a block.
const KNOTS: usize = 48;
/// Wavelengths in a block, and the least travel in mm, so that the lowest band has a line in its spectrum.
const BLOCK_WAVES: f32 = 3.0;
/// See [`BLOCK_WAVES`].
const BLOCK_MM: f32 = 6.0;
/// Blocks over which is averaged.
const MEMORY_BLOCKS: f32 = 8.0;
/// Blocks of a surface from which on its texture is stood by.
const ENOUGH_BLOCKS: f32 = 2.0;
/// λ̂ that differs by more than this share is another surface.
const ANOTHER: f32 = 0.05;
/// A movement back of more than this ends a block: two counts of the encoder, and the force channel's noise.
const BACK: Place = 15 * PLACES_PER_UM;

/// Unknowns of a gauge: constant, slope, cosine and sine of three partials.
const TERMS: usize = 2 + 2 * WAVES;
/// Partials with the fundamental.
const WAVES: usize = 1 + PARTIALS;
/// Knots that are summed up at a time, so that a sum is fetched and stored once for all of them.
const ROWS: usize = 4;
/// Pivot relative to its diagonal below which the unknowns are not told apart.
const LEAST_PIVOT: f32 = 1e-3;
/// What is left is worked out for so many knots at a time.
const KNOTS_A_STEP: usize = 12;
/// Lines of its spectrum at a time.
const LINES_A_STEP: usize = 3;
/// Steps from one block's end to the next one's beginning, at least: at usual speeds a third of the ground is felt, at a third of the cost.
const STEPS: usize = 50;

/// Travel over which friction is averaged, in mm, and for which it does not count after a turn.
const FRICTION_MM: f32 = 20.0;
/// See [`FRICTION_MM`].
const TURN_MM: f32 = 1.0;

/// A complex number.
type Complex = [f32; 2];

/// What the sensor makes of the surface besides λ.
#[derive(Clone, Debug)]
pub struct Surface {
    /// λ̂ in mm while it is stood by, else what it was last; 0 before.
    wavelength_mm: f32,
    /// Phase of a place, in 2⁻³² cycles.
    increment: u32,
    stood_by: bool,
    /// Where the last touch was, none before the first.
    last: Option<Place>,
    /// Furthest place of this stroke, in its direction.
    furthest: Place,
    forwards: bool,
    /// Phase at the last touch, in 2⁻³² cycles of λ̂.
    phase: u32,
    knot: Knot,
    block: Block,
    solved: Option<Solved>,
    averages: Averages,
    rub: Rub,
    /// Of the last touch.
    usable: u8,
    noise: [f32; GAUGES],
}

/// A knot that is not complete: sums over its touches.
#[derive(Clone, Copy, Debug, Default)]
struct Knot {
    touches: f32,
    travel_mm: f32,
    terms: [f32; TERMS],
    gauges: [f32; GAUGES],
    first_phase: u32,
}

/// The normal equations of the block that is being gathered.
#[derive(Clone, Debug)]
struct Block {
    length_mm: f32,
    travel_mm: f32,
    /// λ̂ was stood by all the time.
    sound: bool,
    touches: f32,
    knots: usize,
    rows: [Row; ROWS],
    /// Lower triangle of Σ f fᵀ.
    normal: [[f32; TERMS]; TERMS],
    right: [[f32; TERMS]; GAUGES],
    square: [f32; GAUGES],
    /// The gauge whose rest is looked at: the loudest of the last block.
    loudest: usize,
    /// Middle phase of each knot, in 2⁻¹⁶ cycles, and what that gauge says.
    phases: [u16; KNOTS],
    felt: [f32; KNOTS],
}

#[derive(Clone, Copy, Debug, Default)]
struct Row {
    terms: [f32; TERMS],
    felt: [f32; GAUGES],
}

/// A block's fit, and how far the spectrum of what is left has come.
#[derive(Clone, Debug)]
struct Solved {
    coefficients: [f32; TERMS],
    phases: [u16; KNOTS],
    left: [f32; KNOTS],
    knots: usize,
    /// Of the block, and λ.
    length_mm: f32,
    wavelength_mm: f32,
    /// The highest wavenumber that is believed, per mm.
    highest_per_mm: f32,
    /// Touches in a knot.
    touches: f32,
    /// Density of the noise's power, in ADC steps² mm.
    noise: f32,
    /// Power of the gauge's fundamental.
    fundamental: f32,
    /// Knots whose rest is known, and lines of the spectrum.
    next_knot: usize,
    next_line: usize,
    steps: usize,
    bands: [f32; BANDS],
    /// Lines in each band.
    lines: [f32; BANDS],
}

/// Averages over blocks.
#[derive(Clone, Copy, Debug, Default)]
struct Averages {
    blocks: f32,
    /// Of each partial: Zₙ (Z̄₁/|Z₁|)ⁿ |Z₁|, |Z₁|², and the variance of the former by what is left; over how many blocks.
    partials: [PartialSum; PARTIALS],
    /// Of each band: power, the fundamental's power, and blocks.
    bands: [[f32; 3]; BANDS],
}

#[derive(Clone, Copy, Debug, Default)]
struct PartialSum {
    relative: Complex,
    fundamental: f32,
    variance: f32,
    blocks: f32,
}

/// Averages of the tangential force against the movement.
#[derive(Clone, Copy, Debug, Default)]
struct Rub {
    since_turn_mm: f32,
    weight: f32,
    mean_n: f32,
    square_n2: f32,
}

impl Default for Surface {
    fn default() -> Self {
        Self::new()
    }
}

impl Surface {
    /// Nothing felt yet.
    pub fn new() -> Self {
        Self {
            wavelength_mm: 0.0,
            increment: 0,
            stood_by: false,
            last: None,
            furthest: 0,
            forwards: true,
            phase: 0,
            knot: Knot::default(),
            block: Block::new(BLOCK_MM),
            solved: None,
            averages: Averages::default(),
            rub: Rub::default(),
            usable: 0,
            noise: [0.0; GAUGES],
        }
    }

    /// Takes a millisecond's touch, and the tangential force in N if there is a channel for it.
    pub fn push(&mut self, touch: &Touch, force_n: Option<f32>) {
        let Some(last) = self.last.replace(touch.place) else {
            self.furthest = touch.place;
            return;
        };
        let moved = touch.place.wrapping_sub(last);
        self.usable = touch.usable;
        self.noise = touch.noise;
        if self.turns(touch.place) {
            self.rub.since_turn_mm = 0.0;
            if !self.block.is_complete() {
                self.begin_block();
            }
        }
        if moved == 0 {
            return;
        }
        let travel_mm = moved.unsigned_abs() as f32 * (1.0 / PLACES_PER_MM as f32);
        if let Some(force_n) = force_n {
            self.rub.push(force_n, self.forwards, travel_mm);
        }
        if self.wavelength_mm <= 0.0 {
            return;
        }
        self.block.sound &= self.stood_by;
        self.phase = self
            .phase
            .wrapping_add((moved as u32).wrapping_mul(self.increment));
        // One after the other: the mean cost counts, not how many blocks there are.
        if self.solved.is_none() && !self.block.is_complete() {
            self.gather(touch, travel_mm);
        }
    }

    /// Whether the stroke has turned.
    fn turns(&mut self, place: Place) -> bool {
        let ahead = place.wrapping_sub(self.furthest);
        let ahead = if self.forwards { ahead } else { -ahead };
        if ahead > 0 {
            self.furthest = place;
        }
        let turned = ahead < -BACK;
        if turned {
            self.forwards = !self.forwards;
            self.furthest = place;
        }
        turned
    }

    #[inline]
    fn gather(&mut self, touch: &Touch, travel_mm: f32) {
        let knot = &mut self.knot;
        if knot.touches == 0.0 {
            knot.first_phase = self.phase;
        }
        let [c1, s1] = phasor(self.phase);
        let [c2, s2] = [c1 * c1 - s1 * s1, 2.0 * s1 * c1];
        let [c3, s3] = [c2 * c1 - s2 * s1, s2 * c1 + c2 * s1];
        // About 0, so that slope and constant have little in common.
        let tau = (self.block.travel_mm + knot.travel_mm) / self.block.length_mm - 0.5;
        for (sum, term) in knot
            .terms
            .iter_mut()
            .zip([1.0, tau, c1, s1, c2, s2, c3, s3])
        {
            *sum += term;
        }
        for (sum, x) in knot.gauges.iter_mut().zip(touch.gauges) {
            *sum += x;
        }
        knot.touches += 1.0;
        knot.travel_mm += travel_mm;
        // Ends as near to its length as touches allow, and makes up for what the last one had too much.
        let spacing = self.block.length_mm * (1.0 / KNOTS as f32);
        let due = spacing * (self.block.knots + 1) as f32;
        if self.block.travel_mm + knot.travel_mm + 0.5 * travel_mm < due {
            return;
        }
        let half = self.phase.wrapping_sub(knot.first_phase).cast_signed() / 2;
        let middle = knot.first_phase.wrapping_add_signed(half);
        let knot = core::mem::take(knot);
        self.block.take(&knot, middle);
    }

    fn begin_block(&mut self) {
        self.block
            .restart((BLOCK_WAVES * self.wavelength_mm).max(BLOCK_MM));
        self.knot = Knot::default();
    }

    /// Fits the block, and takes its partials into the averages.
    fn solve(&mut self) {
        let Some(fits) = self.block.fits() else {
            return;
        };
        let mut usable = [0.0; GAUGES];
        let mut loudest = (0.0, 0);
        for (gauge, fit) in fits.iter().enumerate() {
            let power = fit.power(1);
            if self.usable >> gauge & 1 == 1 && power > MIN_AMPLITUDE_LSB * MIN_AMPLITUDE_LSB {
                usable[gauge] = 1.0;
                if power > loudest.0 {
                    loudest = (power, gauge);
                }
            }
        }
        if loudest.0 <= 0.0 {
            return;
        }
        // Waves a ms, and so Hz.
        let waves_per_ms = self.block.travel_mm / self.wavelength_mm / self.block.touches.max(1.0);
        let hz = waves_per_ms * SAMPLE_RATE_HZ as f32;
        let averages = &mut self.averages;
        averages.blocks += 1.0;
        for (n, sum) in (2..).zip(&mut averages.partials) {
            if n as f32 * hz <= HIGHEST_HZ {
                let of_block = fits
                    .iter()
                    .zip(usable)
                    .fold(PartialSum::default(), |sum, (fit, usable)| {
                        sum.plus(&fit.relative(n), usable)
                    });
                sum.follow(&of_block);
            }
        }
        let gauge = core::mem::replace(&mut self.block.loudest, loudest.1);
        if usable[gauge] == 0.0 {
            return;
        }
        let speed_mm_s = hz * self.wavelength_mm;
        let touches = (self.block.touches * (1.0 / KNOTS as f32)).max(1.0);
        let mut coefficients = fits[gauge].coefficients;
        let knot_waves = self.block.travel_mm / KNOTS as f32 / self.wavelength_mm;
        for (n, pair) in (1_u8..).zip(coefficients[2..].chunks_exact_mut(2)) {
            let left = left_of_mean(f32::from(n) * knot_waves, touches);
            pair.iter_mut().for_each(|part| *part *= left);
        }
        self.solved = Some(Solved {
            coefficients,
            phases: self.block.phases,
            left: self.block.felt,
            knots: KNOTS,
            length_mm: self.block.travel_mm,
            wavelength_mm: self.wavelength_mm,
            touches,
            highest_per_mm: HIGHEST_HZ / speed_mm_s.max(1.0),
            // White up to half the samples' rate.
            noise: self.noise[gauge] * speed_mm_s * (2.0 / SAMPLE_RATE_HZ as f32),
            fundamental: fits[gauge].power(1),
            next_knot: 0,
            next_line: 1,
            steps: 0,
            bands: [0.0; BANDS],
            lines: [0.0; BANDS],
        });
    }

    /// Does a step of what there is to do: to be called where the estimator has little to do, twice in 10 ms at least.
    pub fn work(&mut self) {
        if let Some(solved) = &mut self.solved {
            if solved.step() {
                self.averages.take(solved);
                self.solved = None;
            }
        } else if self.block.is_complete() {
            if self.block.sound {
                self.solve();
            }
            self.begin_block();
        }
    }

    /// Hears what the estimator says of λ.
    pub fn hear(&mut self, finding: &Finding) {
        self.stood_by = finding.valid;
        let Some(wavelength_mm) = finding.wavelength_mm.filter(|_| finding.valid) else {
            return;
        };
        let another = (wavelength_mm / self.wavelength_mm - 1.0).abs() > ANOTHER;
        self.wavelength_mm = wavelength_mm;
        self.increment = (4_294_967_296.0 / (wavelength_mm * PLACES_PER_MM as f32)) as u32;
        if another || self.averages.blocks == 0.0 && self.block.knots == 0 {
            self.averages = Averages::default();
            self.solved = None;
            self.begin_block();
        }
    }

    /// What there is to say with the estimate of that number, made at `instant_us` of the board's clock.
    pub fn say(&self, sequence: u32, instant_us: u64, slips: bool) -> Texture {
        let averages = &self.averages;
        let partials = averages.partials.map(|sum| sum.partial());
        let powers = averages.bands.map(|[power, fundamental, _]| {
            if fundamental > 0.0 {
                (power / fundamental).max(0.0)
            } else {
                0.0
            }
        });
        let repeats = partials.iter().fold(0.5, |sum, partial| {
            let ratio = f32::from(partial.ratio) / f32::from(UNITY);
            sum + 0.5 * ratio * ratio
        });
        let rest: f32 = powers.iter().sum();
        Texture {
            sequence,
            instant_us,
            valid: self.stood_by && averages.blocks >= ENOUGH_BLOCKS,
            partials,
            repeating_percent: (100.0 * repeats / (repeats + rest) + 0.5) as u8,
            bands: powers.map(|power| in_units(sqrt(power))),
            friction: self.rub.friction().filter(|_| slips),
        }
    }
}

/// A ratio in 1 / [`UNITY`].
fn in_units(ratio: f32) -> u16 {
    ((ratio * f32::from(UNITY) + 0.5) as u16).min(LARGEST_RATIO)
}

/// A gauge's fit.
#[derive(Clone, Copy, Debug, Default)]
struct Fit {
    coefficients: [f32; TERMS],
    /// Variance of a coefficient by what is left.
    variance: f32,
}

impl Fit {
    /// Zₙ: the nth partial is |Zₙ| sin(nθ + arg Zₙ).
    fn partial(&self, n: usize) -> Complex {
        [self.coefficients[2 * n + 1], self.coefficients[2 * n]]
    }

    /// |Zₙ|².
    fn power(&self, n: usize) -> f32 {
        let [re, im] = self.partial(n);
        re * re + im * im
    }

    /// What the gauge adds to the average of the nth partial.
    fn relative(&self, n: usize) -> PartialSum {
        let first = self.partial(1);
        let power = self.power(1);
        let scale = 1.0 / sqrt(power).max(f32::MIN_POSITIVE);
        let back = [first[0] * scale, -first[1] * scale];
        let relative = (0..n).fold(self.partial(n), |z, _| times(z, back));
        PartialSum {
            relative: relative.map(|part| part * power * scale),
            fundamental: power,
            variance: power * self.variance,
            blocks: 1.0,
        }
    }
}

fn times([a, b]: Complex, [c, d]: Complex) -> Complex {
    [a * c - b * d, a * d + b * c]
}

impl PartialSum {
    fn plus(self, other: &Self, share: f32) -> Self {
        Self {
            relative: [
                self.relative[0] + share * other.relative[0],
                self.relative[1] + share * other.relative[1],
            ],
            fundamental: self.fundamental + share * other.fundamental,
            variance: self.variance + share * other.variance,
            blocks: 1.0,
        }
    }

    fn follow(&mut self, now: &Self) {
        self.blocks = (self.blocks + 1.0).min(MEMORY_BLOCKS);
        let share = 1.0 / self.blocks;
        for (sum, now) in self.relative.iter_mut().zip(now.relative) {
            *sum += share * (now - *sum);
        }
        self.fundamental += share * (now.fundamental - self.fundamental);
        self.variance += share * (now.variance - self.variance);
    }

    /// The partial, less what chance adds to its power.
    fn partial(&self) -> Partial {
        let [re, im] = self.relative;
        if self.fundamental <= 0.0 {
            return Partial::default();
        }
        // Both parts have that variance; an average over n blocks a share of it.
        let chance = 2.0 * self.variance / self.blocks;
        let power = (re * re + im * im - chance).max(0.0);
        let turns = libm::atan2f(im, re) * (0.5 / core::f32::consts::PI);
        Partial {
            ratio: in_units(sqrt(power) / self.fundamental),
            phase: (turns * 65_536.0) as i32 as u16,
        }
    }
}

impl Averages {
    /// Takes the spectrum of what is left of a block.
    fn take(&mut self, solved: &Solved) {
        for (band, sum) in self.bands.iter_mut().enumerate() {
            let [mean, fundamental, blocks] = sum;
            let lines = solved.lines[band];
            // The fit has taken a line for each partial, whatever was there.
            let fitted = (1..=WAVES)
                .filter(|&n| band_of(n as f32 / solved.wavelength_mm) == Some(band))
                .count() as f32;
            if lines > fitted {
                *blocks = (*blocks + 1.0).min(MEMORY_BLOCKS);
                let share = 1.0 / *blocks;
                let power = solved.bands[band] * lines / (lines - fitted);
                *mean += share * (power - *mean);
                *fundamental += share * (solved.fundamental - *fundamental);
            }
        }
    }
}

impl Block {
    fn new(length_mm: f32) -> Self {
        Self {
            length_mm,
            travel_mm: 0.0,
            sound: true,
            touches: 0.0,
            knots: 0,
            rows: [Row::default(); ROWS],
            normal: [[0.0; TERMS]; TERMS],
            right: [[0.0; TERMS]; GAUGES],
            square: [0.0; GAUGES],
            loudest: GAUGES / 2,
            phases: [0; KNOTS],
            felt: [0.0; KNOTS],
        }
    }

    /// The phases and what was felt may stay: they are written before they are read.
    fn restart(&mut self, length_mm: f32) {
        self.length_mm = length_mm;
        self.travel_mm = 0.0;
        self.sound = true;
        self.touches = 0.0;
        self.knots = 0;
        self.normal = [[0.0; TERMS]; TERMS];
        self.right = [[0.0; TERMS]; GAUGES];
        self.square = [0.0; GAUGES];
    }

    fn is_complete(&self) -> bool {
        self.knots == KNOTS
    }

    fn take(&mut self, knot: &Knot, middle: u32) {
        let scale = 1.0 / knot.touches;
        let row = &mut self.rows[self.knots % ROWS];
        row.terms = knot.terms.map(|sum| sum * scale);
        row.felt = knot.gauges.map(|sum| sum * scale);
        if let (Some(phase), Some(felt)) = (
            self.phases.get_mut(self.knots),
            self.felt.get_mut(self.knots),
        ) {
            *phase = (middle >> 16) as u16;
            *felt = row.felt[self.loudest];
        }
        self.knots += 1;
        self.touches += knot.touches;
        self.travel_mm += knot.travel_mm;
        if self.knots.is_multiple_of(ROWS) {
            self.take_in();
        }
    }

    /// Sums up the rows.
    #[inline(never)]
    fn take_in(&mut self) {
        let [one, two, three, four] = &self.rows;
        for i in 0..TERMS {
            for j in 0..=i {
                self.normal[i][j] += one.terms[i] * one.terms[j]
                    + two.terms[i] * two.terms[j]
                    + three.terms[i] * three.terms[j]
                    + four.terms[i] * four.terms[j];
            }
        }
        for gauge in 0..GAUGES {
            let felt = [one, two, three, four].map(|row| row.felt[gauge]);
            for i in 0..TERMS {
                self.right[gauge][i] += one.terms[i] * felt[0]
                    + two.terms[i] * felt[1]
                    + three.terms[i] * felt[2]
                    + four.terms[i] * felt[3];
            }
            self.square[gauge] += felt.iter().map(|x| x * x).sum::<f32>();
        }
    }

    /// The gauges' fits, by elimination. `None` if the block does not tell the unknowns apart.
    fn fits(&self) -> Option<[Fit; GAUGES]> {
        let mut a = self.normal;
        let mut pivots = [0.0_f32; TERMS];
        for j in 0..TERMS {
            if a[j][j] <= LEAST_PIVOT * self.normal[j][j] {
                return None;
            }
            pivots[j] = 1.0 / a[j][j];
            for i in j + 1..TERMS {
                let factor = a[i][j] * pivots[j];
                #[allow(
                    clippy::needless_range_loop,
                    reason = "two rows of one matrix; a slice of each is twice the instructions on the board"
                )]
                for k in j + 1..=i {
                    a[i][k] -= factor * a[k][j];
                }
            }
            for row in &mut a[j + 1..] {
                row[j] *= pivots[j];
            }
        }
        let free = (self.knots - TERMS) as f32;
        // Cosine and sine have half of the knots' power.
        let per_coefficient = 2.0 / (self.knots as f32 * free);
        let mut fits = [Fit::default(); GAUGES];
        for (gauge, fit) in fits.iter_mut().enumerate() {
            let mut y = self.right[gauge];
            let mut rest = self.square[gauge];
            for j in 0..TERMS {
                for i in j + 1..TERMS {
                    y[i] -= a[i][j] * y[j];
                }
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

impl Solved {
    /// A step; true once all is done.
    fn step(&mut self) -> bool {
        self.steps += 1;
        if self.next_knot < self.knots {
            let end = (self.next_knot + KNOTS_A_STEP).min(self.knots);
            for knot in self.next_knot..end {
                let tau = (knot as f32 + 0.5) / self.knots as f32 - 0.5;
                let [c1, s1] = phasor(u32::from(self.phases[knot]) << 16);
                let [c2, s2] = [c1 * c1 - s1 * s1, 2.0 * s1 * c1];
                let [c3, s3] = [c2 * c1 - s2 * s1, s2 * c1 + c2 * s1];
                let terms = [1.0, tau, c1, s1, c2, s2, c3, s3];
                let fitted: f32 = terms
                    .iter()
                    .zip(&self.coefficients)
                    .map(|(term, coefficient)| term * coefficient)
                    .sum();
                self.left[knot] -= fitted;
            }
            self.next_knot = end;
            return false;
        }
        for _ in 0..LINES_A_STEP {
            if self.next_line <= KNOTS / 2 {
                self.line();
            }
        }
        self.next_line > KNOTS / 2 && self.steps >= STEPS
    }

    /// A line of the spectrum.
    fn line(&mut self) {
        let line = self.next_line;
        self.next_line += 1;
        let per_mm = line as f32 / self.length_mm;
        // What is beyond half the knots' rate is not there.
        let highest = self
            .highest_per_mm
            .min(0.5 * KNOTS as f32 / self.length_mm + 1e-3);
        let Some(band) = band_of(per_mm).filter(|&band| upper_end(band) <= highest) else {
            return;
        };
        // Goertzel's recurrence.
        let [cos, _] = phasor((line as u32).wrapping_mul(u32::MAX / KNOTS as u32));
        let twice = 2.0 * cos;
        let (mut one, mut two) = (0.0, 0.0);
        for x in &self.left {
            (one, two) = (x + twice * one - two, one);
        }
        // A mean square.
        let power = (one * one + two * two - twice * one * two) * (2.0 / (KNOTS * KNOTS) as f32);
        let left = left_of_mean(line as f32 / KNOTS as f32, self.touches);
        // A line stands for as much of the spectrum as lies between two.
        self.bands[band] += (power - self.noise / self.length_mm) / (left * left);
        self.lines[band] += 1.0;
    }
}

/// What the mean over so many touches, evenly over so many waves, leaves of a wave.
fn left_of_mean(waves: f32, touches: f32) -> f32 {
    let angle = core::f32::consts::PI * waves;
    libm::sinf(angle) / (touches * libm::sinf(angle / touches))
}

/// The band that a wavenumber is in, in waves per mm.
fn band_of(per_mm: f32) -> Option<usize> {
    (0..BANDS).find(|&band| (0.5 * upper_end(band)..upper_end(band)).contains(&per_mm))
}

/// The upper end of a band, in waves per mm.
fn upper_end(band: usize) -> f32 {
    LOWEST_BAND_PER_MM * (2_u32 << band) as f32
}

impl Rub {
    /// Takes the tangential force of a millisecond that travelled.
    fn push(&mut self, force_n: f32, forwards: bool, travel_mm: f32) {
        self.since_turn_mm += travel_mm;
        if self.since_turn_mm < TURN_MM {
            return;
        }
        let against_n = if forwards { force_n } else { -force_n };
        let follow = travel_mm / (FRICTION_MM + travel_mm);
        self.weight += follow * (1.0 - self.weight);
        let share = follow / self.weight;
        let away_n = against_n - self.mean_n;
        self.mean_n += share * away_n;
        self.square_n2 = (1.0 - share) * (self.square_n2 + share * away_n * away_n);
    }

    /// What is known, once it has travelled a good part of its average.
    fn friction(&self) -> Option<Friction> {
        (self.weight > 0.3).then(|| Friction {
            mean_mn: (1_000.0 * self.mean_n + 0.5) as u16,
            fluctuation_mn: (1_000.0 * sqrt(self.square_n2) + 0.5) as u16,
        })
    }
}
