//! `[display]` of a scene file, its description of the actuators included.

use std::path::Path;

use protocol::actuators::{
    self, ACTUATORS, Actuator, DAMPING_PERCENT, FURTHEST_UM, HIGHEST_RESONANCE_DHZ,
    LOWEST_RESONANCE_DHZ, UNITY_GAIN,
};
use protocol::{DisplayConfiguration, Mode, Rendering, UpdateRate};

use super::read_bytes;
use super::table::Table;
use crate::scene::{Display, SceneError, Series};

/// Columns of a description of the actuators, and with their models.
const HEADERS: [&str; 2] = [
    "actuator,x_um,y_um,gain,phase_turns,inverted",
    "actuator,x_um,y_um,gain,phase_turns,inverted,resonance_hz,damping",
];

/// What may be told of an actuator's resonance, in Hz, and of its damping.
const RESONANCE_HZ: [f64; 2] = [
    LOWEST_RESONANCE_DHZ as f64 / 10.0,
    HIGHEST_RESONANCE_DHZ as f64 / 10.0,
];
const DAMPING: [f64; 2] = [
    DAMPING_PERCENT.0 as f64 / 100.0,
    DAMPING_PERCENT.1 as f64 / 100.0,
];

pub(super) fn read(mut table: Table<'_>) -> Result<Display, SceneError> {
    let defaults = DisplayConfiguration::DEFAULT;
    let mode = table.choice("mode", &Mode::ALL.map(|mode| (mode.name(), mode)))?;
    let renderings = Rendering::ALL.map(|rendering| (rendering.name(), rendering));
    let rendering = table.choice("rendering", &renderings)?;
    let update_rate = match table.whole("update_rate_hz", 2_000, 4_000)? {
        None | Some(2_000) => UpdateRate::Hz2000,
        Some(4_000) => UpdateRate::Hz4000,
        Some(_) => return Err(table.refuse("update_rate_hz", "is no rate: give 2000 or 4000")),
    };
    let mut whole = |key, default: u16, low, high| table.whole_or(key, (low, high), default);
    // The ranges are the board's own.
    let configuration = DisplayConfiguration {
        mode,
        rendering,
        update_rate,
        max_age_ms: whole("max_age_ms", defaults.max_age_ms, 20, 5_000)?,
        fade_in_ms: whole("fade_in_ms", defaults.fade_in_ms, 1, 1_000)?,
        fade_out_ms: whole("fade_out_ms", defaults.fade_out_ms, 1, 1_000)?,
        glide_ms: whole("glide_ms", defaults.glide_ms, 0, 500)?,
        amplitude_mv: whole("amplitude_mv", defaults.amplitude_mv, 0, 5_000)?,
        reference_lsb: whole("reference_lsb", defaults.reference_lsb, 0, 2_000)?,
        reference_mn: whole("reference_mn", defaults.reference_mn, 0, 60_000)?,
        full_drive_s: whole("full_drive_s", defaults.full_drive_s, 10, 3_600)?,
        actuators: defaults.actuators,
    };
    let described = if table.contains("file") {
        let path = table.file(&format!("give a CSV file with the columns {}", HEADERS[0]))?;
        let bytes = read_bytes(&path).map_err(|error| table.unreadable(&path, &error))?;
        described(&path, &bytes)?
    } else {
        let pitch_um = table.whole("pitch_um", 100, 4_000)?;
        actuators::grid(pitch_um.map_or(actuators::DEFAULT_PITCH_UM, |um| um as u16))
    };
    if let Err(refusal) = firmware_display::settings::check_effort(&configuration, &described) {
        let message = format!(
            "is too much with these actuators: more than the fundamental, or a resonance, is worked out for at most \
             {} of them with different places, phases or resonances",
            refusal.high
        );
        return Err(table.refuse("rendering", message));
    }
    table.finish("")?;
    let mut display = Display::with_actuators(described);
    display.configuration = DisplayConfiguration {
        actuators: display.configuration.actuators,
        ..configuration
    };
    Ok(display)
}

/// The actuators that a CSV file describes, as `file` in `[display]` of a scene names one: one row each, in their order.
///
/// # Errors
/// If the file can't be read, or does not describe all of them.
pub fn actuators(path: &Path) -> Result<[Actuator; ACTUATORS], SceneError> {
    let bytes = read_bytes(path).map_err(|error| {
        let message = format!(
            "cannot be read: {error}: give a CSV file with the columns {}",
            HEADERS[0]
        );
        SceneError::of(path.display(), "", message)
    })?;
    described(path, &bytes)
}

fn described(path: &Path, bytes: &[u8]) -> Result<[Actuator; ACTUATORS], SceneError> {
    let furthest_um = f64::from(FURTHEST_UM);
    let rows = Series::read(path, bytes, &HEADERS, &|before, row| {
        let expected = before.map_or(0.0, |before| before[0] + 1.0);
        let whole = |value: f64| value.fract() == 0.0 && value.abs() <= furthest_um;
        let place = || {
            format!("is no place: give whole numbers of µm from −{furthest_um} to {furthest_um}")
        };
        if row[0] != expected {
            return Err((0, format!("is not the next actuator: give {expected}")));
        }
        if let Some(column) = (1..=2).find(|&column| !whole(row[column])) {
            return Err((column, place()));
        }
        if !(0.0..=1.0).contains(&row[3]) {
            return Err((3, "is no gain: give a number from 0 to 1".to_owned()));
        }
        if !(0.0..1.0).contains(&row[4]) {
            let message = "is no phase: give turns, from 0 to below 1";
            return Err((4, message.to_owned()));
        }
        if row[5] != 0.0 && row[5] != 1.0 {
            return Err((5, "is neither: give 1 if inverted, else 0".to_owned()));
        }
        if let [.., hz, damping] = *row
            && row.len() > 6
            && hz != 0.0
        {
            let [low, high] = RESONANCE_HZ;
            if !(low..=high).contains(&hz) {
                let message =
                    format!("is no resonance: give {low} to {high} Hz, or 0 if it is not known");
                return Err((6, message));
            }
            let [low, high] = DAMPING;
            if !(low..=high).contains(&damping) {
                return Err((7, format!("is no damping: give {low} to {high}")));
            }
        }
        Ok(())
    })?;
    if rows.at.len() != ACTUATORS {
        let message = format!(
            "describes {} actuators: give all {ACTUATORS}",
            rows.at.len()
        );
        return Err(SceneError::of(path.display(), "", message));
    }
    Ok(std::array::from_fn(|index| {
        let row = &rows.values[index * rows.width..][..rows.width];
        Actuator {
            x_um: row[0] as i16,
            y_um: row[1] as i16,
            gain_q15: (row[2] * f64::from(UNITY_GAIN)).round() as u16,
            phase: (row[3] * 65_536.0).round() as u32 as u16,
            inverted: row[4] == 1.0,
            ..modelled(row.get(5).copied(), row.get(6).copied())
        }
    }))
}

/// An actuator with this resonance in Hz and damping, if they are told and known.
fn modelled(hz: Option<f64>, damping: Option<f64>) -> Actuator {
    let bare = Actuator::at(0, 0);
    match (hz, damping) {
        (Some(hz), Some(damping)) if hz != 0.0 => Actuator {
            resonance_dhz: (hz * 10.0).round() as u16,
            damping_percent: (damping * 100.0).round() as u16,
            ..bare
        },
        _ => bare,
    }
}
