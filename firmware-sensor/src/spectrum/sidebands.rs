//! The lines that a hopping fingertip makes of one wave, and which of them is the wave.
//!
//! A fingertip that sticks and slips goes to and fro by the arm, and with it the phase of what all gauges feel: beside
//! the wave's line there are sidebands, and one of them may be the strongest. Two things tell them.
//!
//! - All gauges hop alike. So a sideband has the wave's phases from gauge to gauge, or their negatives where it lies
//!   below zero. Another wave of the surface has other phases, unless the gauges lie at the same place.
//! - The mean frequency of a spectrum is the mean rate of the phase (Cohen 1989), and the fingertip is on average as fast as
//!   the arm: the wave lies in the sidebands' centre of gravity, those below zero with their sign. Those that are longer or
//!   shorter than all candidates are missing there, so the centre is known roughly.

use super::periodogram::{CANDIDATES, Periodogram, Phasors, Spectrum, is_peak, wavelength_mm};
use crate::float::{larger, smaller};

/// A line beside which another one has this share of its energy may be a sideband.
const RIVAL: f32 = 0.6;
/// Lines so much lower than this one move the centre too little to count.
const LEAST: f32 = 0.1;
/// Likeness from which on two lines are one wave's, and up to which their phases tell forwards from backwards: gauges at
/// the same place do not.
const ALIKE: f32 = 0.9;
/// See [`ALIKE`].
const UNLIKE: f32 = 0.6;
/// A line must be nearer to the centre by this to take another's place.
const NEARER: f32 = 0.6;
/// A line of less than this, in cycles per mm, is longer than the candidates, or hardly told among them.
const HIDDEN_PER_MM: f32 = 0.14;
/// Candidates up to which a peak's flank reaches.
const FLANK: usize = 2;

/// A line: its candidate, its wavenumber in cycles per mm, which is negative below zero, and its energy.
#[derive(Clone, Copy, Default)]
struct Line {
    number: usize,
    per_mm: f32,
    energy: f32,
}

/// The wave's line, if the peak at candidate `number` of the averaged spectrum may be a sideband of it; else `number`.
#[inline(never)]
pub(super) fn wave_of(
    periodogram: &Periodogram,
    averaged: &Spectrum,
    number: usize,
    usable: u8,
) -> usize {
    let own = averaged[number];
    let others = |share: f32| {
        (1..CANDIDATES - 1)
            .filter(move |&other| averaged[other] > share * own)
            .filter(move |&other| other.abs_diff(number) > FLANK && is_peak(averaged, other))
    };
    if others(RIVAL).next().is_none() {
        return number;
    }
    let line = |number: usize, sign: f32| Line {
        number,
        per_mm: sign / wavelength_mm(number),
        energy: averaged[number],
    };
    // Peaks are seldom next to each other, and few are so high.
    let mut lines = [Line::default(); CANDIDATES / 2];
    lines[0] = line(number, 1.0);
    let mut count = 1;
    for other in others(LEAST) {
        let sign = sign(
            periodogram.phasors(number),
            periodogram.phasors(other),
            usable,
        );
        if let Some(free) = lines.get_mut(count).filter(|_| sign != 0.0) {
            *free = line(other, sign);
            count += 1;
        }
    }
    let lines = &lines[..count];
    let mut wave = number;
    let mut nearest = NEARER * off_centre(lines, lines[0].per_mm);
    for line in &lines[1..] {
        let distance = off_centre(lines, line.per_mm);
        if distance < nearest {
            (wave, nearest) = (line.number, distance);
        }
    }
    wave
}

/// How far from their centre a line would be if it were the wave, in cycles per mm. Sidebands lie to both sides of it,
/// nearly alike; where one would be hidden at long waves, it is taken to be there.
fn off_centre(lines: &[Line], wave_per_mm: f32) -> f32 {
    let is_hidden = |per_mm: f32| per_mm.abs() < HIDDEN_PER_MM;
    let none_seen = !lines.iter().any(|line| is_hidden(line.per_mm));
    let (mut sum, mut total) = (0.0, 0.0);
    for line in lines {
        sum += line.energy * line.per_mm;
        total += line.energy;
        if none_seen && is_hidden(2.0 * wave_per_mm - line.per_mm) {
            total += line.energy;
        }
    }
    (sum / total - wave_per_mm).abs()
}

/// Whether a line has the same phases from gauge to gauge as another, 1, or their negatives, −1; 0 if it has others, or
/// if they are too alike to tell.
fn sign(one: &Phasors, other: &Phasors, usable: u8) -> f32 {
    let (mut same, mut negative) = ([0.0; 2], [0.0; 2]);
    let (mut power, mut other_power) = (0.0, 0.0);
    for (gauge, ([re, im], [other_re, other_im])) in one.iter().zip(other).enumerate() {
        if usable >> gauge & 1 == 0 {
            continue;
        }
        same[0] += re * other_re + im * other_im;
        same[1] += im * other_re - re * other_im;
        negative[0] += re * other_re - im * other_im;
        negative[1] += im * other_re + re * other_im;
        power += re * re + im * im;
        other_power += other_re * other_re + other_im * other_im;
    }
    let whole = power * other_power;
    let [same, negative] = [same, negative].map(|[re, im]| re * re + im * im);
    let tells = larger(same, negative) > ALIKE * whole && smaller(same, negative) < UNLIKE * whole;
    match (tells, same > negative) {
        (false, _) => 0.0,
        (true, true) => 1.0,
        (true, false) => -1.0,
    }
}

#[cfg(test)]
mod tests {
    use core::f32::consts::TAU;

    use protocol::GAUGES;

    use super::*;

    const ALL: u8 = 0b1_1111;

    /// Phases in turns, each gauge of its own amplitude.
    fn phasors(turns: [f32; GAUGES]) -> Phasors {
        let mut amplitude = 100.0;
        turns.map(|turns| {
            amplitude += 20.0;
            [
                amplitude * libm::cosf(TAU * turns),
                amplitude * libm::sinf(TAU * turns),
            ]
        })
    }

    #[test]
    fn phases_from_gauge_to_gauge_tell_forwards_from_backwards_and_from_another_wave() {
        let turns = [0.0, 0.3, 0.45, 0.8, 0.15];
        let one = phasors(turns);
        assert_eq!(sign(&one, &phasors(turns.map(|turn| turn + 0.2)), ALL), 1.0);
        assert_eq!(
            sign(&one, &phasors(turns.map(|turn| 0.2 - turn)), ALL),
            -1.0
        );
        let longer = phasors(turns.map(|turn| 0.6 * turn));
        assert_eq!(sign(&one, &longer, ALL), 0.0);
        // Of what is not usable nothing counts, and of gauges that are in phase none tells.
        let mut broken = one;
        broken[3] = [-1e4, 1e4];
        assert_eq!(sign(&one, &broken, ALL), 0.0);
        assert_eq!(sign(&one, &broken, ALL & !(1 << 3)), 1.0);
        let alike = phasors([0.1; GAUGES]);
        assert_eq!(sign(&alike, &alike, ALL), 0.0);
        assert_eq!(sign(&[[0.0; 2]; GAUGES], &one, ALL), 0.0);
    }
}
