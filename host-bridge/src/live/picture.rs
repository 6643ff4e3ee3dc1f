//! What the page shows, as JSON: the dashboard at one moment.

use protocol::{ACTUATORS, GAUGES, Role};
use serde::Serialize;

use crate::monitor::dashboard::Dashboard;

/// A value that is older than this, in µs, is not shown.
const FRESH_US: u64 = 500_000;

/// One moment.
#[derive(Debug, Serialize)]
pub struct Picture {
    /// In ms since this program began.
    now_ms: u64,
    boards: [BoardPicture; 2],
    estimate: Option<EstimatePicture>,
    hand_mm_s: Option<f32>,
    /// Each gauge in ADC steps (3.3 V / 4096).
    gauges_lsb: [Option<f32>; GAUGES],
    supervisor: Option<String>,
    /// Whether the display is stopped.
    stopped: bool,
    /// Each actuator's place in mm, and its largest voltage of the last 50 to 100 ms.
    actuators: Vec<[f32; 3]>,
    /// What the relays here say of who moves the arm.
    hands: Vec<String>,
    /// What happened last, the newest first.
    log: Vec<String>,
}

#[derive(Debug, Serialize)]
struct BoardPicture {
    name: &'static str,
    /// How the way to it stands, in words.
    state: String,
    known: bool,
}

#[derive(Debug, Serialize)]
struct EstimatePicture {
    wavelength_mm: Option<f32>,
    valid: bool,
    /// 0 to 1.
    confidence: f32,
    counted_mm: Option<f32>,
    arm_mm_s: f32,
}

impl Picture {
    /// Of a dashboard, and of what the relays say.
    pub fn of(dashboard: &Dashboard, hands: Vec<String>) -> Self {
        let now_us = dashboard.now_us;
        let is_fresh = |at_us: u64| now_us.saturating_sub(at_us) < FRESH_US;
        let board = |role: Role| {
            let board = dashboard.board(role);
            let state = board.state.as_ref();
            BoardPicture {
                name: role.name(),
                state: state.map_or_else(|| "not looked for".to_owned(), ToString::to_string),
                known: board.is_known(),
            }
        };
        let estimate = dashboard.estimate.filter(|(at_us, _)| is_fresh(*at_us));
        let motion = dashboard.motion.filter(|(at_us, _)| is_fresh(*at_us));
        let has_gauges = dashboard.gauges_us.is_some_and(is_fresh);
        let traces = &dashboard.traces.gauges_lsb;
        let safety = dashboard.safety.map(|(_, state)| state);
        let actuators = dashboard.fingertip.actuators();
        let peaks = dashboard.fingertip.peaks_v();
        Self {
            now_ms: now_us / 1_000,
            boards: [board(Role::Sensor), board(Role::Display)],
            estimate: estimate.map(|(_, estimate)| EstimatePicture {
                wavelength_mm: estimate.wavelength_mm,
                valid: estimate.valid,
                confidence: estimate.confidence,
                counted_mm: estimate.counted_mm,
                arm_mm_s: estimate.velocity_um_s as f32 / 1e3,
            }),
            hand_mm_s: motion.map(|(_, motion)| motion.velocity_um_s as f32 / 1e3),
            gauges_lsb: std::array::from_fn(|gauge| {
                let extent = traces[gauge].extent(now_us.saturating_sub(FRESH_US), now_us);
                extent.filter(|_| has_gauges).map(|extent| extent.last)
            }),
            supervisor: safety.map(|state| state.to_string()),
            stopped: matches!(safety, Some(protocol::DisplayState::Stopped(_))),
            actuators: actuators.map_or(Vec::new(), |actuators| {
                (0..ACTUATORS)
                    .map(|at| {
                        let actuator = actuators[at];
                        let mm = |um: i16| f32::from(um) / 1e3;
                        [mm(actuator.x_um), mm(actuator.y_um), peaks[at]]
                    })
                    .collect()
            }),
            hands,
            log: dashboard
                .log_entries
                .iter()
                .rev()
                .take(8)
                .map(|entry| format!("{}: {}", entry.role.name(), entry.what))
                .collect(),
        }
    }
}
