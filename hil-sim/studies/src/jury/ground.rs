//! What a stranger rubs: profiles over the way, drawn at random, with or without a period.

use std::f64::consts::{PI, TAU};

use super::dice::Dice;

/// Spacing of a profile's points, in mm.
const GRID_MM: f64 = 0.02;
/// Longest and shortest wave under the finger, with gradient and bends, in mm: what the sensor promises.
const LONGEST_MM: f64 = 8.0;
const SHORTEST_MM: f64 = 0.6;

/// One wave of a surface with a period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Waveform {
    /// A sine.
    Sine,
    /// Flat ridges with straight flanks.
    Trapezoid {
        /// Share of the wave that is ridge, between the middles of the flanks.
        duty: f64,
        /// Share of the wave that one flank takes.
        flank: f64,
    },
    /// exp(κ cos φ): round ridges, the narrower the greater κ.
    Smooth {
        /// κ.
        sharpness: f64,
    },
    /// A sine with its second and third harmonics.
    Harmonics {
        /// Amplitudes over the fundamental's.
        shares: [f64; 2],
        /// Phases in rad.
        phases: [f64; 2],
    },
    /// A second wave that has no small common multiple with the first. The first is the stronger.
    TwoWaves {
        /// The second's wavelength over the first's.
        ratio: f64,
        /// The second's amplitude over the first's, under the fingertip.
        share: f64,
        /// Phase of the second, in rad.
        phase: f64,
    },
    /// A sine and its second harmonic, each wave of another height.
    Weave {
        /// The second harmonic's amplitude over the fundamental's.
        second: f64,
        /// Phase of the second harmonic, in rad.
        phase: f64,
        /// Standard deviation of a wave's height over their mean.
        uneven: f64,
    },
}

/// A profile without any period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Plain {
    /// Nothing at all.
    Flat,
    /// A climb with a bend: the height over the whole way is a parabola.
    Slope {
        /// Height from the beginning to the end, over the signal's level.
        rise: f64,
        /// Height in the middle over the straight line's, over the signal's level.
        bend: f64,
    },
    /// A random surface with a power spectrum of 1/k between 0.1 and 50 mm.
    Random,
    /// A random surface with a band of wavenumbers. **A narrow band looks periodic for a few waves**:
    /// about 1/bandwidth of them.
    NarrowBand {
        /// Of the band's centre.
        wavelength_mm: f64,
        /// Between the points of half the power, over the centre.
        bandwidth: f64,
    },
    /// Round bumps at places that know nothing of each other (Poisson).
    Bumps {
        /// Mean distance, in mm.
        spacing_mm: f64,
        /// σ of a bump, in mm.
        width_mm: f64,
    },
    /// Steps up and down at such places.
    Steps {
        /// Mean distance, in mm.
        spacing_mm: f64,
    },
}

/// How regular ridges are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ridges {
    /// Of the surface as a mean, in mm.
    pub wavelength_mm: f64,
    /// Their form.
    pub waveform: Waveform,
    /// Share of them that is worn.
    pub worn: f64,
    /// Height of a worn one over a whole one's; 0 is missing.
    pub left: f64,
    /// Standard deviation of their places, over λ.
    pub jitter: f64,
    /// Whether a shift moves all ridges that follow, too.
    pub accumulates: bool,
    /// λ goes up and down by this share of its mean …
    pub gradient: f64,
    /// … as a sine of this period, in mm.
    pub gradient_mm: f64,
}

/// A surface of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Specimen {
    /// With a period.
    Ridged(Ridges),
    /// Without.
    Plain(Plain),
}

/// A specimen that follows on the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Second {
    /// What it is.
    pub ridges: Ridges,
    /// Where the two meet, as a share of the way rubbed.
    pub place: f64,
    /// Its RMS over the first's.
    pub level: f64,
    /// How much higher it lies, over the first's RMS.
    pub step: f64,
}

/// A random part, in addition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texture {
    /// Its RMS over the signal's.
    pub share: f64,
    /// Share of its power that all gauges meet at the same place; the rest is each one's own.
    pub common: f64,
    /// Wavelength above which it is white and below which it falls by 6 dB an octave, in mm.
    pub corner_mm: f64,
}

/// A track that bends: the ridges are crossed at an angle, λ is longer by 1/cos.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// Greatest angle, in rad.
    pub angle: f64,
    /// Way from one greatest angle to the next on the same side, in mm.
    pub period_mm: f64,
    /// Where it begins, in rad of that period.
    pub phase: f64,
}

/// All that is rubbed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// The specimen rubbed first, or the only one.
    pub first: Specimen,
    /// The one beside it.
    pub second: Option<Second>,
    /// Its random part.
    pub texture: Option<Texture>,
    /// How the track bends.
    pub bend: Option<Bend>,
    /// The fingertip's contact is a Gaussian of this full width at half maximum, in mm.
    pub contact_mm: f64,
}

/// A ground along a way, as gauges meet it: RMS 1 where there is anything.
pub struct Profile {
    from_mm: f64,
    /// One for all gauges, or one for each.
    heights: Vec<Vec<f32>>,
    wavelength_mm: Vec<f32>,
    /// Where the two specimens meet, in mm.
    pub boundary_mm: Option<f64>,
}

impl Ridges {
    /// Draws a waveform's surface: λ log-uniform in 0.7–7 mm; see [`super::stranger`] for the rest.
    pub fn draw(dice: &mut Dice, waveform: Waveform) -> Self {
        let wavelength_mm = dice.log_between(0.7, 7.0);
        let worn = dice.sometimes(0.35, 0.02, 0.3);
        let left = dice.sometimes(0.5, 0.0, 0.7);
        let jitter = dice.sometimes(0.5, 0.0, 0.04);
        let accumulates = dice.chance(0.5);
        let steepness_per_mm = dice.sometimes(0.35, 0.0, 0.01);
        let gradient_mm = dice.between(40.0, 200.0);
        // A sine of amplitude a has its steepest at a · 2π/period.
        let room = (LONGEST_MM / wavelength_mm - 1.0).min(1.0 - SHORTEST_MM / wavelength_mm);
        Self {
            wavelength_mm,
            waveform,
            worn,
            left,
            jitter,
            accumulates,
            gradient: (steepness_per_mm * gradient_mm / TAU).min(room),
            gradient_mm,
        }
    }

    /// The longest wave with the gradient, in mm.
    pub fn longest_mm(&self) -> f64 {
        self.wavelength_mm * (1.0 + self.gradient)
    }

    fn local_mm(&self, u_mm: f64) -> f64 {
        let swing = if self.gradient > 0.0 {
            self.gradient * libm::sin(TAU * u_mm / self.gradient_mm)
        } else {
            0.0
        };
        self.wavelength_mm * (1.0 + swing)
    }

    /// Heights and local λ at each point of the way; `across_mm` is the way across the ridges there.
    fn lay(
        &self,
        across_mm: &[f64],
        contact_sigma_mm: f64,
        dice: &mut Dice,
    ) -> (Vec<f32>, Vec<f32>) {
        let mut phase = dice.uniform();
        let mut ridge = Ridge::first(self, dice);
        let mut before_mm = across_mm[0];
        let mut heights = Vec::with_capacity(across_mm.len());
        let mut waves = Vec::with_capacity(across_mm.len());
        let valley = self.height(0.0, 0.0, contact_sigma_mm);
        for &u_mm in across_mm {
            let local_mm = self.local_mm(u_mm);
            phase += (u_mm - before_mm) / local_mm;
            before_mm = u_mm;
            while phase >= ridge.end {
                ridge = ridge.next(self, dice);
            }
            let share = (phase - ridge.begin) / (ridge.end - ridge.begin);
            let whole = self.height(share, ridge.number + share, contact_sigma_mm);
            let base = if matches!(self.waveform, Waveform::TwoWaves { .. }) {
                0.0
            } else {
                valley
            };
            heights.push((base + ridge.height * (whole - base)) as f32);
            waves.push(local_mm as f32);
        }
        (heights, waves)
    }

    /// Height at a share of a wave, and at that many waves from the first on.
    fn height(&self, share: f64, waves: f64, contact_sigma_mm: f64) -> f64 {
        let turn = TAU * share;
        match self.waveform {
            Waveform::Sine => -libm::cos(turn),
            Waveform::Trapezoid { duty, flank } => {
                let from_middle = (share - 0.5).abs();
                ((0.5 * duty - from_middle) / flank).clamp(-0.5, 0.5)
            }
            Waveform::Smooth { sharpness } => libm::exp(sharpness * (-libm::cos(turn) - 1.0)),
            Waveform::Harmonics { shares, phases } => {
                -libm::cos(turn)
                    + shares[0] * libm::cos(2.0 * turn + phases[0])
                    + shares[1] * libm::cos(3.0 * turn + phases[1])
            }
            Waveform::TwoWaves {
                ratio,
                share: weaker,
                phase,
            } => {
                // What the contact takes from each is made up for, so that the share holds under it.
                let blur = |mm: f64| {
                    let radian = TAU * contact_sigma_mm / mm;
                    libm::exp(-0.5 * radian * radian)
                };
                let mm = self.wavelength_mm;
                let weaker = weaker * blur(mm) / blur(mm * ratio);
                -libm::cos(turn) + weaker * libm::cos(TAU * waves / ratio + phase)
            }
            Waveform::Weave { second, phase, .. } => {
                -libm::cos(turn) + second * libm::cos(2.0 * turn + phase)
            }
        }
    }
}

/// One ridge: where it begins and ends, in waves, and how high it is.
struct Ridge {
    number: f64,
    begin: f64,
    end: f64,
    /// Where the next one would begin if no other shift came.
    shift: f64,
    height: f64,
}

impl Ridge {
    fn first(ridges: &Ridges, dice: &mut Dice) -> Self {
        Self {
            number: -1.0,
            begin: -1.0,
            end: 0.0,
            shift: 0.0,
            height: 1.0,
        }
        .next(ridges, dice)
    }

    fn next(&self, ridges: &Ridges, dice: &mut Dice) -> Self {
        let number = self.number + 1.0;
        let chance = ridges.jitter * dice.gaussian();
        let shift = if ridges.accumulates {
            self.shift + chance
        } else {
            chance
        };
        let worn = dice.chance(ridges.worn);
        let uneven = match ridges.waveform {
            Waveform::Weave { uneven, .. } => (1.0 + uneven * dice.gaussian()).max(0.0),
            _ => 1.0,
        };
        Self {
            number,
            begin: self.end,
            // A tenth of a wave at least.
            end: (number + 1.0 + shift).max(self.end + 0.1),
            shift,
            height: uneven * if worn { ridges.left } else { 1.0 },
        }
    }
}

impl Plain {
    fn lay(&self, points: usize, dice: &mut Dice) -> Vec<f32> {
        match *self {
            Self::Flat => vec![0.0; points],
            Self::Slope { rise, bend } => (0..points)
                .map(|point| {
                    let share = point as f64 / points as f64;
                    (rise * share + 4.0 * bend * share * (1.0 - share)) as f32
                })
                .collect(),
            Self::Random => {
                // Poles a factor of four apart, each with the same power: 1/k between the outermost.
                let keeps =
                    [0.1, 0.4, 1.6, 6.4, 25.6, 50.0].map(|mm: f64| libm::exp(-TAU * GRID_MM / mm));
                let mut poles = [0.0; 6];
                run_in(points, 50.0, || {
                    let mut sum = 0.0;
                    for (pole, keep) in poles.iter_mut().zip(keeps) {
                        *pole = keep * *pole + libm::sqrt(1.0 - keep * keep) * dice.gaussian();
                        sum += *pole;
                    }
                    sum
                })
            }
            Self::NarrowBand {
                wavelength_mm,
                bandwidth,
            } => {
                // Two complex poles in a row: half the power at ±0.6436 of one pole's half width.
                let radian_per_mm = TAU / wavelength_mm;
                let half_width = 0.5 * bandwidth * radian_per_mm / 0.643_594;
                let keep = libm::exp(-half_width * GRID_MM);
                let (sine, cosine) = libm::sincos(radian_per_mm * GRID_MM);
                let (re, im) = (keep * cosine, keep * sine);
                let mut poles = [(0.0, 0.0); 2];
                run_in(points, 2.0 / half_width, || {
                    let mut given = (dice.gaussian(), dice.gaussian());
                    for pole in &mut poles {
                        *pole = (
                            re * pole.0 - im * pole.1 + given.0,
                            re * pole.1 + im * pole.0 + given.1,
                        );
                        given = *pole;
                    }
                    given.0
                })
            }
            Self::Bumps {
                spacing_mm,
                width_mm,
            } => {
                let mut heights = vec![0.0_f32; points];
                let reach = libm::ceil(4.0 * width_mm / GRID_MM) as isize;
                let mut at_mm = 0.0;
                loop {
                    at_mm += spacing_mm * -libm::log(1.0 - dice.uniform());
                    let middle = (at_mm / GRID_MM) as isize;
                    if middle >= points as isize {
                        return heights;
                    }
                    let height = dice.between(0.4, 1.0);
                    let past = (middle + reach).min(points as isize);
                    for point in (middle - reach).max(0)..past {
                        let off = (point - middle) as f64 * GRID_MM / width_mm;
                        heights[point as usize] += (height * libm::exp(-0.5 * off * off)) as f32;
                    }
                }
            }
            Self::Steps { spacing_mm } => {
                let (mut height, mut next_mm) = (0.0, 0.0);
                (0..points)
                    .map(|point| {
                        while point as f64 * GRID_MM >= next_mm {
                            next_mm += spacing_mm * -libm::log(1.0 - dice.uniform());
                            // Back towards the middle as well, so that it stays within the rails.
                            height = 0.7 * height + dice.gaussian();
                        }
                        height as f32
                    })
                    .collect()
            }
        }
    }
}

impl Texture {
    fn lay(&self, points: usize, dice: &mut Dice) -> Vec<f32> {
        /// Above this it falls again, in mm: what is longer is not texture but form.
        const FORM_MM: f64 = 30.0;
        let keep = libm::exp(-TAU * GRID_MM / self.corner_mm);
        let slow = libm::exp(-TAU * GRID_MM / FORM_MM);
        let (mut fine, mut form) = (0.0, 0.0);
        run_in(points, FORM_MM, || {
            fine = keep * fine + (1.0 - keep) * dice.gaussian();
            form = slow * form + (1.0 - slow) * fine;
            fine - form
        })
    }
}

impl Ground {
    /// The longest wave of either specimen, in mm; 0 where there is none.
    pub fn longest_mm(&self) -> f64 {
        let first = match &self.first {
            Specimen::Ridged(ridges) => ridges.longest_mm(),
            Specimen::Plain(_) => 0.0,
        };
        let bend = self.bend.map_or(1.0, |bend| 1.0 / libm::cos(bend.angle));
        let second = self.second.map_or(0.0, |second| second.ridges.longest_mm());
        bend * first.max(second)
    }

    /// Lays the ground from one place to another, in mm, for as many gauges. Heights have the RMS 1 of the
    /// first specimen's own signal, a random part comes on top.
    pub fn lay(&self, from_mm: f64, to_mm: f64, gauges: usize, dice: &mut Dice) -> Profile {
        let points = libm::ceil((to_mm - from_mm) / GRID_MM) as usize + 2;
        let sigma_mm = self.contact_mm / libm::sqrt(8.0 * std::f64::consts::LN_2);
        let (across_mm, cosines) = self.across(points);
        let (mut signal, mut waves) = match &self.first {
            Specimen::Ridged(ridges) => ridges.lay(&across_mm, sigma_mm, dice),
            Specimen::Plain(plain) => (plain.lay(points, dice), vec![0.0; points]),
        };
        blur(&mut signal, sigma_mm);
        if !matches!(self.first, Specimen::Plain(Plain::Slope { .. })) {
            normalise(&mut signal, 1.0);
        }
        let mut boundary_mm = None;
        if let Some(second) = &self.second {
            let (mut other, other_waves) = second.ridges.lay(&across_mm, sigma_mm, dice);
            blur(&mut other, sigma_mm);
            normalise(&mut other, second.level);
            let at = (second.place * points as f64) as usize;
            boundary_mm = Some(from_mm + at as f64 * GRID_MM);
            // From one to the other within the contact.
            let width = 2.0 * sigma_mm / GRID_MM;
            for point in 0..points {
                let off = (point as f64 - at as f64) / width;
                let share = (0.5 + 0.5 * off).clamp(0.0, 1.0) as f32;
                let raised = other[point] + second.step as f32;
                signal[point] = (1.0 - share) * signal[point] + share * raised;
                if point >= at {
                    waves[point] = other_waves[point];
                }
            }
        }
        for (wave, cosine) in waves.iter_mut().zip(cosines) {
            *wave /= cosine;
        }
        let heights = match &self.texture {
            None => vec![signal],
            Some(texture) => {
                let mut layer = |rms: f64| {
                    let mut heights = texture.lay(points, dice);
                    blur(&mut heights, sigma_mm);
                    normalise(&mut heights, rms);
                    heights
                };
                let common = layer(texture.share * libm::sqrt(texture.common));
                (0..gauges)
                    .map(|_| {
                        let own = layer(texture.share * libm::sqrt(1.0 - texture.common));
                        (signal.iter().zip(&common).zip(own))
                            .map(|((signal, common), own)| signal + common + own)
                            .collect()
                    })
                    .collect()
            }
        };
        Profile {
            from_mm,
            heights,
            wavelength_mm: waves,
            boundary_mm,
        }
    }

    /// The way across the ridges at each point of the way, in mm, and the cosine of the angle there.
    fn across(&self, points: usize) -> (Vec<f64>, Vec<f32>) {
        let mut at_mm = 0.0;
        (0..points)
            .map(|point| {
                let cosine = self.bend.map_or(1.0, |bend| {
                    let turn = TAU * GRID_MM * point as f64 / bend.period_mm + bend.phase;
                    libm::cos(bend.angle * libm::sin(turn))
                });
                at_mm += GRID_MM * cosine;
                (at_mm, cosine as f32)
            })
            .unzip()
    }
}

impl Profile {
    /// The height that a gauge meets at a place in mm.
    #[inline]
    pub fn height(&self, gauge: usize, place_mm: f64) -> f32 {
        let heights = &self.heights[gauge.min(self.heights.len() - 1)];
        let at = ((place_mm - self.from_mm) * (1.0 / GRID_MM)).max(0.0);
        let point = (at as usize).min(heights.len() - 2);
        let share = (at - point as f64) as f32;
        heights[point] + share * (heights[point + 1] - heights[point])
    }

    /// λ at a place in mm; 0 where there is no period.
    pub fn wavelength_mm(&self, place_mm: f64) -> f32 {
        let at = ((place_mm - self.from_mm) / GRID_MM).max(0.0) as usize;
        self.wavelength_mm[at.min(self.wavelength_mm.len() - 1)]
    }

    /// The greatest height, either way.
    pub fn peak(&self) -> f32 {
        let heights = self.heights.iter().flatten();
        heights.fold(0.0, |peak, height| height.abs().max(peak))
    }
}

impl Waveform {
    /// Draws the second wave: 1.25 to 2.9 times as long or as short, a tenth away from ½, ⅔, 1½, 2.
    pub fn two_waves(dice: &mut Dice) -> Self {
        let ratio = loop {
            let ratio = dice.log_between(1.25, 2.9);
            if [1.5, 2.0]
                .iter()
                .all(|simple| (ratio / simple - 1.0).abs() > 0.1)
            {
                break if dice.chance(0.5) { ratio } else { 1.0 / ratio };
            }
        };
        Self::TwoWaves {
            ratio,
            share: dice.between(0.3, 0.7),
            phase: dice.angle(),
        }
    }
}

/// A filter's output from when its start, `memory_mm` before, is forgotten.
fn run_in(points: usize, memory_mm: f64, mut filter: impl FnMut() -> f64) -> Vec<f32> {
    for _ in 0..(memory_mm / GRID_MM) as usize {
        filter();
    }
    (0..points).map(|_| filter() as f32).collect()
}

/// A Gaussian low-pass, made of three boxes whose variances sum to its own.
fn blur(heights: &mut [f32], sigma_mm: f64) {
    // A box over 2r + 1 points has the variance r(r + 1)/3.
    let variance = sigma_mm * sigma_mm / (GRID_MM * GRID_MM);
    let mut missing = 3.0 * variance;
    let mut source = Vec::new();
    for left in (1..=3).rev() {
        let wanted = missing / f64::from(left);
        let radius = libm::round(libm::sqrt(wanted + 0.25) - 0.5).max(0.0) as usize;
        missing -= (radius * (radius + 1)) as f64;
        if radius == 0 {
            continue;
        }
        source.clear();
        source.extend_from_slice(heights);
        let last = source.len() as isize - 1;
        let at = |point: isize| f64::from(source[point.clamp(0, last) as usize]);
        let reach = radius as isize;
        let mut sum: f64 = (-reach..=reach).map(at).sum();
        let weight = 1.0 / (2 * radius + 1) as f64;
        for (point, height) in heights.iter_mut().enumerate() {
            *height = (sum * weight) as f32;
            let point = point as isize;
            sum += at(point + reach + 1) - at(point - reach);
        }
    }
}

/// Takes off the mean and brings the RMS to `rms`. What is flat stays flat.
fn normalise(heights: &mut [f32], rms: f64) {
    let count = heights.len() as f64;
    let mean = heights.iter().map(|&height| f64::from(height)).sum::<f64>() / count;
    let square = |height: &f32| (f64::from(*height) - mean) * (f64::from(*height) - mean);
    let power = heights.iter().map(square).sum::<f64>() / count;
    let scale = if power > 0.0 {
        rms / libm::sqrt(power)
    } else {
        0.0
    };
    for height in heights {
        *height = ((f64::from(*height) - mean) * scale) as f32;
    }
}

/// How a track's angle is bounded: λ/cos(angle) may not leave what the sensor promises.
pub fn greatest_angle(longest_mm: f64) -> f64 {
    let cosine = (longest_mm / LONGEST_MM).clamp(0.0, 1.0);
    libm::acos(cosine).min(PI / 6.0)
}
