//! What is rubbed: waves with partials, with and without a grain, as heights over x.

use std::f64::consts::TAU;
use std::sync::Arc;

use hil_sim_core::scene::{Irregularity, Profile, Series, Specimen, Surface};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// The λ that the pairs share, in mm.
const WAVELENGTH_MM: f64 = 2.0;
/// Half of what there is of a surface, and its rows, in mm.
const REACH_MM: f64 = 70.0;
const ROW_MM: f64 = 0.02;
/// Partials that a wave may have.
const PARTIALS: usize = 6;
/// Sines in a grain.
const GRAINS: usize = 120;
/// Unseen surfaces of each kind.
const UNSEEN: u64 = 6;

#[derive(Clone, Debug)]
pub struct Ground {
    pub name: String,
    pub family: &'static str,
    /// Drawn by dice whose seeds nobody chose by what came of them.
    pub unseen: bool,
    pub wavelength_mm: f64,
    /// Amplitude and phase in rad of each partial, from the fundamental on.
    partials: [(f64, f64); PARTIALS],
    /// RMS of the grain, the fundamental's amplitude being 1; flat in octaves from 0.25 to 2 waves a mm.
    grain: f64,
    seed: u64,
}

impl Ground {
    fn new(name: &str, family: &'static str, partials: &[(f64, f64)], grain: f64) -> Self {
        let mut all = [(0.0, 0.0); PARTIALS];
        all[..partials.len()].copy_from_slice(partials);
        Self {
            name: name.to_owned(),
            family,
            unseen: false,
            wavelength_mm: WAVELENGTH_MM,
            partials: all,
            grain,
            seed: 7,
        }
    }

    /// As a scene has it: measured heights over x.
    pub fn surface(&self) -> Surface {
        let mut draws = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let grains = [(); GRAINS].map(|()| {
            let per_mm = 0.25 * 2_f64.powf(3.0 * draws.random::<f64>());
            (TAU * per_mm, TAU * draws.random::<f64>())
        });
        let amplitude = self.grain * (2.0 / GRAINS as f64).sqrt();
        let height = |x_mm: f64| {
            let theta = TAU * x_mm / self.wavelength_mm;
            let waves = (1..)
                .zip(&self.partials)
                .map(|(n, (amplitude, ahead))| amplitude * (f64::from(n) * theta + ahead).sin());
            let grain = grains
                .iter()
                .map(|(wavenumber, phase)| (wavenumber * x_mm + phase).sin());
            waves.sum::<f64>() + amplitude * grain.sum::<f64>()
        };
        let rows = (2.0 * REACH_MM / ROW_MM) as usize;
        let at = (0..=rows).map(|row| row as f64 * ROW_MM - REACH_MM);
        let at: Vec<f64> = at.collect();
        let values = at.iter().map(|&x_mm| height(x_mm)).collect();
        Surface {
            specimens: vec![Specimen {
                wavelength_mm: self.wavelength_mm,
                length_mm: f64::INFINITY,
            }],
            start_mm: 0.0,
            profile: Profile::Recorded(Arc::new(Series {
                at,
                values,
                width: 1,
            })),
            irregularity: Irregularity::NONE,
        }
    }
}

/// Ridges that take a share of λ: the partials of a rectangle, over the fundamental's.
fn ridges(share: f64) -> [(f64, f64); PARTIALS] {
    let amplitude = |n: f64| (std::f64::consts::PI * n * share).sin() / n;
    std::array::from_fn(|n| {
        let n = (n + 1) as f64;
        // Cosines about a ridge's middle.
        (amplitude(n) / amplitude(1.0), 0.25 * TAU)
    })
}

pub fn sine(grain: f64) -> Ground {
    let (name, family) = if grain > 0.0 {
        ("rough sine", "rough")
    } else {
        ("sine", "sine")
    };
    Ground::new(name, family, &[(1.0, 0.0)], grain)
}

/// A grating whose ridges are as wide as its grooves, and one with narrow ridges.
pub fn gratings() -> [Ground; 2] {
    [("grating", 0.5), ("narrow ridges", 0.25)]
        .map(|(name, share)| Ground::new(name, "grating", &ridges(share), 0.0))
}

/// A weave: λ/2 and λ/3 nearly as strong as λ.
pub fn weave(grain: f64) -> Ground {
    let (name, family) = if grain > 0.0 {
        ("rough weave", "rough")
    } else {
        ("weave", "weave")
    };
    let partials = [(1.0, 0.0), (0.7, 2.1), (0.5, 4.0)];
    Ground::new(name, family, &partials, grain)
}

/// The surfaces that this was made with.
pub fn known() -> Vec<Ground> {
    let [even, narrow] = gratings();
    vec![sine(0.0), even, narrow, weave(0.0), sine(0.35), weave(0.35)]
}

/// Surfaces drawn by dice: λ, partials up to the fourth, and in half of them a grain.
pub fn unseen() -> Vec<Ground> {
    let of = |rough: bool| {
        (0..UNSEEN).map(move |number| {
            let mut draws =
                Xoshiro256PlusPlus::seed_from_u64(0x7e87 + 1_000 * u64::from(rough) + number);
            let mut between = |low: f64, high: f64| low + (high - low) * draws.random::<f64>();
            let wavelength_mm = 1.2 * (3.2_f64 / 1.2).powf(between(0.0, 1.0));
            let mut partials = [(0.0, 0.0); PARTIALS];
            partials[0] = (1.0, 0.0);
            for (partial, most) in partials[1..4].iter_mut().zip([0.9, 0.7, 0.3]) {
                *partial = (between(0.0, most), between(0.0, TAU));
            }
            let grain = if rough { between(0.15, 0.5) } else { 0.0 };
            let family = if rough { "unseen, rough" } else { "unseen" };
            Ground {
                name: format!("{family} {}", number + 1),
                family,
                unseen: true,
                wavelength_mm,
                partials,
                grain,
                seed: number,
            }
        })
    };
    of(false).chain(of(true)).collect()
}
