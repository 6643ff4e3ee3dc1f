//! Recorded voltages, played back.

use std::sync::Arc;

use protocol::{CHANNELS, GAUGES};

use super::{CODES, MID_RAIL_CODE, VOLTS_FULL_SCALE, code};
use crate::scene::Series;

/// Voltages at the pins over time.
#[derive(Clone, Debug)]
pub struct RecordedGauges {
    volts: Arc<Series>,
    channels: usize,
    row: usize,
}

impl RecordedGauges {
    /// Plays `volts`: five columns, or six with the tangential force, which is left out unless
    /// `tangential`.
    pub fn new(volts: Arc<Series>, tangential: bool) -> Self {
        let channels = GAUGES + usize::from(tangential);
        Self {
            channels: channels.min(volts.width),
            volts,
            row: 0,
        }
    }

    /// One scan at `t_s`, on the straight line between the rows around it. A channel without a column
    /// rests.
    pub fn scan(&mut self, t_s: f64) -> [u16; CHANNELS] {
        self.row = self.volts.row(t_s, self.row);
        std::array::from_fn(|channel| {
            if channel < self.channels {
                let volts = self.volts.value(self.row, channel, t_s);
                code((volts / VOLTS_FULL_SCALE * CODES) as f32)
            } else {
                code(MID_RAIL_CODE)
            }
        })
    }
}
