//! An estimate as a row.

use postcard_schema::Schema;
use protocol::{Contact, Estimate, GAUGES, GaugeHealth, Range};
use serde::{Deserialize, Serialize};

use super::text::{number, present};

/// [`Estimate`], field by field; what it has not is left out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct EstimateRow {
    /// [`Estimate::sequence`]
    pub sequence: u32,
    /// [`Estimate::instant_us`]
    pub instant_us: u64,
    /// [`Estimate::wavelength_mm`]
    #[serde(
        default,
        deserialize_with = "present",
        skip_serializing_if = "Option::is_none"
    )]
    pub wavelength_mm: Option<f32>,
    /// [`Estimate::valid`]
    pub valid: bool,
    /// [`Estimate::confidence`]
    #[serde(deserialize_with = "number")]
    pub confidence: f32,
    /// [`Estimate::amplitude_lsb`]
    #[serde(deserialize_with = "number")]
    pub amplitude_lsb: f32,
    /// [`Estimate::counted_mm`]
    #[serde(
        default,
        deserialize_with = "present",
        skip_serializing_if = "Option::is_none"
    )]
    pub counted_mm: Option<f32>,
    /// [`Estimate::range`]
    pub range: Range,
    /// [`Estimate::contact`]
    pub contact: Contact,
    /// [`Estimate::velocity_um_s`]
    pub velocity_um_s: i32,
    /// [`Estimate::lag_um`]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lag_um: Option<i32>,
    /// [`Estimate::gauges_used`]: bit g set if gauge g took part.
    pub gauges_used: u8,
    /// [`Estimate::health`]
    pub health: [GaugeHealth; GAUGES],
}

impl From<Estimate> for EstimateRow {
    fn from(estimate: Estimate) -> Self {
        copied!(estimate => Self {
            sequence, instant_us, wavelength_mm, valid, confidence, amplitude_lsb, counted_mm, range, contact,
            velocity_um_s, lag_um, gauges_used, health
        })
    }
}

impl From<EstimateRow> for Estimate {
    fn from(row: EstimateRow) -> Self {
        copied!(row => Self {
            sequence, instant_us, wavelength_mm, valid, confidence, amplitude_lsb, counted_mm, range, contact,
            velocity_um_s, lag_um, gauges_used, health
        })
    }
}
