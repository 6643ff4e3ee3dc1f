//! Reported configurations as rows.

use postcard_schema::Schema;
use protocol::{
    Configuration, ConfigurationReport, DisplayConfiguration, Refusal, SensorConfiguration,
};
use serde::{Deserialize, Serialize};

/// A sensor board's [`ConfigurationReport`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SensorReportRow {
    /// [`ConfigurationReport::refused`]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<Refusal>,
    /// [`ConfigurationReport::hash`]
    pub hash: u32,
    /// [`ConfigurationReport::configuration`]
    pub in_force: SensorConfiguration,
}

/// A display board's [`ConfigurationReport`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct DisplayReportRow {
    /// [`ConfigurationReport::refused`]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<Refusal>,
    /// [`ConfigurationReport::hash`]
    pub hash: u32,
    /// [`ConfigurationReport::configuration`]
    pub in_force: DisplayConfiguration,
}

impl From<SensorReportRow> for ConfigurationReport {
    fn from(row: SensorReportRow) -> Self {
        let configuration = Configuration::Sensor(row.in_force);
        copied!(row => Self { refused, hash; configuration })
    }
}

impl From<DisplayReportRow> for ConfigurationReport {
    fn from(row: DisplayReportRow) -> Self {
        let configuration = Configuration::Display(row.in_force);
        copied!(row => Self { refused, hash; configuration })
    }
}
