//! `kind = "recorded"` and `profile = "recorded"`: CSV, WAV, MCAP and, for a profile, `.hjif`, at
//! whatever rate they are.
//!
//! ```text
//! section ─> source: file, columns, scale ─> rows of the file ─> tape ─> raster, resampler ─> series, waveform
//! ```

mod block;
mod inverse_filter;
mod raster;
mod resampler;
mod source;
pub(super) mod tape;
#[cfg(test)]
mod tests;
mod topic;
mod wav;

use std::cell::Cell;
use std::sync::Arc;

use protocol::GAUGES;

use super::bounds::Bounds;
use super::table::{Column, Table};
use crate::plant::gauges::{MID_RAIL_VOLTS, SCAN_RATE_HZ};
use crate::plant::surface::GRID_MM;
use crate::scene::Profile;
use crate::scene::SceneError;
use crate::scene::Series;
use crate::scene::Waveform;

use raster::{Even, Raster};
use source::{Format, Source, Words};
use tape::{Check, Conversion};

/// Where our own recordings have the gauges, and the arm's place with them.
const GAUGE_TOPIC: &str = "/sensor/gauges";
/// Their time.
const GAUGE_TIME: (&str, f64) = ("instant_us", 1e-6);
const GAUGE_FIELDS: [&str; GAUGES + 1] = ["g0_v", "g1_v", "g2_v", "g3_v", "g4_v", "tangential_v"];
const ARM_FIELD: &str = "position_um";
const MM_PER_UM: f64 = 1e-3;

/// Gauges that are recorded less often than this, in Hz, miss a part of the paper's band of 5–100 Hz.
const SLOWEST_HZ: f64 = 200.0;
/// Rows that come this often need not be evenly spaced, in s, with a little slack for times written in
/// decimals.
const DENSE_S: f64 = 1.001e-3;
/// A step that is so many times the first one is a gap.
const GAP: f64 = 1.6;
/// What is kept before the scene's start and after its end, in s, for the resampler to look at.
const AROUND_S: f64 = 3.0;
pub(super) const EVERYWHERE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);
const PIN_VOLTS: std::ops::RangeInclusive<f64> = -0.3..=4.0;
/// What of them the ADC converts, with a little slack for what is scaled to just that.
const ADC_VOLTS: std::ops::RangeInclusive<f64> = -1e-6..=2.0 * MID_RAIL_VOLTS + 1e-6;

const TIME: Words = Words {
    column: "time",
    scale: "time_s_per_unit",
    every: "rate_hz",
    default: "t_s",
};
const LENGTH: Words = Words {
    column: "place",
    scale: "place_mm_per_unit",
    every: "mm_per_sample",
    default: "x_mm",
};

/// Whether rows lie on straight lines, as between rows of a table, or are samples of something band-limited;
/// none if nothing is said of it.
fn on_lines(table: &mut Table<'_>) -> Result<Option<bool>, SceneError> {
    let words = [("band-limited", false), ("lines", true)];
    let lines = table.choice("interpolation", &words)?;
    Ok(table.contains("interpolation").then_some(lines))
}

/// The voltages of `[gauges]`: five columns or six, band-limited and laid on the native engine's instants unless they
/// lie on lines. `tangential` is the key of that name. `notes` tell of what the ADC clips.
pub(super) fn gauges(
    table: &mut Table<'_>,
    duration_s: f64,
    tangential: Option<bool>,
    notes: &mut Vec<SceneError>,
) -> Result<Arc<Waveform>, SceneError> {
    let headers = ["t_s,g0,g1,g2,g3,g4", "t_s,g0,g1,g2,g3,g4,tangential"];
    let source = Source::of(table, &TIME, &headers)?;
    let start_s = table.number("start_s")?.unwrap_or(0.0);
    let scale = table.number("volts_per_unit")?;
    let offset_v = table.number("offset_v")?;
    let lines = on_lines(table)?;
    let filtered = table.boolean("filtered")? == Some(true);
    let is_own = source.is_plain() || source.topic_or(GAUGE_TOPIC) == Some(GAUGE_TOPIC);
    let conversion = Conversion {
        shift: -start_s,
        scale: scale.unwrap_or(1.0),
        offset: offset_v.unwrap_or(if is_own { 0.0 } else { MID_RAIL_VOLTS }),
    };
    let as_it_is = conversion.scale == 1.0 && conversion.offset == 0.0;
    let first_step_s = Cell::new(None);
    let check: Check<'_> = &|before, row| {
        let beyond = |&column: &usize| !PIN_VOLTS.contains(&row[column]);
        if let Some(column) = (1..row.len()).find(beyond) {
            let message = if as_it_is {
                "is no voltage that an ADC pin bears: give −0.3 to 4.0 V".to_owned()
            } else {
                format!(
                    "makes {:.3} V, which no ADC pin bears: give volts_per_unit and offset_v that keep it within −0.3 to 4.0 V",
                    row[column]
                )
            };
            return Err((column, message));
        }
        let Some(before) = before else { return Ok(()) };
        let step_s = row[0] - before[0];
        let first_s = first_step_s.get().unwrap_or(step_s);
        first_step_s.set(Some(first_s));
        if step_s <= DENSE_S {
            return Ok(());
        }
        if lines == Some(true) {
            let message = "comes more than 1 ms after the row before: give 1 kHz or more with interpolation = \"lines\"";
            return Err((0, message.to_owned()));
        }
        if step_s > 1.001 / SLOWEST_HZ {
            let message =
                "comes more than 5 ms after the row before: give 200 Hz or more, without gaps";
            return Err((0, message.to_owned()));
        }
        if step_s > GAP * first_s {
            let message = format!(
                "comes {:.3} ms after the row before, the second {:.3} ms after the first: rows that are more than 1 ms apart must come evenly: fill the gap or start behind it",
                1e3 * step_s,
                1e3 * first_s
            );
            return Err((0, message));
        }
        Ok(())
    };
    let columns = match (&source.format, &source.channels) {
        (_, Some(channels)) if channels.len() == GAUGES || channels.len() == GAUGES + 1 => {
            channels.clone()
        }
        (_, Some(channels)) => {
            let message = format!(
                "names {} channels: name one for each of the five gauges, the same several times if need be, and perhaps a sixth, the tangential force",
                channels.len()
            );
            return Err(table.refuse("channels", message));
        }
        (Format::Wav(wav), None) => match wav.channels() {
            1 => vec![Column::Numbered(0); GAUGES],
            count @ (5 | 6) => (0..count).map(Column::Numbered).collect(),
            count => {
                let message = format!(
                    "is missing: the file has {count} channels: say which are the five gauges', such as [0, 1, 0, 1, 0]"
                );
                return Err(table.refuse("channels", message));
            }
        },
        (Format::Mcap, None) if source.topic_or(GAUGE_TOPIC) == Some(GAUGE_TOPIC) => {
            let count = GAUGES + usize::from(tangential == Some(true));
            GAUGE_FIELDS[..count]
                .iter()
                .map(|name| Column::Named(name))
                .collect()
        }
        (Format::Mcap, None) => {
            return Err(table.refuse(
                "channels",
                "is missing: name the messages' fields for the five gauges",
            ));
        }
        // A texture is refused as a source of voltages.
        (Format::Csv(..) | Format::Hjif(_), None) => Vec::new(),
    };
    let window = (-AROUND_S, duration_s + AROUND_S);
    let own_time = (GAUGE_TOPIC, GAUGE_TIME);
    let (rows, extent) = source.read(table, columns, own_time, window, conversion, check)?;
    let per_unit = f64::from(SCAN_RATE_HZ);
    covers_time(table, extent, &rows, duration_s)?;
    let counted = GAUGES + usize::from(tangential != Some(false));
    if let Some(shares) = clipped_shares(&rows, duration_s, counted) {
        let give = match offset_v {
            None if !is_own => {
                "1.65 V is added: give offset_v = 0 if the file holds volts, else a smaller volts_per_unit"
            }
            _ => "give another volts_per_unit or offset_v, or record with less gain",
        };
        let key = match table.contains("channels") {
            true => "channels",
            false => "file",
        };
        let message = format!(
            "of the rows {shares} lie beyond the 0 to 3.3 V that the ADC converts, and are clipped: {give}"
        );
        notes.push(table.refuse(key, message));
    }
    let rows = if filtered {
        let is_sample = |step: &Even| (step.step - 1e-3).abs() < 1e-6;
        if lines.is_some() || Even::of(&rows.at).filter(is_sample).is_none() {
            let message = "the sensor's filter makes samples that are 1 ms apart: take it out, or give such, without interpolation";
            return Err(table.refuse("filtered", message));
        }
        inverse_filter::at_the_pins(&rows)
    } else {
        rows
    };
    if lines == Some(true) {
        return Ok(Arc::new(Waveform::on_lines(rows)));
    }
    let adc = Raster {
        per_unit,
        through_zero: true,
    };
    let laid = laid(table, rows, adc)?;
    // Written times are rounded: the raster knows better.
    let first = (laid.at[0] * per_unit).round() / per_unit;
    Ok(Arc::new(Waveform::band_limited(laid, first, per_unit)))
}

/// The positions of `[motion]`, one column.
pub(super) fn motion(
    table: &mut Table<'_>,
    duration_s: f64,
    headers: &[&str],
    check: Check<'_>,
) -> Result<Arc<Series>, SceneError> {
    let source = Source::of(table, &TIME, headers)?;
    let start_s = table.number("start_s")?.unwrap_or(0.0);
    let scale = table.number("mm_per_unit")?;
    let offset_mm = table.number("offset_mm")?;
    let own = source.topic_or(GAUGE_TOPIC) == Some(GAUGE_TOPIC);
    let named_by_us = own && source.channels.is_none();
    let columns = single(table, &source, named_by_us.then_some(ARM_FIELD))?;
    let conversion = Conversion {
        shift: -start_s,
        scale: scale.unwrap_or(if named_by_us { MM_PER_UM } else { 1.0 }),
        offset: offset_mm.unwrap_or(0.0),
    };
    let is_plain = source.is_plain();
    let own_time = (GAUGE_TOPIC, GAUGE_TIME);
    let (rows, extent) = source.read(table, columns, own_time, EVERYWHERE, conversion, check)?;
    covers_time(table, extent, &rows, duration_s)?;
    let per_unit = f64::from(SCAN_RATE_HZ);
    if is_plain || !is_denser(&rows, per_unit) {
        return Ok(Arc::new(rows));
    }
    let adc = Raster {
        per_unit,
        through_zero: true,
    };
    laid(table, rows, adc).map(Arc::new)
}

/// Of a surface: as fine as a profile is blurred, a million points.
const LONGEST_PROFILE_MM: f64 = 20_000.0;
/// Beyond any height in any unit, and far from what a number of 32 bits can't hold.
const HIGHEST: f64 = 1e12;

/// Whether a row of a profile can be of a surface.
fn check_height(_: Option<&[f64]>, row: &[f64]) -> Result<(), (usize, String)> {
    let place = Bounds::of("start_mm");
    if !place.allow(row[0]) {
        Err((0, format!("is out of reach: give {}", place.give)))
    } else if row[1].abs() > HIGHEST {
        Err((
            1,
            format!("is no height: give a number from -{HIGHEST:e} to {HIGHEST:e}"),
        ))
    } else {
        Ok(())
    }
}

/// The heights of `[surface]`, one column; or with `felt_per_unit` what is felt there.
pub(super) fn profile(table: &mut Table<'_>) -> Result<Profile, SceneError> {
    let source = Source::of(table, &LENGTH, &["x_mm,height"])?;
    let shift_mm = table.number("shift_mm")?.unwrap_or(0.0);
    let felt_per_unit = table.number("felt_per_unit")?;
    let profile = match felt_per_unit {
        None => Profile::Recorded,
        Some(_) => Profile::Felt,
    };
    let lines = on_lines(table)?;
    let columns = single(table, &source, None)?;
    let conversion = Conversion {
        shift: shift_mm,
        scale: felt_per_unit.unwrap_or(1.0),
        offset: 0.0,
    };
    let own = ("", ("", 1.0));
    let (rows, _) = source.read(table, columns, own, EVERYWHERE, conversion, &check_height)?;
    let (first, last) = rows.extent();
    if last - first > LONGEST_PROFILE_MM {
        let message = format!(
            "reaches over {:.3} m, a profile over at most {:.0}: give places in mm, or a part of it",
            (last - first) * 1e-3,
            LONGEST_PROFILE_MM * 1e-3
        );
        return Err(table.refuse("file", message));
    }
    // Coarser heights are points of a surface, not samples of a wave: straight lines make no ripples of an edge.
    if lines == Some(true) || !is_denser(&rows, GRID_MM.recip()) {
        return Ok(profile(Arc::new(rows)));
    }
    let grid = Raster {
        per_unit: GRID_MM.recip(),
        through_zero: false,
    };
    laid(table, rows, grid).map(|rows| profile(Arc::new(rows)))
}

/// The one column of a section that needs one.
fn single<'t>(
    table: &Table<'t>,
    source: &Source<'t>,
    own: Option<&'static str>,
) -> Result<Vec<Column<'t>>, SceneError> {
    match (&source.channels, &source.format, own) {
        (Some(channels), ..) if channels.len() == 1 => Ok(channels.clone()),
        (Some(channels), ..) => {
            let message = format!("names {} channels: name one", channels.len());
            Err(table.refuse("channels", message))
        }
        (None, Format::Csv(..), _) => Ok(Vec::new()),
        (None, Format::Wav(wav), _) if wav.channels() == 1 => Ok(vec![Column::Numbered(0)]),
        (None, Format::Hjif(file), _) => match file.texture().map(|texture| texture.channels()) {
            Ok([only]) => Ok(vec![Column::Numbered(only.id as usize)]),
            Ok(several) => {
                let names: Vec<String> = several
                    .iter()
                    .map(|channel| format!("{} ({:?})", channel.id, channel.description))
                    .collect();
                let message = format!(
                    "is missing: name one by its id or its description, of {}",
                    names.join(", ")
                );
                Err(table.refuse("channels", message))
            }
            Err(error) => Err(source.refuse(error)),
        },
        (None, Format::Mcap, Some(own)) => Ok(vec![Column::Named(own)]),
        (None, ..) => Err(table.refuse(
            "channels",
            "is missing: the file has several: name one, such as [0] or [\"height\"]",
        )),
    }
}

/// Whether rows lie closer to each other than the points of a raster.
fn is_denser(rows: &Series, per_unit: f64) -> bool {
    let (first, last) = rows.extent();
    (rows.at.len() - 1) as f64 > 1.01 * (last - first) * per_unit
}

fn laid(table: &Table<'_>, rows: Series, raster: Raster) -> Result<Series, SceneError> {
    let step = Even::of(&rows.at).map_or(f64::NAN, |even| even.step);
    match raster.lay(rows) {
        Some(series) => Ok(series),
        None => {
            let message = format!(
                "samples that are {step} apart cannot be brought to {} in one: resample the file",
                raster.per_unit
            );
            Err(table.refuse("file", message))
        }
    }
}

/// Of the rows within a scene, the share that the ADC clips, by gauge, where it is more than a tenth; of the first
/// `counted` columns.
fn clipped_shares(rows: &Series, duration_s: f64, counted: usize) -> Option<String> {
    const MOST: f64 = 0.1;
    let mut clipped = vec![0_usize; rows.width.min(counted)];
    let mut count = 0_usize;
    for (at_s, row) in rows.at.iter().zip(rows.values.chunks_exact(rows.width)) {
        if (0.0..=duration_s).contains(at_s) {
            count += 1;
            for (clipped, volts) in clipped.iter_mut().zip(row) {
                *clipped += usize::from(!ADC_VOLTS.contains(volts));
            }
        }
    }
    let told = clipped.iter().enumerate().filter_map(|(column, &clipped)| {
        let share = clipped as f64 / count as f64;
        let which = match column {
            GAUGES => "the tangential force".to_owned(),
            gauge => format!("gauge {gauge}"),
        };
        (share > MOST).then(|| format!("of {which} {:.0} %", 100.0 * share))
    });
    let told: Vec<String> = told.collect();
    (!told.is_empty()).then(|| told.join(", "))
}

/// Longest that the last row of a recording goes on, in s.
const LAST_ROW_S: f64 = 0.05;

/// A row goes on until the next one, the last one for as long as they are apart: 3 s at 1 kHz are 3 000 rows.
fn covers_time(
    table: &Table<'_>,
    (first, last): (f64, f64),
    kept: &Series,
    duration_s: f64,
) -> Result<(), SceneError> {
    // Of a long recording only what is about the scene is kept.
    let apart_s = match kept.at[..] {
        [from, .., to] => (to - from) / (kept.at.len() - 1) as f64,
        _ => 0.0,
    };
    // The last scan is one scan before the end, and a board's clock tells whole µs.
    let goes_on_s = apart_s.min(LAST_ROW_S) + 1.01 / f64::from(SCAN_RATE_HZ);
    if first <= 0.0 && last >= duration_s - goes_on_s {
        return Ok(());
    }
    let message = format!(
        "lasts from {first} to {last} s, the scene from 0 to {duration_s} s: give a longer file, a shorter duration_s, or start_s"
    );
    Err(table.refuse("file", message))
}
