//! What a run leaves behind, the same from both engines: the ground on which it is judged.

use protocol::{CHANNELS, Estimate, Status};
use strum::IntoStaticStr;

use crate::run::fault_evidence::FaultEvidence;

/// Actuators driven (Okamoto et al. 2009, section IV).
pub const ACTUATORS: usize = 50;

/// Which engine ran a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
pub enum Engine {
    /// The firmware's libraries, on the host.
    Native,
    /// The flashed ELFs, on emulated boards.
    Elf,
}

impl Engine {
    /// The engine's name on the command line and in the JSON.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// One scan of the ADC, at its trigger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanRecord {
    /// Instant of the trigger, in ns since the scene's start.
    pub at_ns: u64,
    /// The codes converted, 0 to 4095.
    pub codes: [u16; CHANNELS],
    /// The arm encoder's counter at the trigger (5 µm a count, wraps).
    pub encoder: u16,
    /// Where the arm truly is, in mm.
    pub position_mm: f64,
}

/// One reading of the hand encoder by the display, once a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickRecord {
    /// Instant of the reading, in ns since the scene's start.
    pub at_ns: u64,
    /// The hand encoder's counter (5 µm a count, wraps).
    pub encoder: u16,
    /// Where the hand truly is, in mm.
    pub position_mm: f64,
}

/// An estimate, as it reached the display.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimateRecord {
    /// The instant the sensor gives it, in ns since the scene's start.
    pub made_ns: u64,
    /// When its last byte reached the display's UART, in ns since the scene's start; none if it never did.
    pub received_ns: Option<u64>,
    /// The estimate.
    pub estimate: Estimate,
}

impl EstimateRecord {
    /// Whether what arrived is this estimate, by whatever number.
    pub fn is(&self, arrived: &Estimate) -> bool {
        let sequence = self.estimate.sequence;
        self.estimate
            == Estimate {
                sequence,
                ..*arrived
            }
    }
}

/// An estimate in a frame that has reached the display whole: the sensor's, or what was made of it on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// When its last byte came, in ns since the scene's start.
    pub at_ns: u64,
    /// The estimate, as the display hears it.
    pub estimate: Estimate,
    /// Whether who sends estimates has asked for a greeting since the one before.
    pub has_asked: bool,
}

impl Arrival {
    /// All that arrived, in order, if it was nothing but what the sensor made, and whole.
    pub fn of(estimates: &[EstimateRecord]) -> Vec<Self> {
        let mut arrived: Vec<Self> = estimates
            .iter()
            .filter_map(|record| {
                Some(Self {
                    at_ns: record.received_ns?,
                    estimate: record.estimate,
                    has_asked: false,
                })
            })
            .collect();
        arrived.sort_by_key(|arrival| arrival.at_ns);
        arrived
    }
}

/// The voltages after one LDAC edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutputRecord {
    /// Instant of the edge, in ns since the scene's start.
    pub at_ns: u64,
    /// The word each actuator's DAC channel holds: 0x8000 is 0 V, one step 10 V / 65 536.
    pub words: [u16; ACTUATORS],
    /// Time between the first and the last channel's change, in ns: 0 for a common edge.
    pub skew_ns: u64,
}

/// The DAC word of 0 V (DAC81416 data sheet, straight binary of a bipolar range).
pub const ZERO_VOLT: u16 = 0x8000;

/// One step of a DAC word of the ±5 V range, in V.
pub const WORD_V: f64 = 10.0 / 65_536.0;

/// Converts a DAC word of the ±5 V range to volts.
pub fn volts(word: u16) -> f64 {
    (f64::from(word) - f64::from(ZERO_VOLT)) * WORD_V
}

/// What is known of a run once it is over, whether it was recorded or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ran {
    /// Who ran it.
    pub engine: Engine,
    /// Virtual time run, in s.
    pub duration_s: f64,
    /// As in [`Recording::warm_up_s`], in s.
    pub warm_up_s: f64,
    /// Wall time that the rest took, in s: with what onlookers did meanwhile.
    pub wall_s: f64,
    /// XXH3 of every link byte and every DAC word with its instant.
    pub hash: u64,
    /// The sensor's last counters, if it got to send any.
    pub sensor_status: Option<Status>,
    /// The display's last counters, if it got to send any.
    pub display_status: Option<Status>,
}

impl Ran {
    /// Virtual time run per wall time; none if that was too short to be measured.
    pub fn realtime_factor(&self) -> Option<f64> {
        let factor = (self.duration_s - self.warm_up_s) / self.wall_s;
        factor.is_finite().then_some(factor)
    }
}

/// Everything a run leaves behind.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Who ran it.
    pub engine: Engine,
    /// Virtual time run, in s.
    pub duration_s: f64,
    /// Virtual time at the beginning that is not in `wall_s`, in s: in the elf engine the emulator
    /// translates the firmware as it first runs, which costs a second or two once.
    pub warm_up_s: f64,
    /// Wall time that the rest took, in s.
    pub wall_s: f64,
    /// XXH3 of every link byte and every DAC word with its instant.
    pub hash: u64,
    /// Every ADC scan, 4 kHz.
    pub scans: Vec<ScanRecord>,
    /// Every reading of the hand encoder, 2 kHz.
    pub ticks: Vec<TickRecord>,
    /// Every estimate, 100 Hz, in the order they were made.
    pub estimates: Vec<EstimateRecord>,
    /// Every estimate that arrived at the display, in the order of arrival.
    pub arrived: Vec<Arrival>,
    /// Every change of the outputs, at most 2 kHz.
    pub outputs: Vec<OutputRecord>,
    /// The sensor's last counters, if it got to send any.
    pub sensor_status: Option<Status>,
    /// The display's last counters, if it got to send any.
    pub display_status: Option<Status>,
    /// Log lines of both boards, decoded from defmt: instant in ns, board, text. Empty from `native`.
    pub log: Vec<(u64, &'static str, String)>,
    /// What the run shows of faults.
    pub signs: FaultEvidence,
}

impl Recording {
    /// Of a run that has not begun, with room for `duration_s`.
    pub fn empty(engine: Engine, duration_s: f64) -> Self {
        let room = |rate_hz: u32| (duration_s * f64::from(rate_hz)).ceil() as usize + 1;
        Self {
            engine,
            duration_s,
            warm_up_s: 0.0,
            wall_s: 0.0,
            hash: 0,
            scans: Vec::with_capacity(room(firmware_sensor::SCAN_RATE_HZ)),
            ticks: Vec::with_capacity(room(firmware_display::TICK_RATE_HZ)),
            estimates: Vec::with_capacity(room(firmware_sensor::ESTIMATE_RATE_HZ)),
            arrived: Vec::with_capacity(room(firmware_sensor::ESTIMATE_RATE_HZ)),
            outputs: Vec::with_capacity(room(firmware_display::TICK_RATE_HZ)),
            sensor_status: None,
            display_status: None,
            log: Vec::new(),
            signs: FaultEvidence::default(),
        }
    }

    /// The run is over.
    pub fn end(&mut self, ran: &Ran) {
        self.warm_up_s = ran.warm_up_s;
        self.wall_s = ran.wall_s;
        self.hash = ran.hash;
        self.sensor_status = ran.sensor_status;
        self.display_status = ran.display_status;
        self.match_arrivals();
    }

    /// Notes at each estimate when it was received. Both come in their order, but for a few. What comes again, and
    /// what the sensor has not made so, is none.
    pub fn match_arrivals(&mut self) {
        /// So far may the link put them out of order.
        const REORDERED: usize = 4_096;
        let mut last = 0_usize;
        for arrival in &self.arrived {
            let from = last.saturating_sub(REORDERED);
            let until = self.estimates.len().min(last + REORDERED);
            let made = self.estimates.get_mut(from..until).unwrap_or_default();
            let waits = |record: &EstimateRecord| {
                record.received_ns.is_none() && record.is(&arrival.estimate)
            };
            if let Some(place) = made.iter().position(waits) {
                made[place].received_ns = Some(arrival.at_ns);
                last = from + place;
            }
        }
    }

    /// What is known of the run without its records.
    pub fn ran(&self) -> Ran {
        Ran {
            engine: self.engine,
            duration_s: self.duration_s,
            warm_up_s: self.warm_up_s,
            wall_s: self.wall_s,
            hash: self.hash,
            sensor_status: self.sensor_status,
            display_status: self.display_status,
        }
    }

    /// Virtual time run per wall time; none if that was too short to be measured.
    pub fn realtime_factor(&self) -> Option<f64> {
        self.ran().realtime_factor()
    }
}
