//! The picture: coherence and spectral distance by family, and pairs of surfaces told apart, each rendering beside the
//! others.

use super::{Measured, Row, families, spread};
use hil_sim_core::run::recording::Engine;
use protocol::Rendering;

use crate::output::plot::palette::{BLUE, GREEN, SOFT, VERMILION};
use crate::output::plot::{Axis, Key, Mark, Page, Panel, Shape, Stroke, Symbol};

const SYMBOLS: [Symbol; 3] = [
    Symbol::new(VERMILION, Shape::Square),
    Symbol::new(BLUE, Shape::Circle),
    Symbol::new(GREEN, Shape::Up),
];
const SPREAD: Stroke = Stroke::new(SOFT, 1.2);
const HEIGHT: f64 = 220.0;
/// The axis of distances goes up to so much, or further, in such steps.
const LEAST_TOP_DB: f64 = 12.0;
const STEP_DB: f64 = 2.0;

pub fn draw(measured: &Measured) -> String {
    let Measured { rows, pairs } = measured;
    let mut page = Page::default();
    page.note(if pairs.is_empty() {
        "What the actuators play against what recorded gauges felt at the hand’s place, 5–200 Hz; the hand as fast as the \
         arm, and faster. Symbols: means; lines: least to most. Firmware libraries."
    } else {
        "What the actuators play against the surface under the operator’s hand, 5–200 Hz; arm and hand at different \
         speeds. Symbols: means; lines: least to most. Firmware libraries; simulated observer."
    });
    let keys = [0, 1, 2].map(|at| (Key::Symbol(SYMBOLS[at]), Rendering::ALL[at].name()));
    page.legend(&keys);
    let families = families(rows);
    let by_family = places(families.iter().map(|&name| name.to_owned()));
    let of_family = |value: fn(&Row) -> f64| {
        marks(families.len(), |place, at| {
            let rendering = Rendering::ALL[at];
            spread(rows, Engine::Native, families[place], rendering, value)
        })
    };
    let furthest_db = rows.iter().map(|row| row.distance_db);
    let top_db = furthest_db.fold(LEAST_TOP_DB, f64::max);
    let top_db = (top_db / STEP_DB).ceil() * STEP_DB;
    let (share, db) = (
        Axis::even(0.0, 1.0, 0.2, ""),
        Axis::even(0.0, top_db, STEP_DB, ""),
    );
    let coherence = "coherence with the surface, share of its power";
    let mut panels = vec![
        Panel::new(coherence, &by_family, &share).with(of_family(|row| row.coherence)),
        Panel::new("distance of the spectra, dB", &by_family, &db)
            .with(of_family(|row| row.distance_db)),
    ];
    if !pairs.is_empty() {
        let names = pairs.iter().map(|of| format!("{} / {}", of.one, of.other));
        let told_apart = Panel::new(
            "pairs of 2 mm told apart, share of choices",
            &places(names),
            &Axis::even(0.5, 1.0, 0.1, ""),
        );
        panels.push(told_apart.with(marks(pairs.len(), |place, at| {
            let answer = pairs[place].answers.get(at)?;
            Some((answer.right, answer.interval.low, answer.interval.high))
        })));
    }
    page.panels(1, &vec![HEIGHT; panels.len()], &panels);
    page.finish()
}

/// An axis with a name at each whole number.
fn places(names: impl Iterator<Item = String>) -> Axis {
    let ticks: Vec<(f64, String)> = (0..).map(f64::from).zip(names).collect();
    Axis::named("", -0.5..ticks.len() as f64 - 0.5, ticks)
}

/// Symbols and spreads of the renderings beside each other at each place.
fn marks(count: usize, value: impl Fn(usize, usize) -> Option<(f64, f64, f64)>) -> Vec<Mark> {
    let mut marks = Vec::new();
    for (rendering, symbol) in SYMBOLS.into_iter().enumerate() {
        for place in 0..count {
            let x = place as f64 + 0.2 * (rendering as f64 - 1.0);
            if let Some((mean, least, most)) = value(place, rendering) {
                marks.push(Mark::Segments(SPREAD, vec![((x, least), (x, most))]));
                marks.push(Mark::symbol(symbol, (x, mean)));
            }
        }
    }
    marks
}

#[cfg(test)]
mod tests {
    use super::super::observer::{Answer, Pair};
    use super::super::surfaces;
    use super::*;
    use crate::psychophysics::interval::Interval;

    #[test]
    fn the_texts_stay_within_the_picture() {
        let rows = surfaces::known()
            .into_iter()
            .chain(surfaces::unseen())
            .flat_map(|ground| {
                Rendering::ALL.map(|rendering| Row {
                    surface: ground.name.clone(),
                    family: ground.family.to_owned(),
                    unseen: ground.unseen,
                    engine: Engine::Native,
                    speeds_mm_s: (60.0, 40.0),
                    delay_ms: 0.0,
                    rendering,
                    coherence: 0.5,
                    distance_db: 7.0,
                })
            })
            .collect();
        let answers = vec![
            Answer {
                right: 0.7,
                interval: Interval {
                    low: 0.6,
                    high: 0.8,
                },
            };
            3
        ];
        let pairs = vec![
            Pair {
                one: "rough weave".to_owned(),
                other: "narrow ridges".to_owned(),
                answers,
            };
            6
        ];
        crate::output::plot::tests::assert_fits("texture", &draw(&Measured { rows, pairs }));
    }
}
