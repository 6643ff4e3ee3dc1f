//! What the sensor finds of the surface as rows: estimates and textures.

use postcard_schema::Schema;
use protocol::texture::{BANDS, PARTIALS};
use protocol::{Contact, Estimate, Friction, GAUGES, GaugeHealth, Partial, Range, Texture};
use serde::{Deserialize, Serialize};

use super::log::{number, present};

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

/// [`Texture`], field by field, in the wire's units; what it has not is left out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct TextureRow {
    /// [`Texture::sequence`]
    pub sequence: u32,
    /// [`Texture::instant_us`]
    pub instant_us: u64,
    /// [`Texture::valid`]
    pub valid: bool,
    /// [`Partial::ratio`] of the second and the third, in thousandths of the fundamental's amplitude; 65535: not measured.
    pub partial_ratios: [u16; PARTIALS],
    /// [`Partial::phase`] of these, in turns / 2¹⁶.
    pub partial_phases: [u16; PARTIALS],
    /// [`Texture::repeating_percent`]
    pub repeating_percent: u8,
    /// [`Texture::bands`], in thousandths of the fundamental's amplitude; 65535: not measured.
    pub bands: [u16; BANDS],
    /// [`Friction::mean_mn`]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction_mean_mn: Option<u16>,
    /// [`Friction::fluctuation_mn`]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction_fluctuation_mn: Option<u16>,
}

impl From<Texture> for TextureRow {
    fn from(texture: Texture) -> Self {
        Self {
            sequence: texture.sequence,
            instant_us: texture.instant_us,
            valid: texture.valid,
            partial_ratios: texture.partials.map(|partial| partial.ratio),
            partial_phases: texture.partials.map(|partial| partial.phase),
            repeating_percent: texture.repeating_percent,
            bands: texture.bands,
            friction_mean_mn: texture.friction.map(|friction| friction.mean_mn),
            friction_fluctuation_mn: texture.friction.map(|friction| friction.fluctuation_mn),
        }
    }
}

impl From<TextureRow> for Texture {
    fn from(row: TextureRow) -> Self {
        let friction = row.friction_mean_mn.zip(row.friction_fluctuation_mn);
        Self {
            sequence: row.sequence,
            instant_us: row.instant_us,
            valid: row.valid,
            partials: std::array::from_fn(|n| Partial {
                ratio: row.partial_ratios[n],
                phase: row.partial_phases[n],
            }),
            repeating_percent: row.repeating_percent,
            bands: row.bands,
            friction: friction.map(|(mean_mn, fluctuation_mn)| Friction {
                mean_mn,
                fluctuation_mn,
            }),
        }
    }
}
