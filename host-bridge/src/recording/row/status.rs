//! Counters, the supervisor's state and reported configurations as rows.

use postcard_schema::Schema;
use protocol::{
    Configuration, ConfigurationReport, DisplayConfiguration, DisplayCounters, DisplayState, Hold,
    PortCounters, Refusal, ResetCause, RoleCounters, Safety, SensorConfiguration, SensorCounters,
    Status, Trip,
};
use serde::{Deserialize, Serialize};

/// A sensor board's [`Status`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SensorStatusRow {
    /// [`Status::uptime_us`]
    pub uptime_us: u64,
    /// [`Status::reset`]
    pub reset: ResetCause,
    /// [`Status::watchdog_resets`]
    pub watchdog_resets: u32,
    /// [`Status::peer`]
    pub peer: PortCounters,
    /// [`Status::console`]
    pub console: PortCounters,
    /// [`Status::role`]
    pub sensor: SensorCounters,
    /// [`Status::stack_free_bytes`]
    pub stack_free_bytes: u32,
}

/// A display board's [`Status`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct DisplayStatusRow {
    /// [`Status::uptime_us`]
    pub uptime_us: u64,
    /// [`Status::reset`]
    pub reset: ResetCause,
    /// [`Status::watchdog_resets`]
    pub watchdog_resets: u32,
    /// [`Status::peer`]
    pub peer: PortCounters,
    /// [`Status::console`]
    pub console: PortCounters,
    /// [`Status::role`], without the state
    pub display: DisplayCountersRow,
    /// [`DisplayCounters::state`]
    pub supervisor: Stand,
    /// [`Status::stack_free_bytes`]
    pub stack_free_bytes: u32,
}

/// [`DisplayCounters`] without the state.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct DisplayCountersRow {
    /// [`DisplayCounters::ticks`]
    pub ticks: u32,
    /// [`DisplayCounters::updates`]
    pub updates: u32,
    /// [`DisplayCounters::deadline_misses`]
    pub deadline_misses: u32,
    /// [`DisplayCounters::estimates`]
    pub estimates: u32,
    /// [`DisplayCounters::refused_estimates`]
    pub refused_estimates: u32,
    /// [`DisplayCounters::fades`]
    pub fades: u32,
    /// [`DisplayCounters::spi_errors`]
    pub spi_errors: u32,
    /// [`DisplayCounters::implausible`]
    pub implausible: u32,
    /// [`DisplayCounters::flooded`]
    pub flooded: u32,
    /// [`DisplayCounters::encoder_jumps`]
    pub encoder_jumps: u32,
    /// [`DisplayCounters::converter_faults`]
    pub converter_faults: u32,
    /// [`DisplayCounters::clears`]
    pub clears: u32,
    /// [`DisplayCounters::unheard`]
    pub unheard: u32,
    /// [`DisplayCounters::changes`]
    pub changes: u32,
}

/// A change of the supervisor's state.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SafetyRow {
    /// [`Safety::instant_us`]
    pub instant_us: u64,
    /// [`Safety::state`]
    pub supervisor: Stand,
}

/// A [`DisplayState`], its reason beside it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Stand {
    /// Its name.
    pub state: StandName,
    /// Why it fades.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hold: Option<Hold>,
    /// Why it has stopped.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trip: Option<Trip>,
}

/// The name of a [`DisplayState`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum StandName {
    /// [`DisplayState::Boot`]
    Boot,
    /// [`DisplayState::Ready`]
    Ready,
    /// [`DisplayState::Driving`]
    Driving,
    /// [`DisplayState::Fading`]
    Fading,
    /// [`DisplayState::Stopped`]
    Stopped,
}

impl From<DisplayState> for Stand {
    fn from(state: DisplayState) -> Self {
        let (state, hold, trip) = match state {
            DisplayState::Boot => (StandName::Boot, None, None),
            DisplayState::Ready => (StandName::Ready, None, None),
            DisplayState::Driving => (StandName::Driving, None, None),
            DisplayState::Fading(hold) => (StandName::Fading, Some(hold), None),
            DisplayState::Stopped(trip) => (StandName::Stopped, None, Some(trip)),
        };
        Self { state, hold, trip }
    }
}

impl Stand {
    /// The state; none if its reason is missing.
    pub fn state(self) -> Option<DisplayState> {
        Some(match self.state {
            StandName::Boot => DisplayState::Boot,
            StandName::Ready => DisplayState::Ready,
            StandName::Driving => DisplayState::Driving,
            StandName::Fading => DisplayState::Fading(self.hold?),
            StandName::Stopped => DisplayState::Stopped(self.trip?),
        })
    }
}

impl SensorStatusRow {
    /// The row of a sensor board's status.
    pub fn new(status: &Status, sensor: SensorCounters) -> Self {
        copied!(status => Self {
            uptime_us, reset, watchdog_resets, peer, console, stack_free_bytes; sensor
        })
    }

    /// The status.
    pub fn status(self) -> Status {
        let role = RoleCounters::Sensor(self.sensor);
        copied!(self => Status {
            uptime_us, reset, watchdog_resets, peer, console, stack_free_bytes; role
        })
    }
}

impl DisplayStatusRow {
    /// The row of a display board's status.
    pub fn new(status: &Status, counters: &DisplayCounters) -> Self {
        let (display, supervisor) = (counters.into(), counters.state.into());
        copied!(status => Self {
            uptime_us, reset, watchdog_resets, peer, console, stack_free_bytes; display, supervisor
        })
    }

    /// The status; none if the supervisor's reason is missing.
    pub fn status(self) -> Option<Status> {
        let role = RoleCounters::Display(self.display.with(self.supervisor.state()?));
        Some(copied!(self => Status {
            uptime_us, reset, watchdog_resets, peer, console, stack_free_bytes; role
        }))
    }
}

impl From<&DisplayCounters> for DisplayCountersRow {
    fn from(counters: &DisplayCounters) -> Self {
        copied!(counters => Self {
            ticks, updates, deadline_misses, estimates, refused_estimates, fades, spi_errors, implausible, flooded,
            encoder_jumps, converter_faults, clears, unheard, changes
        })
    }
}

impl DisplayCountersRow {
    fn with(self, state: DisplayState) -> DisplayCounters {
        copied!(self => DisplayCounters {
            ticks, updates, deadline_misses, estimates, refused_estimates, fades, spi_errors, implausible, flooded,
            encoder_jumps, converter_faults, clears, unheard, changes; state
        })
    }
}

impl From<Safety> for SafetyRow {
    fn from(safety: Safety) -> Self {
        Self {
            instant_us: safety.instant_us,
            supervisor: safety.state.into(),
        }
    }
}

impl SafetyRow {
    /// The message; none if the supervisor's reason is missing.
    pub fn safety(self) -> Option<Safety> {
        Some(Safety {
            instant_us: self.instant_us,
            state: self.supervisor.state()?,
        })
    }
}

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
