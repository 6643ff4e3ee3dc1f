//! The default estimator: a bank of wavenumbers over the arm's travel.
//!
//! Position, not time, is the independent variable, so a change of speed or direction changes nothing.
//! To each of a few log-spaced wavelengths a sine of that period *and a constant* are fitted to each
//! gauge by least squares over the latest travel, and the wavelength that explains most of the gauges'
//! energy is λ̂: a Lomb–Scargle periodogram with floating mean (Zechmeister and Kürster 2009), kept up
//! recursively. The constant takes the gauge's offset and drift, so there is no high-pass whose phase
//! would depend on speed; the fit's own matrix takes what a part of a cycle leaves, so a stroke that
//! turns round within a cycle or two does no harm.
//!
//! A sample weighs as the travel it stands for, and loses weight with the travel since, through two
//! cascaded first-order low-passes whose constant is a = q λ of travel: the kernel is s·exp(−s/a)/a². A
//! pure sine of wavenumber k then leaves P(λᵢ) = P₀ / (1 + (2πq)²(kλᵢ − 1)²)² at the candidate λᵢ. So
//! P^(−1/2) is a parabola in λᵢ, and the vertex through the three candidates around the peak is 1/k,
//! without the bias that a parabola through log P has.
//!
//! The estimator stands by λ̂ only if the fit explains what the gauges say: see [`Bank::find`].

use protocol::{GAUGES, SensorConfiguration};

use crate::SAMPLE_RATE_HZ;
use crate::estimator::{Estimator, Finding, PLACES_PER_UM, Touch};
use crate::travel::Travel;

use candidate::{BLOCK, Candidate, Fit, Kernel, Rest, Weighed, gauges_of};
use jerk::{
    Jerk, SECOND_DIFFERENCE_NOISE_GAIN, SECOND_DIFFERENCE_WHITE_GAIN, STEADY_DOUBT,
    second_difference_gain,
};
use play::Play;

mod candidate;
mod jerk;
mod play;
#[cfg(test)]
mod tests;

/// The most candidates that a configuration can ask for.
pub const MAX_CANDIDATES: usize = 24;
/// The shortest and the longest candidate in mm: λ̂ lies between, and a peak at either end is none.
pub const SHORTEST_MM: f32 = 0.65;
/// See [`SHORTEST_MM`].
pub const LONGEST_MM: f32 = 6.5;

/// Half the width, in µm, of the play that a movement must overcome to count as travel: two counts of
/// the encoder, so that one that dithers between counts does not wash out what was felt. The force
/// channel's noise, some 5 µm, needs a little more.
const PLAY_UM: i32 = 10;
/// See [`PLAY_UM`].
const PLAY_WITH_FORCE_UM: i32 = 12;

/// A wavelength is not stood by if the gauges hold more than this share of what it explains that
/// neither it nor white noise does. A trapezoid's harmonics are up to 0.17, a second harmonic of half
/// the amplitude 0.35 (the surface's period is still λ); a fingertip that sticks and slips over several
/// ridges, two specimens under one fingertip and hum are beyond.
const MOST_UNEXPLAINED: f32 = 0.45;
/// The same right after a change of surface, when the kernel still holds some of what was before.
const MOST_UNEXPLAINED_AFTER_CHANGE: f32 = 0.7;
/// What the noise may add to it, relative to noise over signal: both are measured over finite times.
const UNEXPLAINED_PER_NOISE: f32 = 0.2;
/// Share of the kernel that must have been filled since the start.
const LEAST_FILLED: f32 = 0.8;
/// Least determinant of the fit's matrix, 1 where constant, cosine and sine are told apart as well as
/// they can be: it falls when the latest travel covers less than a wavelength.
const LEAST_DETERMINED: f32 = 0.88;
/// A peak must stand this far above what white noise alone leaves at a candidate, in power.
const LEAST_OVER_NOISE: f32 = 8.0;
/// λ̂ over the shorter kernel may differ by this share at most.
const MOST_DISAGREEMENT: f32 = 0.1;
/// Least amplitude in ADC steps; ten times what the ADC's rounding alone leaves.
const LEAST_AMPLITUDE_LSB: f32 = 1.0;
/// Power at high frequencies that is not stood by without a force channel, relative to the
/// fundamental's: see [`Bank::jerky`].
const MOST_JERK: f32 = 0.02;
/// What the noise may add to it.
const JERK_PER_NOISE: f32 = 0.5;
/// What is kept of the highest speed from one estimate to the next, e^(−10 / 300): as long as the jerk is.
const SPEED_KEPT: f32 = 0.967;
/// Speed that the kernel's number of samples is reckoned with at least, in mm/s.
const SLOWEST_MM_S: f32 = 2.0;
/// Samples without travel after which nothing is stood by any more.
const REST_SAMPLES: u32 = SAMPLE_RATE_HZ / 2;
/// A wavelength that differs by less from what was felt before is no change of surface.
const LEAST_CHANGE: f32 = 0.25;
/// Estimates after a valid one for which a change of surface may be told from the shorter kernel.
const CHANGE_ESTIMATES: u8 = 30;

/// The estimator.
#[derive(Clone, Debug)]
pub struct Bank {
    candidates: [Candidate; MAX_CANDIDATES],
    count: usize,
    travel_wavelengths: f32,
    force_channel: bool,
    play: Play,
    block: [Weighed; BLOCK],
    filled: usize,
    touch: Touch,
    jerk: Jerk,
    rested: u32,
    /// Speed in mm/s, falling no faster than the jerk is forgotten.
    speed_mm_s: f32,
    /// Estimates since the last one that was stood by over the long kernel, and its wavelength.
    since_valid: u8,
    known_mm: f32,
}

/// What a candidate's fit says of the gauges, the usable ones unless said.
#[derive(Clone, Copy, Debug, Default)]
struct Agreement {
    /// Bit g set: the wave explains gauge g.
    fitting: u8,
    /// Bit g set: the wave explains less than half of gauge g, noise left out. Also of one that is not
    /// usable: it is not taken back as long as it does not fit.
    misfits: u8,
    /// The wave explains the gauges as a whole.
    whole: bool,
    /// Energy that it explains, all gauges together, what neither it nor noise does, and the noise.
    explained: f32,
    unexplained: f32,
    noise: f32,
}

impl Bank {
    /// An empty bank, as `configuration` wants it; that must have passed its check.
    pub fn new(configuration: &SensorConfiguration) -> Self {
        let count = usize::from(configuration.bank_candidates).clamp(3, MAX_CANDIDATES);
        let travel_wavelengths = f32::from(configuration.bank_travel_percent) / 100.0;
        let ratio = libm::powf(LONGEST_MM / SHORTEST_MM, 1.0 / (count - 1) as f32);
        let mut wavelength_mm = SHORTEST_MM;
        let candidates = core::array::from_fn(|_| {
            let candidate = Candidate::new(wavelength_mm, travel_wavelengths);
            wavelength_mm *= ratio;
            candidate
        });
        let play_um = if configuration.force_channel {
            PLAY_WITH_FORCE_UM
        } else {
            PLAY_UM
        };
        Self {
            candidates,
            count,
            travel_wavelengths,
            force_channel: configuration.force_channel,
            play: Play::new(play_um * PLACES_PER_UM),
            block: [Weighed::default(); BLOCK],
            filled: 0,
            touch: Touch::default(),
            jerk: Jerk::default(),
            rested: 0,
            speed_mm_s: 0.0,
            since_valid: u8::MAX,
            known_mm: 0.0,
        }
    }

    fn candidates(&self) -> &[Candidate] {
        &self.candidates[..self.count]
    }

    /// Energy in `gauges` that each candidate explains, and the largest one's number.
    fn spectrum(&self, kernel: Kernel, gauges: u8) -> ([f32; MAX_CANDIDATES], usize) {
        let mut energies = [0.0; MAX_CANDIDATES];
        let mut largest = 0;
        for (number, candidate) in self.candidates().iter().enumerate() {
            energies[number] = candidate.energy(kernel, gauges);
            if energies[number] > energies[largest] {
                largest = number;
            }
        }
        (energies, largest)
    }

    /// The wavelength at the peak around candidate `number`, in mm: none at the bank's ends, and none if
    /// there is no peak between the neighbours.
    fn vertex(&self, kernel: Kernel, number: usize) -> Option<f32> {
        let around = number.checked_sub(1)?..=number + 1;
        if *around.end() >= self.count {
            return None;
        }
        let [x0, x1, x2] =
            [number - 1, number, number + 1].map(|i| self.candidates[i].wavelength_mm);
        let [y0, y1, y2] = [number - 1, number, number + 1].map(|i| {
            let power = self.candidates[i]
                .power(kernel, self.touch.usable)
                .max(f32::MIN_POSITIVE);
            match kernel {
                Kernel::Short => 1.0 / power,
                Kernel::Long => 1.0 / libm::sqrtf(power),
            }
        });
        let rise = (y1 - y0) / (x1 - x0);
        let curvature = ((y2 - y1) / (x2 - x1) - rise) / (x2 - x0);
        let vertex = 0.5 * (x0 + x1 - rise / curvature);
        (curvature > 0.0 && vertex > x0 && vertex < x2).then_some(vertex)
    }

    /// How candidate `number` fits each of the usable gauges.
    fn agreement(&self, kernel: Kernel, number: usize) -> Agreement {
        let sums = self.candidates[number].sums(kernel);
        let Some(fit) = Fit::of(sums) else {
            return Agreement::default();
        };
        let most = match kernel {
            Kernel::Short => MOST_UNEXPLAINED_AFTER_CHANGE,
            Kernel::Long => MOST_UNEXPLAINED,
        };
        let fits = |explained: f32, unexplained: f32, noise: f32| {
            unexplained <= most * explained + UNEXPLAINED_PER_NOISE * noise
        };
        let more_noise = self.noise_below_1_khz();
        let mut agreement = Agreement::default();
        for gauge in 0..GAUGES {
            let usable = self.touch.usable >> gauge & 1 == 1;
            let explained = fit.energy(sums, gauge);
            let noise = self.touch.noise[gauge] + more_noise;
            let unexplained = fit.variance(sums, gauge) - explained - noise;
            let fits = fits(explained, unexplained, noise);
            if !fits && unexplained > explained {
                agreement.misfits |= 1 << gauge;
            }
            if !usable {
                continue;
            }
            if fits {
                agreement.fitting |= 1 << gauge;
            }
            agreement.explained += explained;
            agreement.unexplained += unexplained;
            agreement.noise += noise;
        }
        agreement.whole = fits(agreement.explained, agreement.unexplained, agreement.noise);
        agreement
    }

    /// Variance of noise in each usable gauge beyond [`Touch::noise`], in ADC steps²: a recording of few
    /// rows has none above 1 kHz, where that is looked for.
    fn noise_below_1_khz(&self) -> f32 {
        let usable = self.touch.usable.count_ones();
        let steady = self.jerk.steady(usable) / SECOND_DIFFERENCE_WHITE_GAIN;
        let known: f32 = gauges_of(self.touch.usable)
            .map(|gauge| self.touch.noise[gauge])
            .sum();
        (steady - known).max(0.0) / usable.max(1) as f32
    }

    /// Whether the gauges hold more power at high frequencies than a wave with sharp edges would make at
    /// this speed: a fingertip that sticks and slips is fast while it slips, whatever the arm does.
    fn jerky(&self, wavelength_mm: f32, agreement: &Agreement) -> bool {
        let frequency_hz = self.speed_mm_s / wavelength_mm;
        let smooth = second_difference_gain(frequency_hz)
            + second_difference_gain(2.0 * frequency_hz) / 10.0
            + second_difference_gain(3.0 * frequency_hz) / 9.0
            + second_difference_gain(5.0 * frequency_hz) / 25.0;
        let steady = self.jerk.steady(self.touch.usable.count_ones());
        let quiet = STEADY_DOUBT * steady;
        let power = self.jerk.power - quiet.max(SECOND_DIFFERENCE_NOISE_GAIN * agreement.noise);
        power > (smooth + MOST_JERK) * agreement.explained + JERK_PER_NOISE * agreement.noise
    }

    /// The wavelength that explains most over one of the kernels, and whether it can be stood by.
    fn look(&self, kernel: Kernel) -> Look {
        let (energies, number) = self.spectrum(kernel, self.touch.usable);
        let agreement = self.agreement(kernel, number);
        let vertex = self.vertex(kernel, number);
        let wavelength_mm = vertex.unwrap_or(self.candidates[number].wavelength_mm);
        // What was felt before a change of surface is no sign of stick and slip after it.
        let jerky =
            kernel == Kernel::Long && !self.force_channel && self.jerky(wavelength_mm, &agreement);
        let stands =
            vertex.is_some() && !jerky && self.stands(kernel, number, wavelength_mm, &agreement);
        let whole = agreement.whole || kernel == Kernel::Short;
        let others = self.touch.usable & !agreement.misfits;
        Look {
            number,
            wavelength_mm: (energies[number] > 0.0).then_some(wavelength_mm),
            amplitude_lsb: self.amplitude_lsb(&agreement)
                * self.detuned(kernel, number, wavelength_mm),
            jerky,
            stands: stands && whole,
            odd_one_out: stands
                && !whole
                && agreement.misfits.is_power_of_two()
                && agreement.fitting == others,
            agreement,
        }
    }

    /// Amplitude of a sine of `wavelength_mm`, relative to what candidate `number` shows of it.
    fn detuned(&self, kernel: Kernel, number: usize, wavelength_mm: f32) -> f32 {
        let off = self.candidates[number].wavelength_mm / wavelength_mm - 1.0;
        let radians = 2.0 * core::f32::consts::PI * self.travel_wavelengths * off;
        let square = 1.0 + radians * radians;
        match kernel {
            Kernel::Short => libm::sqrtf(square),
            Kernel::Long => square,
        }
    }

    fn finding(&self, look: &Look, valid: bool) -> Finding {
        Finding {
            wavelength_mm: look.wavelength_mm,
            valid,
            confidence: look.agreement.confidence(),
            amplitude_lsb: look.amplitude_lsb,
            gauges_used: self.touch.usable,
            misfits: if valid { look.agreement.misfits } else { 0 },
            jerky: look.jerky,
        }
    }

    /// Amplitude of the wave, RMS over the usable gauges.
    fn amplitude_lsb(&self, agreement: &Agreement) -> f32 {
        let usable = self.touch.usable.count_ones().max(1) as f32;
        libm::sqrtf(2.0 * agreement.explained / usable)
    }

    fn stands(
        &self,
        kernel: Kernel,
        number: usize,
        wavelength_mm: f32,
        agreement: &Agreement,
    ) -> bool {
        let usable = self.touch.usable.count_ones();
        let fitting = agreement.fitting.count_ones();
        let candidate = &self.candidates[number];
        let Some(fit) = Fit::of(candidate.sums(kernel)) else {
            return false;
        };
        // The kernel's equivalent number of samples, (∫w)²/∫w².
        let kernel_mm = match kernel {
            Kernel::Short => 2.0,
            Kernel::Long => 4.0,
        } * self.travel_wavelengths
            * wavelength_mm;
        let per_sample_mm = self.speed_mm_s.max(SLOWEST_MM_S) / SAMPLE_RATE_HZ as f32;
        let noise = 2.0 * agreement.noise * per_sample_mm / kernel_mm;
        let amplitude_lsb = self.amplitude_lsb(agreement);
        let frequency_hz = self.speed_mm_s / wavelength_mm;
        2 * fitting > usable
            && self.rested < REST_SAMPLES
            && fit.weight >= LEAST_FILLED
            && fit.determined() >= LEAST_DETERMINED
            && agreement.explained >= LEAST_OVER_NOISE * noise
            && amplitude_lsb >= LEAST_AMPLITUDE_LSB
            && !self.touch.pickup.hides(amplitude_lsb, frequency_hz)
    }
}

/// What the bank sees over one kernel.
struct Look {
    number: usize,
    wavelength_mm: Option<f32>,
    agreement: Agreement,
    amplitude_lsb: f32,
    stands: bool,
    /// It would, were it not for one gauge that says something else than all others.
    odd_one_out: bool,
    jerky: bool,
}

impl Estimator for Bank {
    fn push(&mut self, touch: &Touch) {
        let travel = self.play.follow(touch.place);
        self.rested = if travel == 0 {
            self.rested.saturating_add(1)
        } else {
            0
        };
        self.jerk.push(touch);
        self.touch = *touch;
        let weight = travel.unsigned_abs() as f32;
        self.block[self.filled] = Weighed {
            place: touch.place,
            weight,
            gauges: touch.gauges,
        };
        self.filled += 1;
        if self.filled == BLOCK {
            self.filled = 0;
            let travel = self.block.iter().map(|weighed| weighed.weight).sum();
            if travel > 0.0 {
                let rest = Rest::of(&self.block);
                for candidate in &mut self.candidates[..self.count] {
                    candidate.take_up(&self.block, &rest, travel);
                }
            }
        }
    }

    /// Stands by λ̂ if more than half of the usable gauges are explained by it, noise left out, over the
    /// long kernel; if both kernels agree on it; if the latest travel covers enough of a wave; if the
    /// peak stands out of the noise; if hum has been told from signal; and if, without a force channel,
    /// nothing hints at stick and slip. For a while after the surface has changed, the short kernel may
    /// speak for another wavelength.
    fn find(&mut self, travel: &Travel) -> Finding {
        let speed_mm_s = travel.velocity_mm_s(0).abs();
        self.speed_mm_s = speed_mm_s.max(self.speed_mm_s * SPEED_KEPT);
        self.since_valid = self.since_valid.saturating_add(1);

        let long = self.look(Kernel::Long);
        let short_mm = self.vertex(Kernel::Short, long.number);
        let agree = long
            .wavelength_mm
            .zip(short_mm)
            .is_some_and(|(long, short)| (short / long - 1.0).abs() < MOST_DISAGREEMENT);
        if long.odd_one_out && agree {
            return Finding {
                misfits: long.agreement.misfits,
                ..self.finding(&long, false)
            };
        }
        if long.stands && agree {
            self.since_valid = 0;
            self.known_mm = long.wavelength_mm.unwrap_or(0.0);
            return self.finding(&long, true);
        }
        if self.since_valid <= CHANGE_ESTIMATES {
            let short = self.look(Kernel::Short);
            let changed = short.wavelength_mm.is_some_and(|wavelength_mm| {
                (wavelength_mm / self.known_mm - 1.0).abs() > LEAST_CHANGE
            });
            if short.stands && changed {
                self.jerk = Jerk::default();
                return self.finding(&short, true);
            }
        }
        self.finding(&long, false)
    }
}

impl Agreement {
    /// Share of the gauges' energy, noise left out, that the wave explains.
    fn confidence(&self) -> f32 {
        let signal = self.explained + self.unexplained.max(0.0);
        if signal > 0.0 {
            self.explained / signal
        } else {
            0.0
        }
    }
}
