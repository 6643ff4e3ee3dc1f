//! Whether partials and a random part carry more of a surface than λ alone, by what the actuators play.
//!
//! ```text
//! surface ─> arm at one speed ─> sensor ── Estimate, Texture ──> link's delay ──> display ─> volts y(t)
//!    └──────────────────────────────> under the hand at another speed: s(t) = surface(x(t) + δ) ──┐
//!                                                              coherence, spectral distance, limens
//! ```
//!
//! | what | how |
//! | --- | --- |
//! | coherence | share of the power of s in 5–200 Hz that is a linear function of y: Σ γ² S_ss / Σ S_ss by Welch's method, the chance of so few segments taken off |
//! | shift δ | the display's place begins anywhere, and nobody can feel where: the best of a wavelength |
//! | spectral distance | RMS over third octaves of 5–200 Hz of the two spectra's difference in dB, each over its own total, nothing below [`likeness::FLOOR_DB`] |
//! | told apart | by [`observer`] |
//!
//! Boards are the firmware's libraries, or its ELFs in one scene, in which arm and hand move alike. The random part cannot be coherent: where the remote surface has a grain, the
//! display has one of its own; only its spectrum is the surface's.

mod likeness;
mod observer;
mod picture;
pub mod recorded;
mod surfaces;

use std::f64::consts::TAU;
use std::ops::Range;

use firmware_display::{Display, Senses, Settings};
use hil_sim_boards::{ElfError, Firmwares};
use hil_sim_core::judge::mean;
use hil_sim_core::native;
use hil_sim_core::plant::motion::encoder;
use hil_sim_core::plant::surface;
use hil_sim_core::run::decoder::TimedMessage;
use hil_sim_core::run::observer::{RunEvent, RunObserver};
use hil_sim_core::run::recording::{Engine, volts};
use hil_sim_core::scene::{Gauges, Kinematic, Motion, Scene, SceneError};
use protocol::{DEFAULT_ACTUATORS, DisplayConfiguration, Message, Rendering, Role};
use realfft::num_complex::Complex;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::{seconds, through};
use crate::bench::BenchError;
use crate::study::{Progress, Record, Study, Table, csv, fixed, number, short};
use likeness::{THIRDS, TICKS_HZ, coherence, distance_db, segments, thirds_db};
use observer::{Pair, pairs};
use surfaces::{Ground, known, unseen};

/// How arm and hand move.
const SPEEDS: [(Stroke, Stroke); 2] = [
    (Stroke(60.0, 0.8), Stroke(40.0, 0.5)),
    (Stroke(30.0, 0.4), Stroke(80.0, 0.83)),
];
/// Delays of the link, one way.
const DELAYS_MS: [f64; 3] = [0.0, 100.0, 500.0];
const SNR_DB: f64 = 20.0;
/// The sensor rubs for so long, and the display's voltages are looked at from then on, until then.
const RUBS_S: f64 = 8.5;
const LOOKS_S: (f64, f64) = (4.0, 8.0);
const DRIFT_MM_S: f64 = 3.0;
const ROW_S: f64 = 1e-3;
/// What partials may cost of a family's coherence in the mean, what they have to give where there is no grain, and by how
/// many dB the random part may take a rough family's spectrum further away.
const GOAL_LOSS: f64 = 0.02;
const GOAL_COHERENCE: f64 = 0.95;
const GOAL_DB: f64 = 0.3;
const TICK_NS: u64 = 500_000;
/// Shifts of place that are tried.
const SHIFTS: usize = 48;

/// v = peak · sin 2π f t, and [`DRIFT_MM_S`] on top, so that no two strokes turn at the same place: mm/s and Hz.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stroke(f64, f64);

impl Stroke {
    fn motion(self) -> Motion {
        let rows = (RUBS_S / ROW_S) as u32;
        let at: Vec<f64> = (0..=rows).map(|row| f64::from(row) * ROW_S).collect();
        let values = at.iter().map(|&t_s| self.position_mm(t_s)).collect();
        through(at, values)
    }

    /// The speed at an instant over the highest.
    fn relative_speed(self, t_s: f64) -> f64 {
        (TAU * self.1 * t_s).sin().abs()
    }

    fn position_mm(self, t_s: f64) -> f64 {
        let swing_mm = self.0 / (TAU * self.1) * (1.0 - (TAU * self.1 * t_s).cos());
        swing_mm + DRIFT_MM_S * t_s
    }
}

#[derive(Clone, Debug)]
struct Row {
    surface: String,
    family: String,
    /// Whether nobody looked at it while this was made.
    unseen: bool,
    engine: Engine,
    speeds_mm_s: (f64, f64),
    delay_ms: f64,
    rendering: Rendering,
    /// Share of the surface's power that is coherent with what is played, 0 to 1.
    coherence: f64,
    distance_db: f64,
}

/// All that is measured: every surface, and pairs of surfaces of one λ.
#[derive(Clone, Debug)]
pub struct Measured {
    rows: Vec<Row>,
    pairs: Vec<Pair>,
}

/// A surface and how it is rubbed.
#[derive(Clone)]
struct Case {
    ground: Ground,
    arm: Stroke,
    hand: Stroke,
    seed: u64,
}

/// Measures everything, or a little of it.
pub fn measure(
    firmwares: &Firmwares,
    quick: bool,
    progress: &impl Progress,
) -> Result<Measured, BenchError> {
    let (cases, scenes) = (cases(quick), scenes(quick));
    progress.begin(cases.len() + scenes.len() + observer::runs(quick));
    let rows = progress.each(&cases, |case| rows(case, quick))?;
    let on_boards = progress.each(&scenes, |(case, rendering)| {
        row_on_boards(case, *rendering, firmwares)
    })?;
    Ok(Measured {
        rows: rows.into_iter().flatten().chain(on_boards).collect(),
        pairs: pairs(quick, progress)?,
    })
}

/// What is run on the ELFs: the surfaces that this was made with and every third unseen one, one speed for arm and hand, the
/// middle delay.
fn scenes(quick: bool) -> Vec<(Case, Rendering)> {
    let (arm, _) = SPEEDS[0];
    let grounds = known().into_iter().chain(unseen().into_iter().step_by(3));
    let grounds = grounds.take(if quick { 1 } else { usize::MAX });
    let case = |ground| Case {
        ground,
        arm,
        hand: arm,
        seed: 1,
    };
    let cases = grounds.map(case);
    cases
        .flat_map(|case| Rendering::ALL.map(|rendering| (case.clone(), rendering)))
        .collect()
}

fn row_on_boards(
    case: &Case,
    rendering: Rendering,
    firmwares: &Firmwares,
) -> Result<Row, ElfError> {
    let delay_ms = DELAYS_MS[1];
    let mut scene = scene(case);
    scene.link.delay_ms = delay_ms;
    scene.display.configuration.rendering = rendering;
    let (recording, _) = hil_sim_boards::run(&scene, firmwares)?;
    let mut edges = recording.outputs.iter().peekable();
    let mut held = 0.0;
    let played = ticks().map(|tick| {
        // The middle of what holds from one edge to the next.
        let at_ns = tick * TICK_NS + TICK_NS / 2;
        while let Some(edge) = edges.next_if(|edge| edge.at_ns <= at_ns) {
            held = volts(edge.words[0]);
        }
        held
    });
    let played: Vec<f64> = played.collect();
    let felt = UnderTheHand::of(case);
    Ok(row(case, Engine::Elf, rendering, delay_ms, &felt, &played))
}

fn row(
    case: &Case,
    engine: Engine,
    rendering: Rendering,
    delay_ms: f64,
    felt: &UnderTheHand,
    played: &[f64],
) -> Row {
    Row {
        surface: case.ground.name.clone(),
        family: case.ground.family.to_owned(),
        unseen: case.ground.unseen,
        engine,
        speeds_mm_s: (case.arm.0, case.hand.0),
        delay_ms,
        rendering,
        coherence: felt.coherence_at_best(played),
        distance_db: distance_db(&thirds_db(played), &felt.thirds_db),
    }
}

fn cases(quick: bool) -> Vec<Case> {
    let mut grounds = known();
    if quick {
        grounds.truncate(2);
    } else {
        grounds.extend(unseen());
    }
    let speeds = &SPEEDS[..if quick { 1 } else { 2 }];
    let of_ground = |ground: &Ground| {
        let case = |&(arm, hand)| Case {
            ground: ground.clone(),
            arm,
            hand,
            seed: 1,
        };
        speeds.iter().map(case).collect::<Vec<_>>()
    };
    grounds.iter().flat_map(of_ground).collect()
}

fn rows(case: &Case, quick: bool) -> Result<Vec<Row>, SceneError> {
    let (said, felt) = (said(&scene(case))?, UnderTheHand::of(case));
    let delays = if quick {
        &DELAYS_MS[..1]
    } else {
        &DELAYS_MS[..]
    };
    let mut rows = Vec::new();
    for &delay_ms in delays {
        for rendering in Rendering::ALL {
            let hand_mm = |t_s| case.hand.position_mm(t_s);
            let played = played(&said, hand_mm, &ticks(), rendering, delay_ms);
            let engine = Engine::Native;
            rows.push(row(case, engine, rendering, delay_ms, &felt, &played));
        }
    }
    Ok(rows)
}

/// What the sensor says of the surface.
#[derive(Default)]
struct Ear(Vec<TimedMessage>);

impl RunObserver for Ear {
    fn see(&mut self, event: RunEvent<'_>) {
        if let RunEvent::Said(Role::Sensor, said) = event
            && matches!(said.message, Message::Estimate(_) | Message::Texture(_))
        {
            self.0.push(said.clone());
        }
    }
}

fn said(scene: &Scene) -> Result<Vec<TimedMessage>, SceneError> {
    let mut ear = Ear::default();
    native::run_before(scene, &mut ear)?;
    Ok(ear.0)
}

fn scene(case: &Case) -> Scene {
    Scene {
        seed: case.seed,
        duration_s: RUBS_S,
        surface: case.ground.surface(),
        motion: case.arm.motion(),
        gauges: Gauges::Kinematic(Kinematic {
            snr_db: Some(SNR_DB),
            ..Kinematic::default()
        }),
        ..Scene::constant(case.ground.wavelength_mm, 50.0)
    }
}

/// The voltages of an actuator at each of the ticks that are looked at, under a hand that is at so many mm at an instant in s.
fn played(
    said: &[TimedMessage],
    hand_mm: impl Fn(f64) -> f64,
    looked_at: &Range<u64>,
    rendering: Rendering,
    delay_ms: f64,
) -> Vec<f64> {
    let configuration = DisplayConfiguration {
        rendering,
        ..DisplayConfiguration::DEFAULT
    };
    let settings =
        Settings::new(configuration, &DEFAULT_ACTUATORS).expect("the settings are in their ranges");
    let mut display = Display::new(&settings, None);
    display.started(Ok(()));
    let delay_ns = (delay_ms * 1e6) as u64;
    let mut due = said.iter().peekable();
    let mut played = Vec::new();
    for tick in 0..looked_at.end {
        let at_ns = tick * TICK_NS;
        while let Some(said) = due.next_if(|said| said.at_ns + delay_ns <= at_ns) {
            match &said.message {
                Message::Estimate(estimate) => display.on_estimate(estimate),
                Message::Texture(texture) => display.on_texture(texture),
                _ => {}
            }
        }
        display.tick(encoder(hand_mm(seconds(at_ns))), &Senses::default());
        if looked_at.contains(&tick) {
            played.push(volts(display.words()[0]));
        }
    }
    played
}

/// The ticks that are looked at.
fn ticks() -> Range<u64> {
    let (from_s, to_s) = LOOKS_S;
    (from_s * TICKS_HZ) as u64..(to_s * TICKS_HZ) as u64
}

/// What a point under the operator's hand would feel of the surface, at the ticks that are looked at.
struct UnderTheHand {
    thirds_db: [f64; THIRDS],
    /// Its segments, at each shift of place.
    shifted: Vec<Vec<Vec<Complex<f64>>>>,
}

impl UnderTheHand {
    fn of(case: &Case) -> Self {
        let surface = surface::Surface::new(&case.ground.surface(), 0.0);
        let felt = |shift_mm: f64| -> Vec<f64> {
            ticks()
                .map(|tick| case.hand.position_mm(tick as f64 / TICKS_HZ) + shift_mm)
                .map(|x_mm| f64::from(surface.feel(x_mm, 0)))
                .collect()
        };
        let shifts = (0..SHIFTS).map(|n| case.ground.wavelength_mm * n as f64 / SHIFTS as f64);
        Self {
            thirds_db: thirds_db(&felt(0.0)),
            shifted: shifts.map(|shift_mm| segments(&felt(shift_mm))).collect(),
        }
    }

    fn coherence_at_best(&self, played: &[f64]) -> f64 {
        let played = segments(played);
        let coherences = self.shifted.iter().map(|felt| coherence(felt, &played));
        coherences.fold(0.0, f64::max)
    }
}

/// Families in the order of their first row, the unseen ones last.
fn families(rows: &[Row]) -> Vec<&str> {
    let mut families = Vec::new();
    for row in rows {
        if !families.contains(&row.family.as_str()) {
            families.push(&row.family);
        }
    }
    families
}

/// Mean, least and largest of a family's rows of one rendering.
fn spread(
    rows: &[Row],
    engine: Engine,
    family: &str,
    rendering: Rendering,
    value: impl Fn(&Row) -> f64,
) -> Option<(f64, f64, f64)> {
    let values: Vec<f64> = rows
        .iter()
        .filter(|row| row.engine == engine && row.family == family && row.rendering == rendering)
        .map(value)
        .collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let least = values.iter().copied().reduce(f64::min)?;
    let most = values.iter().copied().reduce(f64::max)?;
    Some((mean, least, most))
}

/// What a rendering gains of a family's coherence over the fundamental alone: the mean over its surfaces, with the interval
/// that holds 95 % of such means where there are more than two.
fn gained(rows: &[Row], engine: Engine, family: &str, rendering: Rendering) -> String {
    if rendering == Rendering::Fundamental {
        return "–".to_owned();
    }
    let of = |surface: &str, rendering| {
        let rows = rows.iter().filter(|row| {
            row.engine == engine
                && row.family == family
                && row.surface == surface
                && row.rendering == rendering
        });
        mean(rows.map(|row| row.coherence))
    };
    let mut surfaces: Vec<&str> = Vec::new();
    for row in rows
        .iter()
        .filter(|row| row.family == family && row.engine == engine)
    {
        if !surfaces.contains(&row.surface.as_str()) {
            surfaces.push(&row.surface);
        }
    }
    let gains: Vec<f64> = surfaces
        .iter()
        .filter_map(|surface| Some(of(surface, rendering)? - of(surface, Rendering::Fundamental)?))
        .collect();
    let Some(middle) = mean(gains.iter().copied()) else {
        return "–".to_owned();
    };
    let count = gains.len() as f64;
    if gains.len() < 3 {
        return number(middle, 2);
    }
    let square: f64 = gains.iter().map(|gain| (gain - middle).powi(2)).sum();
    let deviation = (square / (count - 1.0) / count).sqrt();
    let Ok(student) = StudentsT::new(0.0, 1.0, count - 1.0) else {
        return number(middle, 2);
    };
    let half = student.inverse_cdf(0.975) * deviation;
    let [low, high] = [middle - half, middle + half].map(|end| number(end, 2));
    format!("{} ({low} to {high})", number(middle, 2))
}

/// Whether a family is played the better the more of it is: partials cost no coherence, where there is no grain they give
/// nearly all of it, and where there is one the random part brings the spectrum no further away. Its own ridges are not the
/// surface's, and so it costs coherence: no more than the partials have gained. Of what is not played at all nothing is
/// carried.
fn is_carried(rows: &[Row], engine: Engine, family: &str, has_grain: bool) -> bool {
    let of = |value: fn(&Row) -> f64| {
        Rendering::ALL.map(|rendering| spread(rows, engine, family, rendering, value))
    };
    let ([Some(fundamental), Some(shape), Some(texture)], [_, Some(plain), Some(rough)]) =
        (of(|row| row.coherence), of(|row| row.distance_db))
    else {
        // Not every family is run on the ELFs.
        return engine == Engine::Elf;
    };
    fundamental.0 > 0.0
        && shape.0 >= fundamental.0 - GOAL_LOSS
        && texture.0 >= fundamental.0 - GOAL_LOSS
        && (has_grain || shape.0 >= GOAL_COHERENCE)
        && (!has_grain || rough.0 <= plain.0 + GOAL_DB)
}

impl Study for Measured {
    const NAME: &'static str = "texture";

    fn table(&self) -> Option<Table> {
        const HEADS: [&str; 7] = [
            "surfaces",
            "engine",
            "rendering",
            "coherence:",
            "least to most:",
            "gained (95 % of means):",
            "spectral distance, dB:",
        ];
        let mut rows = Vec::new();
        let mut add = |cells: [String; 7]| rows.push(Record::of(&HEADS, cells));
        for family in families(&self.rows) {
            for engine in [Engine::Native, Engine::Elf] {
                for rendering in Rendering::ALL {
                    let of = |value: fn(&Row) -> f64| {
                        spread(&self.rows, engine, family, rendering, value)
                    };
                    let measured = of(|row| row.coherence).zip(of(|row| row.distance_db));
                    let Some(((mean, least, most), (distance, ..))) = measured else {
                        continue;
                    };
                    let range = format!("{least:.2} to {most:.2}");
                    let gain = gained(&self.rows, engine, family, rendering);
                    let [family, engine, word] =
                        [family, engine.name(), rendering.name()].map(str::to_owned);
                    let (mean, distance) = (number(mean, 2), number(distance, 1));
                    add([family, engine, word, mean, range, gain, distance]);
                }
            }
        }
        for pair in &self.pairs {
            for (rendering, answer) in Rendering::ALL.iter().zip(&pair.answers) {
                let [right, low, high] =
                    [answer.right, answer.interval.low, answer.interval.high].map(|x| 100.0 * x);
                add([
                    format!("{} or {}", pair.one, pair.other),
                    Engine::Native.name().to_owned(),
                    rendering.name().to_owned(),
                    format!("told apart {right:.0} %"),
                    format!("{low:.0} to {high:.0} %"),
                    "–".to_owned(),
                    "–".to_owned(),
                ]);
            }
        }
        Some(rows.into_iter().collect())
    }

    fn csvs(&self) -> Vec<(&'static str, String)> {
        let rows = self.rows.iter().map(|row| {
            Record::default()
                .with("surface", &*row.surface)
                .with("family", &*row.family)
                .with("unseen", short(row.unseen))
                .with("engine", row.engine.name())
                .with("arm_mm_s", short(row.speeds_mm_s.0))
                .with("hand_mm_s", short(row.speeds_mm_s.1))
                .with("delay_ms", short(row.delay_ms))
                .with("rendering", row.rendering.name())
                .with("coherence", fixed(row.coherence, 3))
                .with("distance_db", fixed(row.distance_db, 2))
        });
        vec![("", csv(rows)), ("-pairs", observer::csv_of(&self.pairs))]
    }

    fn picture(&self) -> String {
        picture::draw(self)
    }

    fn is_met(&self) -> bool {
        let is_carried =
            |family: &str, engine| is_carried(&self.rows, engine, family, family.contains("rough"));
        let mut families = families(&self.rows).into_iter();
        families.all(|of| is_carried(of, Engine::Native) && is_carried(of, Engine::Elf))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gain_is_the_mean_over_surfaces_with_students_interval() {
        let row = |surface: &str, rendering, coherence| Row {
            surface: surface.to_owned(),
            family: "unseen".to_owned(),
            unseen: true,
            engine: Engine::Native,
            speeds_mm_s: (60.0, 40.0),
            delay_ms: 0.0,
            rendering,
            coherence,
            distance_db: 0.0,
        };
        let mut rows = Vec::new();
        for (surface, gain) in [("one", 0.1), ("other", 0.2)] {
            for shift in [-0.05, 0.05] {
                rows.push(row(surface, Rendering::Fundamental, 0.5 + shift));
                rows.push(row(surface, Rendering::Shape, 0.5 + gain + shift));
            }
        }
        let gained = |rows: &[Row], rendering| gained(rows, Engine::Native, "unseen", rendering);
        assert_eq!(gained(&rows, Rendering::Shape), "0.15");
        assert_eq!(gained(&rows, Rendering::Fundamental), "–");
        assert_eq!(gained(&rows, Rendering::Texture), "–");
        rows.push(row("third", Rendering::Fundamental, 0.5));
        rows.push(row("third", Rendering::Shape, 0.8));
        // 0.1, 0.2, 0.3: a deviation of the mean of 0.0577, times 4.303.
        assert_eq!(gained(&rows, Rendering::Shape), "0.20 (-0.05 to 0.45)");
    }

    #[test]
    fn a_family_that_partials_make_worse_or_the_random_part_misses_is_not_carried() {
        let rows = |family: &'static str, coherences: [f64; 3], distances: [f64; 3]| -> Vec<Row> {
            (0..3)
                .map(|at| Row {
                    surface: String::new(),
                    family: family.to_owned(),
                    unseen: false,
                    engine: Engine::Native,
                    speeds_mm_s: (60.0, 40.0),
                    delay_ms: 0.0,
                    rendering: Rendering::ALL[at],
                    coherence: coherences[at],
                    distance_db: distances[at],
                })
                .collect()
        };
        for (family, coherences, distances, expected) in [
            ("weave", [0.75, 0.98, 0.98], [8.0, 1.0, 1.0], true),
            ("weave", [0.75, 0.90, 0.98], [8.0, 1.0, 1.0], false),
            ("rough", [0.75, 0.85, 0.80], [6.0, 3.0, 1.5], true),
            ("rough", [0.75, 0.70, 0.80], [6.0, 3.0, 1.5], false),
            ("rough", [0.75, 0.85, 0.70], [6.0, 3.0, 1.5], false),
            ("rough", [0.75, 0.85, 0.80], [6.0, 3.0, 3.5], false),
            ("rough", [0.0; 3], [16.4; 3], false),
        ] {
            let rows = rows(family, coherences, distances);
            let has_grain = family == "rough";
            let carried = is_carried(&rows, Engine::Native, family, has_grain);
            assert_eq!(carried, expected, "{family} {coherences:?}");
            assert!(is_carried(&rows, Engine::Elf, family, has_grain), "not run");
        }
    }
}
