//! Frames with the right CRC that nobody sent.

use protocol::{
    Contact, Estimate, GAUGES, GaugeHealth, MAX_FRAME, Message, Range, Stop, StopReason, frame,
};

use crate::scene::fault::{Fault, Kind};

/// Takes frames apart, changes what they say, and numbers them so that none seems to be missing.
#[derive(Clone, Debug)]
pub struct Forger {
    /// What is added to the frames' numbers.
    shift: u16,
    /// What is added to the estimates' numbers.
    estimate_shift: u32,
    /// The last number that went out.
    sequence: u16,
    /// The last estimate that went out.
    estimate: Estimate,
    /// Which way an estimate jumps next.
    upwards: bool,
}

impl Forger {
    /// A forger that has heard nothing yet.
    pub fn new() -> Self {
        Self {
            shift: 0,
            estimate_shift: 0,
            sequence: 0,
            estimate: Estimate {
                sequence: 0,
                instant_us: 0,
                wavelength_mm: Some(2.0),
                valid: true,
                confidence: 1.0,
                amplitude_lsb: 400.0,
                counted_mm: Some(2.0),
                range: Range::T1,
                contact: Contact::Slip,
                velocity_um_s: 50_000,
                lag_um: None,
                gauges_used: (1 << GAUGES) - 1,
                health: [GaugeHealth::Good; GAUGES],
            },
            upwards: false,
        }
    }

    /// The last estimate that went out.
    #[cfg(test)]
    pub fn estimate(&self) -> Estimate {
        self.estimate
    }

    /// Whether frames have to be numbered anew.
    pub fn renumbers(&self) -> bool {
        self.shift != 0 || self.estimate_shift != 0
    }

    /// Notes and numbers a whole frame, its closing 0x00 included, and lets `fault` change what it
    /// says. What is no frame goes through as it is; nothing if the fault takes it out.
    pub fn pass(&mut self, bytes: &[u8], fault: Option<&Fault>) -> Option<Vec<u8>> {
        let mut content = bytes.to_vec();
        content.pop();
        let Ok((sequence, payload)) = frame::decode(&mut content) else {
            return Some(bytes.to_vec());
        };
        let mut out = [0; MAX_FRAME];
        let frame = match postcard::from_bytes(payload) {
            Ok(Message::Estimate(mut estimate)) => {
                if fault.is_some_and(|fault| fault.kind == Kind::SensorSilent) {
                    self.shift = self.shift.wrapping_sub(1);
                    return None;
                }
                estimate.sequence = estimate.sequence.wrapping_add(self.estimate_shift);
                if let Some(fault) = fault {
                    self.falsify(&mut estimate, fault);
                } else {
                    self.estimate = estimate;
                }
                self.sequence = sequence.wrapping_add(self.shift);
                frame::encode(self.sequence, &Message::Estimate(estimate), &mut out)
            }
            _ => {
                self.sequence = sequence.wrapping_add(self.shift);
                frame::encode_payload(self.sequence, payload, &mut out)
            }
        };
        frame.map(<[u8]>::to_vec)
    }

    /// The last estimate once more, with the next numbers.
    pub fn repeat(&mut self) -> Vec<u8> {
        self.estimate_shift = self.estimate_shift.wrapping_add(1);
        self.estimate.sequence = self.estimate.sequence.wrapping_add(1);
        self.insert(&Message::Estimate(self.estimate))
    }

    /// A host's Stop, with the next number.
    pub fn stop(&mut self) -> Vec<u8> {
        self.insert(&Message::Stop(Stop {
            reason: StopReason::Host,
        }))
    }

    fn insert(&mut self, message: &Message) -> Vec<u8> {
        self.shift = self.shift.wrapping_add(1);
        self.sequence = self.sequence.wrapping_add(1);
        let mut out = [0; MAX_FRAME];
        let frame = frame::encode(self.sequence, message, &mut out);
        frame.map(<[u8]>::to_vec).unwrap_or_default()
    }

    fn falsify(&mut self, estimate: &mut Estimate, fault: &Fault) {
        let value = fault.values[0] as f32;
        match fault.kind {
            Kind::EstimateOutOfRange => {
                estimate.wavelength_mm = Some(value);
                estimate.valid = true;
            }
            Kind::EstimateNan => {
                estimate.wavelength_mm = Some(f32::NAN);
                estimate.confidence = f32::NAN;
                estimate.amplitude_lsb = f32::NAN;
                estimate.valid = true;
            }
            Kind::EstimateJumping => {
                self.upwards = !self.upwards;
                let factor = if self.upwards { value } else { value.recip() };
                let wavelength_mm = estimate.wavelength_mm.or(self.estimate.wavelength_mm);
                estimate.wavelength_mm = wavelength_mm.map(|mm| mm * factor);
                estimate.valid = true;
            }
            Kind::EstimateContradictory => {
                estimate.wavelength_mm = None;
                estimate.gauges_used = 0;
                estimate.valid = true;
            }
            _ => {}
        }
    }
}

impl Default for Forger {
    fn default() -> Self {
        Self::new()
    }
}
