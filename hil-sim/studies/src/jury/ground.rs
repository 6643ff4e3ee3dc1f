//! What a stranger rubs: profiles over the way, drawn at random, with or without a period.

use std::f64::consts::{PI, TAU};

use super::counts::Partials;
use super::dice::Dice;

mod plain;
mod ridges;

pub use plain::Plain;
pub use ridges::{Ridges, Waveform};

/// Spacing of a profile's points, in mm.
const GRID_MM: f64 = 0.02;
/// Longest and shortest wave under the finger, with gradient and bends, in mm: what the sensor promises.
const LONGEST_MM: f64 = 8.0;
const SHORTEST_MM: f64 = 0.6;

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
    /// Wavelength above which it is white and below which it falls by 6 dB an octave and pole, in mm.
    pub corner_mm: f64,
    /// See `corner_mm`: up to [`POLES`].
    pub poles: usize,
    /// Above this it falls again, in mm.
    pub longest_mm: f64,
}

/// Most poles of a random part.
pub const POLES: usize = 4;

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
    /// What it is bent or warped by: long waves.
    pub form: Option<Texture>,
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

impl Texture {
    fn lay(&self, points: usize, dice: &mut Dice) -> Vec<f32> {
        let keep = libm::exp(-TAU * GRID_MM / self.corner_mm);
        let slow = libm::exp(-TAU * GRID_MM / self.longest_mm);
        let (mut stages, mut level) = ([0.0; POLES], 0.0);
        run_in(points, self.longest_mm, || {
            let mut fine = dice.gaussian();
            for stage in &mut stages[..self.poles] {
                *stage = keep * *stage + (1.0 - keep) * fine;
                fine = *stage;
            }
            level = slow * level + (1.0 - slow) * fine;
            fine - level
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

    /// The partials of its wave, if it has one and no other, as the contact lets them through.
    pub fn partials(&self) -> Option<Partials> {
        match &self.first {
            Specimen::Ridged(ridges) if self.second.is_none() => {
                ridges.partials(self.contact_sigma_mm())
            }
            _ => None,
        }
    }

    fn contact_sigma_mm(&self) -> f64 {
        self.contact_mm / libm::sqrt(8.0 * std::f64::consts::LN_2)
    }

    /// Lays the ground from one place to another, in mm, for as many gauges. Heights have the RMS 1 of the
    /// first specimen's own signal, a random part comes on top.
    pub fn lay(&self, from_mm: f64, to_mm: f64, gauges: usize, dice: &mut Dice) -> Profile {
        let points = libm::ceil((to_mm - from_mm) / GRID_MM) as usize + 2;
        let sigma_mm = self.contact_sigma_mm();
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
        let mut heights = vec![signal];
        for texture in [&self.texture, &self.form].into_iter().flatten() {
            let mut layer = |rms: f64| {
                let mut heights = texture.lay(points, dice);
                blur(&mut heights, sigma_mm);
                normalise(&mut heights, rms);
                heights
            };
            let common = layer(texture.share * libm::sqrt(texture.common));
            heights = (0..gauges)
                .map(|gauge| {
                    let own = layer(texture.share * libm::sqrt(1.0 - texture.common));
                    let below = &heights[gauge.min(heights.len() - 1)];
                    (below.iter().zip(&common).zip(own))
                        .map(|((below, common), own)| below + common + own)
                        .collect()
                })
                .collect();
        }
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
