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
use crate::estimator::{Estimator, Finding, PLACES_PER_MM, PLACES_PER_UM, Place, Touch};
use crate::phasor::phasor;
use crate::travel::Travel;

/// The most candidates that a configuration can ask for.
pub const MAX_CANDIDATES: usize = 24;
/// The shortest and the longest candidate in mm: λ̂ lies between, and a peak at either end is none.
pub const SHORTEST_MM: f32 = 0.65;
/// See [`SHORTEST_MM`].
pub const LONGEST_MM: f32 = 6.5;

/// Touches that are taken up together: half the work, for a kernel in steps of 2 ms of travel.
const BLOCK: usize = 2;
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
/// Gain in power of the second difference for white noise behind the anti-aliasing filter.
const SECOND_DIFFERENCE_NOISE_GAIN: f32 = 4.85;
/// The same for noise that is white up to 500 Hz, as in a recording of one row a millisecond.
const SECOND_DIFFERENCE_WHITE_GAIN: f32 = 6.0;
/// Share of the samples that are the quiet ones, the step that their bound is followed in, and its least,
/// relative to the mean.
const QUIET_SHARE: f32 = 0.1;
/// See [`QUIET_SHARE`].
const QUIET_STEP: f32 = 0.02;
/// See [`QUIET_SHARE`].
const QUIET_LEAST: f32 = 1e-3;
/// How much more than from its quiet moments steady noise may have, which are known to a fifth or so.
const STEADY_DOUBT: f32 = 1.2;
/// The tenth percentile of χ² over its mean, with one to five degrees of freedom: white noise's quiet
/// bound, by the number of gauges.
const QUIET_OF_MEAN: [f32; GAUGES] = [0.0158, 0.1054, 0.1948, 0.2659, 0.3221];
/// Time constant of the high-frequency power, in samples.
const JERK_SAMPLES: f32 = 300.0;
/// What is kept of the highest speed from one estimate to the next, e^(−10 / 300): as long as the jerk is.
const SPEED_KEPT: f32 = 0.967;
/// Speed that the kernel's number of samples is reckoned with at least, in mm/s.
const SLOWEST_MM_S: f32 = 2.0;
/// Weight below which nothing is fitted, and determinant relative to its square.
const LEAST_WEIGHT: f32 = 1e-3;
const LEAST_SOLVABLE: f32 = 0.02;
/// Samples without travel after which nothing is stood by any more.
const REST_SAMPLES: u32 = SAMPLE_RATE_HZ / 2;
/// A wavelength that differs by less from what was felt before is no change of surface.
const LEAST_CHANGE: f32 = 0.25;
/// Estimates after a valid one for which a change of surface may be told from the shorter kernel.
const CHANGE_ESTIMATES: u8 = 30;

/// What a candidate sums up over its kernel, of weights w, gauge samples s and phases θ = 2πx/λ. In this
/// order: Re and Im of Σ w s exp(−jθ) for each gauge; Σ w s for each; Σ w s² for each; Re and Im of
/// Σ w exp(−jθ); Re and Im of Σ w exp(−2jθ); Σ w.
const SUMS: usize = 4 * GAUGES + 5;
const MEAN: usize = 2 * GAUGES;
const SQUARE: usize = 3 * GAUGES;
const FIRST: usize = 4 * GAUGES;
const SECOND: usize = FIRST + 2;
const WEIGHT: usize = FIRST + 4;
type Sums = [f32; SUMS];

/// The two kernels of a candidate, by the low-pass they are taken behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kernel {
    /// Behind the first: exp(−s/a)/a. Forgets sooner, tells wavelengths apart less.
    Short,
    /// Behind both: s·exp(−s/a)/a².
    Long,
}

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

/// A wavelength and what it has summed up.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    wavelength_mm: f32,
    /// Phase of a place unit in 2⁻³² cycles: times a wrapping place it gives a wrapping phase, exact for
    /// any travel.
    increment: u32,
    /// 1/a, in 1/places.
    per_place: f32,
    short: Sums,
    long: Sums,
}

/// A touch and its weight.
#[derive(Clone, Copy, Debug, Default)]
struct Weighed {
    place: Place,
    weight: f32,
    gauges: [f32; GAUGES],
}

/// A follower with play: moves only once the place has moved more than the play's half width.
#[derive(Clone, Copy, Debug)]
struct Play {
    at: Option<Place>,
    half: i32,
}

/// The power of the second difference in time, which high frequencies dominate.
#[derive(Clone, Copy, Debug, Default)]
struct Jerk {
    before: [[f32; GAUGES]; 2],
    power: f32,
    /// The power that a tenth of the samples are below.
    quiet: f32,
    samples: u32,
}

/// The matrix of a candidate's fit, common to all gauges.
struct Fit {
    weight: f32,
    first: [f32; 2],
    p: f32,
    r: [f32; 2],
    scale: f32,
    determinant: f32,
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
            play: Play {
                at: None,
                half: play_um * PLACES_PER_UM,
            },
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

impl Candidate {
    fn new(wavelength_mm: f32, travel_wavelengths: f32) -> Self {
        let places = wavelength_mm * PLACES_PER_MM as f32;
        Self {
            wavelength_mm,
            increment: (4_294_967_296.0 / f64::from(places)) as u32,
            per_place: 1.0 / (travel_wavelengths * places),
            short: [0.0; SUMS],
            long: [0.0; SUMS],
        }
    }

    fn sums(&self, kernel: Kernel) -> &Sums {
        match kernel {
            Kernel::Short => &self.short,
            Kernel::Long => &self.long,
        }
    }

    /// Energy in `gauges` that this wavelength explains, summed over them.
    fn energy(&self, kernel: Kernel, gauges: u8) -> f32 {
        let sums = self.sums(kernel);
        Fit::of(sums).map_or(0.0, |fit| {
            gauges_of(gauges).map(|gauge| fit.energy(sums, gauge)).sum()
        })
    }

    /// What the peak is found by: the geometric mean of the energy that the fit explains and of its
    /// amplitude squared, each summed over `gauges`. As the latest travel covers a little more or less
    /// than whole waves both ripple, in opposite ways; their mean does half as much.
    fn power(&self, kernel: Kernel, gauges: u8) -> f32 {
        let sums = self.sums(kernel);
        Fit::of(sums).map_or(0.0, |fit| {
            let (mut energy, mut squares) = (0.0, 0.0);
            for gauge in gauges_of(gauges) {
                energy += fit.energy(sums, gauge);
                squares += fit.amplitude_squared(sums, gauge);
            }
            libm::sqrtf(energy * squares)
        })
    }

    /// Takes up a block of `travel` places, above 0.
    #[inline]
    fn take_up(&mut self, block: &[Weighed; BLOCK], rest: &Rest, travel: f32) {
        let mut sums = [0.0; SUMS];
        for weighed in block {
            let [cos, sin] = phasor((weighed.place as u32).wrapping_mul(self.increment));
            let (re, im) = (weighed.weight * cos, -weighed.weight * sin);
            for (gauge, x) in weighed.gauges.iter().enumerate() {
                sums[2 * gauge] += re * x;
                sums[2 * gauge + 1] += im * x;
            }
            sums[FIRST] += re;
            sums[FIRST + 1] += im;
            sums[SECOND] += re * cos + im * sin;
            sums[SECOND + 1] += im * cos - re * sin;
        }
        sums[MEAN..FIRST].copy_from_slice(&rest.0);
        sums[WEIGHT] = travel;
        // exp(−z), to within 2 % for whatever z ≥ 0, and within z³/6 for the small ones.
        let z = travel * self.per_place;
        let keep = 1.0 / (1.0 + z * (1.0 + 0.5 * z));
        let take = 1.0 - keep;
        let scale = take / travel;
        for ((short, long), sum) in self.short.iter_mut().zip(&mut self.long).zip(sums) {
            *short = keep * *short + scale * sum;
            *long = keep * *long + take * *short;
        }
    }
}

/// The sums of a block that are the same for every candidate: Σ w s and Σ w s² of each gauge.
struct Rest([f32; 2 * GAUGES]);

impl Rest {
    fn of(block: &[Weighed; BLOCK]) -> Self {
        let mut sums = [0.0; 2 * GAUGES];
        for weighed in block {
            for (gauge, x) in weighed.gauges.iter().enumerate() {
                sums[gauge] += weighed.weight * x;
                sums[GAUGES + gauge] += weighed.weight * x * x;
            }
        }
        Self(sums)
    }
}

impl Fit {
    /// The normal equations with the constant eliminated: of S = Σ w s e^(−jθ), C, Q, W the sums in the
    /// order of [`SUMS`], D = Σ w s and the wave's complex amplitude A, s ≈ d + Re(A e^(jθ)):
    /// P A + R A* = 2 (S − D C / W) with P = W − |C|²/W and R = Q − C²/W. None if constant, cosine and
    /// sine can't be told apart at all.
    fn of(sums: &Sums) -> Option<Self> {
        let weight = sums[WEIGHT];
        if weight < LEAST_WEIGHT {
            return None;
        }
        let (c0, c1) = (sums[FIRST], sums[FIRST + 1]);
        let p = weight - (c0 * c0 + c1 * c1) / weight;
        let r0 = sums[SECOND] - (c0 * c0 - c1 * c1) / weight;
        let r1 = sums[SECOND + 1] - 2.0 * c0 * c1 / weight;
        let determinant = p * p - r0 * r0 - r1 * r1;
        (determinant > LEAST_SOLVABLE * weight * weight).then_some(Self {
            weight,
            first: [c0 / weight, c1 / weight],
            p,
            r: [r0, r1],
            scale: 2.0 / (determinant * weight),
            determinant,
        })
    }

    /// The determinant, 1 if the travel covers whole waves evenly.
    fn determined(&self) -> f32 {
        self.determinant / (self.weight * self.weight)
    }

    /// Energy in the gauge that the wave explains, per weight: half its amplitude squared.
    fn energy(&self, sums: &Sums, gauge: usize) -> f32 {
        let mean = sums[MEAN + gauge];
        let s0 = sums[2 * gauge] - mean * self.first[0];
        let s1 = sums[2 * gauge + 1] - mean * self.first[1];
        let [r0, r1] = self.r;
        let direct = self.p * (s0 * s0 + s1 * s1);
        let image = r0 * (s0 * s0 - s1 * s1) + 2.0 * r1 * s0 * s1;
        (self.scale * (direct - image)).max(0.0)
    }

    /// The wave's amplitude in the gauge, squared.
    fn amplitude_squared(&self, sums: &Sums, gauge: usize) -> f32 {
        let mean = sums[MEAN + gauge];
        let s0 = sums[2 * gauge] - mean * self.first[0];
        let s1 = sums[2 * gauge + 1] - mean * self.first[1];
        let [r0, r1] = self.r;
        // (P S − R S*) / (P² − |R|²)
        let a0 = self.p * s0 - (r0 * s0 + r1 * s1);
        let a1 = self.p * s1 - (r1 * s0 - r0 * s1);
        let scale = 2.0 / self.determinant;
        scale * scale * (a0 * a0 + a1 * a1)
    }

    /// The gauge's variance, per weight.
    fn variance(&self, sums: &Sums, gauge: usize) -> f32 {
        let mean = sums[MEAN + gauge] / self.weight;
        sums[SQUARE + gauge] / self.weight - mean * mean
    }
}

impl Play {
    /// The place's movement beyond the play, in places.
    fn follow(&mut self, place: Place) -> i32 {
        let at = self.at.get_or_insert(place);
        let away = place.wrapping_sub(*at);
        let travel = away - away.clamp(-self.half, self.half);
        *at = at.wrapping_add(travel);
        travel
    }
}

impl Jerk {
    fn push(&mut self, touch: &Touch) {
        let [before, older] = self.before;
        let power = gauges_of(touch.usable)
            .map(|gauge| {
                let second = touch.gauges[gauge] - 2.0 * before[gauge] + older[gauge];
                second * second
            })
            .sum::<f32>();
        self.before = [touch.gauges, before];
        self.samples = self.samples.saturating_add(1);
        // The first two differences are with nothing.
        if let Some(samples) = self.samples.checked_sub(2).filter(|&samples| samples > 0) {
            let samples = samples as f32;
            self.power += (power - self.power) / samples.min(JERK_SAMPLES);
            if samples == 1.0 {
                self.quiet = power;
            }
            // A quantile in steps of its own size: so many up as down once a share of the powers is below.
            let step = (1.0 / samples).max(QUIET_STEP);
            self.quiet *= if power > self.quiet {
                1.0 + step * QUIET_SHARE
            } else {
                1.0 - step * (1.0 - QUIET_SHARE)
            };
            self.quiet = self.quiet.max(self.power * QUIET_LEAST);
        }
    }

    /// What the mean power would be if it were always as in the quiet moments, white noise in `gauges`
    /// gauges: a fingertip that sticks and slips is quiet in between, noise is not.
    fn steady(&self, gauges: u32) -> f32 {
        let gauges = (gauges as usize).clamp(1, GAUGES);
        (self.quiet / QUIET_OF_MEAN[gauges - 1]).min(self.power)
    }
}

/// Power gain of the second difference at 1 kHz, (2 sin(πf/fs))⁴, up to half the sample rate.
fn second_difference_gain(frequency_hz: f32) -> f32 {
    let half_turns = (frequency_hz / SAMPLE_RATE_HZ as f32).min(0.5);
    let [_, sin] = phasor((half_turns * 2_147_483_648.0) as u32);
    let square = 4.0 * sin * sin;
    square * square
}

/// The gauges whose bit is set.
fn gauges_of(mask: u8) -> impl Iterator<Item = usize> {
    (0..GAUGES).filter(move |gauge| mask >> gauge & 1 == 1)
}

#[cfg(test)]
mod tests;
