//! What the page shows, as JSON: the dashboard at one moment.

use protocol::{DisplayState, Role};
use serde_json::{Value, json};

use crate::monitor::dashboard::Dashboard;

/// A value that is older than this, in µs, is not shown.
const FRESH_US: u64 = 500_000;

/// One moment of a dashboard, and of what the relays here say of who moves the arm.
pub fn picture(dashboard: &Dashboard, hands: &[String]) -> Value {
    let now_us = dashboard.now_us;
    let is_fresh = |at_us: u64| now_us.saturating_sub(at_us) < FRESH_US;
    let mm_s = |um_s: i32| um_s as f32 / 1e3;
    let board = |role: Role| {
        let board = dashboard.board(role);
        let state = board.state.as_ref();
        json!({
            "name": role.name(),
            "state": state.map_or_else(|| "not looked for".to_owned(), ToString::to_string),
            "known": board.is_known(),
        })
    };
    let estimate = dashboard.estimate.filter(|(at_us, _)| is_fresh(*at_us));
    let motion = dashboard.motion.filter(|(at_us, _)| is_fresh(*at_us));
    let has_gauges = dashboard.gauges_us.is_some_and(is_fresh);
    // In ADC steps (3.3 V / 4096).
    let gauges_lsb = dashboard.traces.gauges_lsb.each_ref().map(|trace| {
        let extent = trace.extent(now_us.saturating_sub(FRESH_US), now_us);
        extent.filter(|_| has_gauges).map(|extent| extent.last)
    });
    let safety = dashboard.safety.map(|(_, state)| state);
    // Each one's place in mm, and its largest voltage of the last 50 to 100 ms.
    let fingertip = &dashboard.fingertip;
    let actuators = fingertip
        .actuators()
        .into_iter()
        .flatten()
        .zip(fingertip.peaks_v());
    let mm = |um: i16| f32::from(um) / 1e3;
    let log = dashboard.log_entries.iter().rev().take(8);
    json!({
        "now_ms": now_us / 1_000,
        "boards": [board(Role::Sensor), board(Role::Display)],
        "estimate": estimate.map(|(_, estimate)| json!({
            "wavelength_mm": estimate.wavelength_mm,
            "valid": estimate.valid,
            "confidence": estimate.confidence,
            "counted_mm": estimate.counted_mm,
            "arm_mm_s": mm_s(estimate.velocity_um_s),
        })),
        "hand_mm_s": motion.map(|(_, motion)| mm_s(motion.velocity_um_s)),
        "gauges_lsb": gauges_lsb,
        "supervisor": safety.map(|state| state.to_string()),
        "stopped": matches!(safety, Some(DisplayState::Stopped(_))),
        "actuators": actuators
            .map(|(actuator, peak_v)| [mm(actuator.x_um), mm(actuator.y_um), peak_v])
            .collect::<Vec<_>>(),
        "hands": hands,
        // The newest first.
        "log": log
            .map(|entry| format!("{}: {}", entry.role.name(), entry.what))
            .collect::<Vec<_>>(),
    })
}
