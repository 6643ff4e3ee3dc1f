//! The sensor board as a whole: scans, encoder and [`Motion`]s in; estimates, samples and the arm's
//! drive out.

use protocol::{
    ArmState, Contact, Estimate, GAUGES, Gauges, Motion, SensorConfiguration, StreamGauges,
    Texture, Trip,
};

use crate::arm::{Arm, Drive};
use crate::bandpass::{BAND, BandPass, Lane, ORDER};
use crate::block::{Block, Place};
use crate::counting::{Counted, PAPERS_WINDOW_MS};
use crate::decimate::{self, AntiAlias, History};
use crate::estimator::{Estimator, Finding, Touch};
use crate::health::{Health, Signs, is_at_end};
use crate::hum::Hum;
use crate::method::Running;
use crate::noise::Noise;
use crate::slip::Slip;
use crate::spectrum::Spectrum;
use crate::texture::{Surface, TEXTURE_RATE_HZ};
use crate::travel::{self, Travel};
use crate::{ESTIMATE_RATE_HZ, SAMPLE_RATE_HZ, SCANS_PER_SAMPLE, Scan};

/// Time after the start, in samples, until the estimators begin: three time constants of the
/// band-pass' slowest poles, √2 / (2π · 5 Hz), so that 5 % of whatever the start stirred up are left.
const SETTLING_SAMPLES: u32 = (3.0 * core::f64::consts::SQRT_2
    / (2.0 * core::f64::consts::PI * BAND.low_hz())
    * SAMPLE_RATE_HZ as f64) as u32;
/// Speed of the arm from which on it moves, in mm/s.
const MOVING_MM_S: f32 = 2.0;
const SAMPLES_PER_ESTIMATE: u32 = SAMPLE_RATE_HZ / ESTIMATE_RATE_HZ;
const SAMPLES_PER_TEXTURE: u32 = SAMPLE_RATE_HZ / TEXTURE_RATE_HZ;
const _: () = assert!(SAMPLES_PER_TEXTURE.is_multiple_of(SAMPLES_PER_ESTIMATE));
/// Estimates from a jump of the encoder, or of all gauges, on until no place, velocity or sample that the estimators take
/// has to do with it.
const LOST_ESTIMATES: u8 = travel::SPAN_MS.div_ceil(SAMPLES_PER_ESTIMATE as usize) as u8;
const _: () = assert!(travel::SPAN_MS > decimate::DELAY_MS);
/// Samples after an estimate in which there is little to do.
const QUIET_SAMPLES: u32 = 3;
const MICROSECONDS_PER_SAMPLE: u64 = 1_000_000 / SAMPLE_RATE_HZ as u64;

/// What a millisecond brought.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Output {
    /// Every tenth time.
    pub estimate: Option<Estimate>,
    /// Every fiftieth time, while the arm moves, from the first estimate on.
    pub texture: Option<Texture>,
    /// Every eighth time, while they are asked for.
    pub gauges: Option<Gauges>,
    /// For the arm, at once.
    pub drive: Drive,
}

/// The state of everything between the ADC and the link. Its future depends on nothing else than what
/// it is given: a replay of the same inputs gives the same outputs, bit for bit, on any machine.
#[derive(Clone, Debug)]
pub struct Sensor {
    configuration: SensorConfiguration,
    anti_alias: AntiAlias,
    band_pass: BandPass<ORDER>,
    /// None before the first scan.
    started: Option<Started>,
    /// The paper's count, whatever the method.
    counted: Counted,
    noise: Noise,
    hum: Hum,
    health: Health,
    slip: Slip,
    estimator: Running,
    surface: Surface,
    arm: Arm,
    block: Block,
    /// Samples that are still to be sent.
    streaming: u32,
    /// Samples that are still to pass before the estimators begin.
    settling: u32,
    /// No gauge feels anything, or the encoder stands still as one that is dead does.
    is_blind: bool,
    /// What had stopped the arm at the last estimate.
    trip: Option<Trip>,
    /// Estimates after which what is known of the surface is forgotten once more; 0: it is not to be.
    lost: u8,
    samples: u32,
    estimates: u32,
}

/// What can only be set up once the first scan and encoder reading are known.
#[derive(Clone, Debug)]
struct Started {
    history: History,
    /// The counted gauge's band-pass; none until it is settled on a sample.
    lane: Option<Lane<ORDER>>,
    travel: Travel,
}

impl Sensor {
    /// A sensor before its first scan. `configuration` must have passed its check.
    pub fn new(configuration: SensorConfiguration) -> Self {
        Self {
            configuration,
            anti_alias: AntiAlias::new(),
            band_pass: BandPass::new(BAND),
            started: None,
            counted: Counted::new(&configuration),
            noise: Noise::default(),
            hum: Hum::default(),
            health: Health::default(),
            slip: Slip::new(&configuration),
            estimator: Running::new(&configuration),
            surface: Surface::new(),
            arm: Arm::default(),
            block: Block::default(),
            streaming: 0,
            settling: SETTLING_SAMPLES,
            is_blind: false,
            trip: None,
            lost: 0,
            samples: 0,
            estimates: 0,
        }
    }

    /// Takes another configuration, which must have passed its check. The estimators start over: there
    /// is no counted wavelength before a whole window has been counted. What is known of the gauges, the
    /// positions and the arm go on.
    pub fn configure(&mut self, configuration: SensorConfiguration) {
        if configuration.counted_gauge != self.configuration.counted_gauge {
            self.settling = SETTLING_SAMPLES;
            if let Some(started) = &mut self.started {
                started.lane = None;
            }
        }
        self.configuration = configuration;
        self.counted = Counted::new(&configuration);
        self.slip = Slip::new(&configuration);
        self.start_over();
    }

    /// Looks before every estimate whether what was felt before goes on: it does not where the arm is stopped for its encoder,
    /// and so nobody knows where it is, nor behind a time without a gauge or an encoder. The other methods remember nothing for
    /// longer than their window.
    #[inline(never)]
    fn look(&mut self) {
        if self.estimator.spectrum().is_none() {
            return;
        }
        let rests = |started: &Started| started.travel.velocity_mm_s(0) == 0.0;
        let is_at_rest = self.started.as_ref().is_some_and(rests);
        let trip = self.arm.trip();
        let changes = core::mem::replace(&mut self.trip, trip) != trip;
        let is_lost = changes && matches!(trip, Some(Trip::ArmEncoder | Trip::ArmStall));
        let is_blind = self.health.stands_still() || is_at_rest && trip == Some(Trip::ArmStall);
        let sees_again = core::mem::replace(&mut self.is_blind, is_blind) && !is_blind;
        // Gauges that are left out as well took part in nothing meanwhile, and do not now.
        if is_lost || sees_again && self.health.good() != 0 {
            self.start_over();
            self.lost = LOST_ESTIMATES;
        } else if self.lost > 0 {
            self.lost -= 1;
            if self.lost == 0 {
                self.start_over();
            }
        }
    }

    /// What is known of the surface is forgotten. Not a part of what calls it: new estimators need much of the stack.
    #[inline(never)]
    fn start_over(&mut self) {
        self.estimator = Running::new(&self.configuration);
        self.surface = Surface::new();
    }

    /// The default estimator, if that is the one that runs.
    pub fn spectrum(&self) -> Option<&Spectrum> {
        self.estimator.spectrum()
    }

    /// The configuration in force.
    pub fn configuration(&self) -> SensorConfiguration {
        self.configuration
    }

    /// Sends samples from now on, for as long as is asked for, or was before if that is longer.
    pub fn stream_gauges(&mut self, asked: &StreamGauges) {
        let for_ms = asked.for_ms.min(StreamGauges::LONGEST_MS);
        // A sample is a millisecond.
        self.streaming = self.streaming.max(for_ms.into());
    }

    /// The arm's drive is off from the next millisecond on, for good. Estimates go on.
    pub fn stop(&mut self, trip: Trip) {
        self.arm.stop(trip);
    }

    /// No sample was taken for longer than [`SILENCE_MS`](crate::arm::SILENCE_MS): the arm rests until the next motion.
    pub fn pause(&mut self) {
        self.arm.rest();
    }

    /// What the arm does.
    pub fn arm(&self) -> ArmState {
        self.arm.state()
    }

    /// Takes a motion from the link. False if it was refused, being older than the last one, or the arm stopped.
    pub fn on_motion(&mut self, motion: &Motion) -> bool {
        let arm_um = self
            .started
            .as_ref()
            .map_or(0, |started| started.travel.position_um(0));
        self.arm.on_motion(motion, arm_um)
    }

    /// Takes a millisecond's four scans, oldest first, and the encoder's counter at the last of them,
    /// at `instant_us` of the board's clock.
    ///
    /// To be done within that millisecond: what is late delays all that follows, and once the ADC's
    /// buffer overruns, scans are lost and λ is wrong for the length of a window.
    pub fn step(
        &mut self,
        instant_us: u64,
        scans: &[Scan; SCANS_PER_SAMPLE],
        encoder: u16,
    ) -> Output {
        let since_estimate = self.samples % SAMPLES_PER_ESTIMATE;
        let estimates = since_estimate == SAMPLES_PER_ESTIMATE - 1;
        if estimates {
            self.look();
        }
        let started = self
            .started
            .get_or_insert_with(|| Started::new(&scans[0], encoder));
        let sample = self.anti_alias.step(&mut started.history, scans);
        started.travel.push(encoder);

        let raw: [f32; GAUGES] = core::array::from_fn(|gauge| sample[gauge]);
        self.noise.push(&raw);
        self.health.push(scans, &raw);
        let usable = self.health.believed() & self.configuration.gauges;
        let mut gauges = raw;
        self.hum.remove(&mut gauges);

        let arm = started.travel.place(decimate::DELAY_MS);
        let lag = self.slip.push(arm, sample[GAUGES], || {
            scans.iter().any(|scan| is_at_end(scan[GAUGES]))
        });
        let counted_gauge = usize::from(self.configuration.counted_gauge).min(GAUGES - 1);
        let counted = started.band_pass(&self.band_pass, raw[counted_gauge]);
        let touch = Touch {
            gauges,
            place: arm.wrapping_sub(lag),
            deflection_known: self.slip.tells_slips(),
            counted,
            noise: self.noise.variances(),
            pickup: self.hum.pickup(),
            usable,
        };
        if self.settling == 0 {
            self.counted.push(counted);
        }
        if self.settling == 0 || !self.estimator.waits() {
            self.estimator.push(&touch);
        }
        self.settling = self.settling.saturating_sub(1);
        self.surface
            .push(&touch, arm, self.slip.force_n(sample[GAUGES]));
        // The estimator begins its work later.
        if since_estimate < QUIET_SAMPLES {
            self.surface.work();
        }

        let arm_um = started.travel.position_um(0);
        let number = self.samples;
        self.samples = self.samples.wrapping_add(1);
        let estimate = if estimates {
            let finding = self.estimator.find(&started.travel);
            let speed_mm_s = started.travel.velocity_mm_s(0).abs();
            let contact = contact(&self.slip, &started.travel, &finding);
            self.surface.hear(&finding);
            // Gauges that may not take part are witnesses nevertheless.
            let witnesses = self.health.good();
            self.hum
                .renew(witnesses, speed_mm_s, frequency_hz(speed_mm_s, &finding));
            self.health.judge(&Signs {
                noise: touch.noise,
                hum: self.hum.own_powers(),
                misfits: finding.misfits,
                agreed: finding.valid || finding.misfits != 0,
                travel_mm: speed_mm_s / ESTIMATE_RATE_HZ as f32,
                allowed: self.configuration.gauges,
            });
            let count = self.counted.over(PAPERS_WINDOW_MS, &started.travel);
            let sequence = self.estimates;
            self.estimates = self.estimates.wrapping_add(1);
            Some(Estimate {
                sequence,
                instant_us,
                wavelength_mm: finding.wavelength_mm,
                valid: finding.valid,
                confidence: finding.confidence,
                amplitude_lsb: finding.amplitude_lsb,
                counted_mm: count.wavelength_mm,
                range: count.range,
                contact,
                velocity_um_s: velocity_um_s(&started.travel),
                lag_um: self.slip.lag_um(),
                gauges_used: finding.gauges_used,
                health: self.health.verdicts(),
            })
        } else {
            None
        };
        // Halfway between two estimates, so that neither waits for the other on the line.
        let due = self.samples % SAMPLES_PER_TEXTURE == SAMPLES_PER_ESTIMATE / 2;
        let moves = || started.travel.velocity_mm_s(0).abs() >= MOVING_MM_S;
        let texture = (due && self.estimates > 0 && moves()).then(|| {
            let contact = self.slip.contact(&started.travel, decimate::DELAY_MS);
            let sequence = self.estimates.wrapping_sub(1);
            self.surface
                .say(sequence, instant_us, contact == Contact::Slip)
        });
        let full_scale_um_s = self.configuration.arm_full_scale_um_s;
        let drive = self.arm.step(instant_us, arm_um, full_scale_um_s);
        let mut output = Output {
            estimate,
            texture,
            gauges: None,
            drive,
        };
        if self.streaming > 0 {
            self.streaming -= 1;
            let full = self.block.push(started.place(number, instant_us), &sample);
            // A block is long, and seldom full: it is not copied while it is not there.
            if full.is_some() {
                output.gauges = full;
            }
        } else {
            self.block.clear();
        }
        output
    }
}

impl Started {
    fn new(first: &Scan, encoder: u16) -> Self {
        Self {
            history: History::settled(first),
            lane: None,
            travel: Travel::new(encoder),
        }
    }

    /// Band-passes the counted gauge.
    fn band_pass(&mut self, band_pass: &BandPass<ORDER>, x: f32) -> f32 {
        let lane = self.lane.get_or_insert_with(|| band_pass.settled(x));
        band_pass.step(lane, x)
    }

    /// Where and when the sample that has just come out of the anti-aliasing filter was taken.
    fn place(&self, sample: u32, instant_us: u64) -> Place {
        let delay_us = decimate::DELAY_MS as u64 * MICROSECONDS_PER_SAMPLE;
        Place {
            sample,
            instant_us: instant_us.saturating_sub(delay_us),
            position_um: self.travel.position_um(decimate::DELAY_MS),
            position_before_um: self.travel.position_um(decimate::DELAY_MS + 1),
        }
    }
}

/// v/λ̂ in Hz where λ̂ is stood by.
fn frequency_hz(speed_mm_s: f32, finding: &Finding) -> Option<f32> {
    let wavelength_mm = finding.wavelength_mm.filter(|_| finding.valid)?;
    Some(speed_mm_s / wavelength_mm)
}

/// The arm's mean velocity over the last estimate's period, in µm/s.
fn velocity_um_s(travel: &Travel) -> i32 {
    let travelled_um = travel.position_um(0) - travel.position_um(SAMPLES_PER_ESTIMATE as usize);
    // 164 mm a millisecond at most.
    travelled_um as i32 * ESTIMATE_RATE_HZ as i32
}

/// What the fingertip does: as the force channel tells; without one, it slips where a wavelength is stood
/// by, and hints of sticking and slipping in turn are all that can be had.
fn contact(slip: &Slip, travel: &Travel, finding: &Finding) -> Contact {
    match slip.contact(travel, decimate::DELAY_MS) {
        Contact::Unknown if slip.lag_um().is_some() => Contact::Unknown,
        Contact::Unknown if travel.velocity_mm_s(0).abs() < MOVING_MM_S => Contact::Unknown,
        Contact::Unknown if finding.jerky => Contact::StickSlip,
        Contact::Unknown if finding.valid => Contact::Slip,
        told => told,
    }
}
