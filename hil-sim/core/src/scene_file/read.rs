//! From TOML to a checked [`Scene`], section by section.

use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

use protocol::{GAUGES, Method};
use toml::de::DeValue;

use super::bounds::Bounds;
use super::contact;
use super::contact::Scenery;
use super::csv_rows::quoted;
use super::display;
use super::table::{Source, Table};
use super::{fault, read_bytes, recorded};
use crate::plant::gauges::PLACES_MM;
use crate::scene::Series;
use crate::scene::{
    ArmDrive, Contact, Estimator, Expect, Follows, Force, Gauges, Irregularity, Kinematic, Link,
    Motion, Profile, Resonance, Scene, SceneError, Specimen, Stiffness, Surface,
};

pub(super) fn read(path: &Path, text: &str) -> Result<Scene, SceneError> {
    let source = Source::new(path, text);
    let document = source.parse()?;
    let mut root = Table::root(&source, &document);

    let name = name(&mut root, path)?;
    let seed = root.whole("seed", 0, i64::MAX as u64)?.unwrap_or(1);
    let duration_s = root.number("duration_s")?.unwrap_or(3.0);
    let surface = surface(root.table("surface")?, seed)?;
    let motion = motion(root.table("motion")?, duration_s)?;
    let arm = arm(root.table("arm")?)?;
    let mut notes = Vec::new();
    let (gauges, force) = gauges(root.table("gauges")?, duration_s, &mut notes)?;
    let (contact, contact_reason) = match &gauges {
        Gauges::Kinematic(_) => contact::read(
            root.table("contact")?,
            &Scenery {
                surface: &surface,
                motion: &motion,
                gauges: &gauges,
                stiffness_n_per_m: force.stiffness_n_per_m,
            },
        )?,
        Gauges::Recorded(_) => {
            if contact::is_given(root.table("contact")?)? {
                return Err(root.refuse(
                    "contact",
                    "does not apply to recorded gauges: take [contact] out",
                ));
            }
            (Contact::KINEMATIC, None)
        }
    };
    let link = link(root.table("link")?)?;
    let estimator = estimator(root.table("estimator")?, &force, &mut notes)?;
    let display = display::read(root.table("display")?)?;
    let faults = fault::read(root.tables("fault")?, duration_s)?;
    let expect = expect(root.table("expect")?)?;
    if let Profile::Recorded(heights) | Profile::Felt(heights) = &surface.profile {
        covers_travel(&root, heights, &motion, duration_s)?;
    }
    root.finish("")?;
    Ok(Scene {
        name,
        seed,
        duration_s,
        surface,
        motion,
        arm,
        contact,
        contact_reason,
        gauges,
        force,
        link,
        estimator,
        display,
        faults,
        expect,
        notes,
    })
}

/// Of a scene's name, in letters.
const LONGEST_NAME: usize = 64;

fn name(root: &mut Table<'_>, path: &Path) -> Result<String, SceneError> {
    let fits = |letter: char| letter.is_ascii_alphanumeric() || "._-".contains(letter);
    let Some(name) = root.text("name")? else {
        // A file may be called otherwise.
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let stem = stem.trim_start_matches('.').chars().take(LONGEST_NAME);
        let name: String = stem
            .map(|letter| if fits(letter) { letter } else { '_' })
            .collect();
        return Ok(if name.is_empty() {
            "_".to_owned()
        } else {
            name
        });
    };
    let is_usable = (1..=LONGEST_NAME).contains(&name.len())
        && !name.starts_with('.')
        && name.chars().all(fits);
    if is_usable {
        Ok(name.to_owned())
    } else {
        Err(root.refuse(
            "name",
            format!("{} cannot name a file everywhere: give 1 to {LONGEST_NAME} of A–Z a–z 0–9 . _ - without a dot in front", quoted(name)),
        ))
    }
}

fn surface(mut table: Table<'_>, seed: u64) -> Result<Surface, SceneError> {
    let mut specimens = Vec::new();
    let rows = table.tables("specimens")?;
    let last = rows.len().saturating_sub(1);
    for (index, mut row) in rows.into_iter().enumerate() {
        let wavelength_mm = row.needed_number("wavelength_mm")?;
        let length_mm = row.number("length_mm")?;
        let length_mm = match length_mm {
            _ if index == last => f64::INFINITY,
            Some(length_mm) => length_mm,
            None => {
                return Err(row.refuse(
                    "length_mm",
                    "is missing: all but the last specimen need one",
                ));
            }
        };
        row.finish("")?;
        specimens.push(Specimen {
            wavelength_mm,
            length_mm,
        });
    }
    if specimens.is_empty() {
        return Err(table.refuse(
            "specimens",
            "there are none: give one or more, such as [{ wavelength_mm = 2.0 }]",
        ));
    }
    let start_mm = table.number("start_mm")?.unwrap_or(0.0);
    let kind = table.choice(
        "profile",
        &[("trapezoid", 't'), ("sine", 's'), ("recorded", 'r')],
    )?;
    let profile = match kind {
        't' => Profile::Trapezoid,
        's' => Profile::Sine,
        _ => recorded::profile(&mut table)?,
    };
    let irregularity = match kind {
        'r' => Irregularity::NONE,
        _ => irregularity(&mut table, seed)?,
    };
    table.finish(if kind == 'r' {
        " with profile = \"recorded\""
    } else {
        " unless profile = \"recorded\""
    })?;
    Ok(Surface {
        specimens,
        start_mm,
        profile,
        irregularity,
    })
}

fn irregularity(table: &mut Table<'_>, seed: u64) -> Result<Irregularity, SceneError> {
    let none = Irregularity::NONE;
    let second_wave = table.number("second_wave")?;
    let second_ratio = table.number("second_ratio")?;
    if second_ratio.is_some() && second_wave.is_none() {
        return Err(table.refuse(
            "second_ratio",
            "there is no second wave: give second_wave too",
        ));
    }
    Ok(Irregularity {
        random: table.number("random")?.unwrap_or(none.random),
        second_wave: second_wave.unwrap_or(none.second_wave),
        second_ratio: second_ratio.unwrap_or(none.second_ratio),
        worn: table.number("worn")?.unwrap_or(none.worn),
        seed,
    })
}

/// Columns of a recorded hand.
const POSITIONS: &[&str] = &["t_s,x_mm"];

/// Whether a hand can have come from one row to the next.
fn check_position(before: Option<&[f64]>, row: &[f64]) -> Result<(), (usize, String)> {
    let place = Bounds::of("start_mm");
    if !place.allow(row[1]) {
        return Err((1, format!("is out of reach: give {}", place.give)));
    }
    let Some(before) = before else { return Ok(()) };
    let speed_mm_s = (row[1] - before[1]) / (row[0] - before[0]);
    if Bounds::of("speed_mm_s").allow(speed_mm_s) {
        Ok(())
    } else {
        Err((
            1,
            format!("is {speed_mm_s:.0} mm/s from the row before: no hand is faster than 1000"),
        ))
    }
}

impl Motion {
    /// Reads a recorded hand from a CSV file with the columns `t_s,x_mm`.
    ///
    /// # Errors
    /// If it can't be read, or is no hand's.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        let bytes = read_bytes(path).map_err(|error| {
            let message = "give a CSV file with the columns t_s,x_mm";
            SceneError::of(
                path.display(),
                "",
                format!("cannot be read: {error}: {message}"),
            )
        })?;
        let positions = Series::read(path, &bytes, POSITIONS, &check_position)?;
        Ok(Self::Recorded(Arc::new(positions)))
    }
}

fn motion(mut table: Table<'_>, duration_s: f64) -> Result<Motion, SceneError> {
    match table.choice(
        "kind",
        &[("constant", 'c'), ("sinusoid", 's'), ("recorded", 'r')],
    )? {
        'c' => {
            let speed_mm_s = table.number("speed_mm_s")?.unwrap_or(50.0);
            table.finish(" with kind = \"constant\"")?;
            Ok(Motion::Constant { speed_mm_s })
        }
        's' => {
            let amplitude_mm_s = table.needed_number("amplitude_mm_s")?;
            let frequency_hz = table.needed_number("frequency_hz")?;
            let swing_mm = amplitude_mm_s / (TAU * frequency_hz);
            let place = Bounds::of("start_mm");
            if !place.allow(swing_mm) {
                let message = format!(
                    "at this amplitude a stroke is out of reach: give more, so that amplitude_mm_s / (2π · frequency_hz) is {}",
                    place.give
                );
                return Err(table.refuse("frequency_hz", message));
            }
            table.finish(" with kind = \"sinusoid\"")?;
            Ok(Motion::Sinusoid {
                amplitude_mm_s,
                frequency_hz,
            })
        }
        _ => {
            let positions = recorded::motion(&mut table, duration_s, POSITIONS, &check_position)?;
            table.finish(" with kind = \"recorded\"")?;
            Ok(Motion::Recorded(positions))
        }
    }
}

fn arm(mut table: Table<'_>) -> Result<ArmDrive, SceneError> {
    let follows = table.choice(
        "follows",
        &[("motion", Follows::Motion), ("link", Follows::Link)],
    )?;
    let lag_ms = table.number("lag_ms")?.unwrap_or(0.0);
    if lag_ms > 0.0 && follows == Follows::Motion {
        return Err(table.refuse(
            "lag_ms",
            "an arm that follows \"motion\" has no lag: give follows = \"link\"",
        ));
    }
    let encoder_um = table
        .number("encoder_um")?
        .map_or(ArmDrive::default().encoder_um, |um| um as u16);
    table.finish("")?;
    Ok(ArmDrive {
        follows,
        lag_ms,
        encoder_um,
    })
}

/// Keys of gauges that are not recorded, of which 0 or an empty list is nothing.
const NOISE: [&str; 13] = [
    "hum_50_hz",
    "hum_60_hz",
    "hum_off_hz",
    "second_harmonic",
    "dead",
    "saturated",
    "stuck",
    "noisy",
    "humming",
    "pink",
    "drift",
    "offset",
    "skew_us",
];

fn gauges(
    mut table: Table<'_>,
    duration_s: f64,
    notes: &mut Vec<SceneError>,
) -> Result<(Gauges, Force), SceneError> {
    let kind = table.choice("kind", &[("kinematic", 'k'), ("recorded", 'r')])?;
    let tangential = table.boolean("tangential")?;
    let defaults = Force::default();
    let force = Force {
        present: tangential.unwrap_or(defaults.present),
        n_per_v: table
            .number("tangential_n_per_v")?
            .unwrap_or(defaults.n_per_v),
        stiffness_n_per_m: table
            .number("stiffness_n_per_m")?
            .unwrap_or(defaults.stiffness_n_per_m),
    };
    if kind == 'k' {
        return Ok((Gauges::Kinematic(kinematic(table, duration_s)?), force));
    }
    let volts = recorded::gauges(&mut table, duration_s, tangential, notes)?;
    if tangential == Some(true) && volts.width() == 5 {
        return Err(table.refuse(
            "tangential",
            "true, but the file has no column of that name: add it, name a sixth channel, or give false",
        ));
    }
    table.let_pass(&NOISE, |value| match value {
        DeValue::Array(list) => list.is_empty(),
        DeValue::Integer(whole) => whole.as_str() == "0",
        DeValue::Float(number) => number.as_str().parse() == Ok(0.0),
        _ => false,
    });
    table.finish(" with kind = \"recorded\"")?;
    let present = tangential.unwrap_or(volts.width() == 6);
    Ok((Gauges::Recorded(volts), Force { present, ..force }))
}

fn kinematic(mut table: Table<'_>, duration_s: f64) -> Result<Kinematic, SceneError> {
    let resonance_hz = table.number("resonance_hz")?;
    let damping = table.number("resonance_damping")?;
    if damping.is_some() && resonance_hz.is_none() {
        return Err(table.refuse(
            "resonance_damping",
            "has nothing to damp: give resonance_hz too",
        ));
    }
    let trouble_for_s = table.number("trouble_for_s")?;
    let kinematic = Kinematic {
        snr_db: table.number("snr_db")?,
        hum_50_hz: table.number("hum_50_hz")?.unwrap_or(0.0),
        hum_60_hz: table.number("hum_60_hz")?.unwrap_or(0.0),
        hum_off_hz: table.number("hum_off_hz")?.unwrap_or(0.0),
        second_harmonic: table.number("second_harmonic")?.unwrap_or(0.0),
        dead: table.gauges("dead")?,
        saturated: table.gauges("saturated")?,
        stuck: table.gauges("stuck")?,
        noisy: table.gauges("noisy")?,
        humming: table.gauges("humming")?,
        trouble_from_s: table.number("trouble_from_s")?.unwrap_or(0.0),
        trouble_for_s,
        resonance: resonance_hz.map(|hz| Resonance {
            hz,
            damping: damping.unwrap_or(0.15),
        }),
        pink: table.number("pink")?.unwrap_or(0.0),
        drift: table.number("drift")?.unwrap_or(0.0),
        offset: table.number("offset")?.unwrap_or(0.0),
        skew_us: table.number("skew_us")?.unwrap_or(0.0),
    };
    let lists = [
        ("dead", kinematic.dead),
        ("saturated", kinematic.saturated),
        ("stuck", kinematic.stuck),
        ("noisy", kinematic.noisy),
        ("humming", kinematic.humming),
    ];
    for (index, (key, list)) in lists.iter().enumerate() {
        for (earlier, other) in &lists[..index] {
            if let Some(gauge) = (0..list.len()).find(|&gauge| list[gauge] && other[gauge]) {
                return Err(table.refuse(
                    key,
                    format!("gauge {gauge} is {earlier} already: name it in one list only"),
                ));
            }
        }
    }
    if trouble_for_s == Some(0.0) {
        return Err(table.refuse(
            "trouble_for_s",
            "no trouble lasts 0 s: give a time above 0, or take it out",
        ));
    }
    let healthy = lists.iter().all(|(_, list)| !list.contains(&true));
    for key in ["trouble_from_s", "trouble_for_s"] {
        if healthy && table.contains(key) {
            return Err(table.refuse(
                key,
                "there is no trouble: name gauges in dead, saturated, stuck, noisy or humming",
            ));
        }
    }
    if kinematic.trouble_from_s >= duration_s {
        let message = format!("comes after the scene's end at {duration_s} s: give less");
        return Err(table.refuse("trouble_from_s", message));
    }
    table.finish(" with kind = \"kinematic\"")?;
    Ok(kinematic)
}

fn link(mut table: Table<'_>) -> Result<Link, SceneError> {
    let link = Link {
        delay_ms: table.number("delay_ms")?.unwrap_or(0.0),
        jitter_ms: table.number("jitter_ms")?.unwrap_or(0.0),
        loss: table.number("loss")?.unwrap_or(0.0),
        reorder: table.number("reorder")?.unwrap_or(0.0),
        corrupt: table.number("corrupt")?.unwrap_or(0.0),
    };
    table.finish("")?;
    Ok(link)
}

/// What `[estimator] method = "bank"` is told.
const BANK_IS_SPECTRUM: &str = "method = \"bank\" is now \"spectrum\", its successor";
/// What knobs of the bank's are told.
const NO_KNOB: &str =
    "no longer does anything: take it out; \"spectrum\" has waves and valid_percent";

fn estimator(
    mut table: Table<'_>,
    force: &Force,
    notes: &mut Vec<SceneError>,
) -> Result<Estimator, SceneError> {
    let defaults = Estimator::default();
    let mut methods = vec![("default", defaults.method)];
    methods.extend(Method::ALL.map(|method| (method.name(), method)));
    let method = if table.text("method")? == Some("bank") {
        notes.push(table.refuse("method", BANK_IS_SPECTRUM));
        Method::Spectrum
    } else {
        table.choice("method", &methods)?
    };
    let window_ms = table.whole_or("window_ms", (10, 200), defaults.window_ms)?;
    let counted_gauge = table.whole_or(
        "counted_gauge",
        (0, GAUGES as u64 - 1),
        defaults.counted_gauge,
    )?;
    let named = table.gauges("gauges")?;
    let gauges = match (table.contains("gauges"), named) {
        (false, _) => defaults.gauges,
        (true, named) if named.contains(&true) => named,
        (true, _) => {
            return Err(table.refuse("gauges", "there are none: name one or more of 0 to 4"));
        }
    };
    let is_count = matches!(method, Method::Counting | Method::AdaptedCounting);
    if is_count && !gauges[usize::from(counted_gauge)] {
        let what = format!("gauge {counted_gauge} is not among gauges: its count is never valid");
        notes.push(table.refuse("counted_gauge", what));
    }
    let waves = table.whole_or("waves", (2, 8), defaults.waves)?;
    let valid_percent = table.whole_or("valid_percent", (50, 99), defaults.valid_percent)?;
    for key in ["travel_wavelengths", "candidates"] {
        if table.retired(key) {
            notes.push(table.refuse(key, NO_KNOB));
        }
    }
    let stiffness = table.choice(
        "stiffness",
        &[
            ("configured", Stiffness::Configured),
            ("estimated", Stiffness::Estimated),
        ],
    )?;
    if stiffness == Stiffness::Estimated && !force.present {
        return Err(table.refuse(
            "stiffness",
            "cannot be estimated without the force channel: give tangential = true in [gauges]",
        ));
    }
    table.finish("")?;
    Ok(Estimator {
        method,
        window_ms,
        counted_gauge,
        gauges,
        waves,
        valid_percent,
        stiffness,
    })
}

fn expect(mut table: Table<'_>) -> Result<Expect, SceneError> {
    let mean_mm = table.number("mean_mm")?;
    let mean_tolerance_mm = table.number("mean_tolerance_mm")?;
    if mean_tolerance_mm.is_some() && mean_mm.is_none() {
        return Err(table.refuse(
            "mean_tolerance_mm",
            "has nothing to bound: give mean_mm too",
        ));
    }
    let expect = Expect {
        wavelength_rms_percent: table.number("wavelength_rms_percent")?,
        wavelength_bias_percent: table.number("wavelength_bias_percent")?,
        mean_mm,
        mean_tolerance_mm: mean_tolerance_mm.unwrap_or(0.03),
        valid_share_min: table.number("valid_share_min")?,
        wrong_share_max: table.number("wrong_share_max")?,
        felt_right_share_min: table.number("felt_right_share_min")?,
        felt_wrong_share_max: table.number("felt_wrong_share_max")?,
        settling_ms: table.number("settling_ms")?,
        latency_ms: table.number("latency_ms")?,
        frequency_percent: table.number("frequency_percent")?,
        phase_rms_cycles: table.number("phase_rms_cycles")?,
    };
    table.finish("")?;
    Ok(expect)
}

fn covers_travel(
    root: &Table<'_>,
    heights: &Series,
    motion: &Motion,
    duration_s: f64,
) -> Result<(), SceneError> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for step in 0..=(duration_s * 1000.0).ceil() as u64 {
        let x_mm = motion.position_mm(step as f64 / 1000.0);
        (low, high) = (low.min(x_mm), high.max(x_mm));
    }
    let (low, high) = (low + PLACES_MM[0], high + PLACES_MM[PLACES_MM.len() - 1]);
    let (first, last) = heights.extent();
    if first <= low && last >= high {
        return Ok(());
    }
    let message = format!(
        "the profile lies from {first:.3} to {last:.3} mm, the gauges come from {low:.3} to {high:.3} mm: give a longer profile or a shorter travel"
    );
    Err(root.refuse("surface", message))
}
