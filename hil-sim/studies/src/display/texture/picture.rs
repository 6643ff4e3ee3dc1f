//! The picture: coherence and spectral distance by family, and pairs of surfaces told apart, each rendering beside the
//! others.

use super::{Measured, RENDERINGS, families, spread, word};
use hil_sim_core::run::recording::Engine;

use crate::output::plot::axis::Axis;
use crate::output::plot::mark::Mark;
use crate::output::plot::page::{Key, Page};
use crate::output::plot::palette::{BLUE, GREEN, SOFT, VERMILION};
use crate::output::plot::panel::Panel;
use crate::output::plot::svg::{Shape, Stroke, Symbol};

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

/// Draws it.
pub fn draw(measured: &Measured) -> String {
    let mut page = Page::default();
    page.note(if measured.pairs.is_empty() {
        "What the actuators play against what recorded gauges felt at the hand’s place, 5–200 Hz; the hand as fast as the \
         arm, and faster. Symbols: means; lines: least to most. Firmware libraries."
    } else {
        "What the actuators play against the surface under the operator’s hand, 5–200 Hz; arm and hand at different \
         speeds. Symbols: means; lines: least to most. Firmware libraries; simulated observer."
    });
    let keys = RENDERINGS
        .iter()
        .zip(SYMBOLS)
        .map(|(rendering, symbol)| (Key::Symbol(symbol), word(*rendering)))
        .collect::<Vec<_>>();
    page.legend(&keys);
    let families = families(&measured.rows);
    let names: Vec<String> = families.iter().map(|&name| name.to_owned()).collect();
    let by_family = |value: fn(&super::Row) -> f64| {
        marks(families.len(), |place, rendering| {
            spread(
                &measured.rows,
                Engine::Native,
                families[place],
                RENDERINGS[rendering],
                value,
            )
        })
    };
    let pairs = marks(measured.pairs.len(), |place, rendering| {
        let answer = measured.pairs[place].answers.get(rendering)?;
        Some((answer.right, answer.interval.low, answer.interval.high))
    });
    let labels: Vec<String> = measured
        .pairs
        .iter()
        .map(|pair| format!("{} / {}", pair.one, pair.other))
        .collect();
    let furthest_db = measured.rows.iter().map(|row| row.distance_db);
    let top_db = furthest_db.fold(LEAST_TOP_DB, f64::max);
    let top_db = (top_db / STEP_DB).ceil() * STEP_DB;
    let mut panels = vec![
        Panel::new(
            "coherence with the surface, share of its power",
            &places(&names),
            &Axis::even(0.0, 1.0, 0.2, ""),
        )
        .with(by_family(|row| row.coherence)),
        Panel::new(
            "distance of the spectra, dB",
            &places(&names),
            &Axis::even(0.0, top_db, STEP_DB, ""),
        )
        .with(by_family(|row| row.distance_db)),
    ];
    if !measured.pairs.is_empty() {
        let told_apart = Panel::new(
            "pairs of 2 mm told apart, share of choices",
            &places(&labels),
            &Axis::even(0.5, 1.0, 0.1, ""),
        );
        panels.push(told_apart.with(pairs));
    }
    page.panels(1, &vec![HEIGHT; panels.len()], &panels);
    page.finish()
}

/// An axis with a name at each whole number.
fn places(names: &[String]) -> Axis {
    let ticks = (0..)
        .map(f64::from)
        .zip(names.iter().cloned())
        .collect::<Vec<_>>();
    Axis::named("", -0.5..names.len() as f64 - 0.5, ticks)
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
    use super::super::{Row, surfaces};
    use super::*;
    use crate::psychophysics::interval::Interval;

    #[test]
    fn the_texts_stay_within_the_picture() {
        let rows = surfaces::known()
            .into_iter()
            .chain(surfaces::unseen())
            .flat_map(|ground| {
                RENDERINGS.map(|rendering| Row {
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
        crate::output::plot::fits::assert_fits("texture", &draw(&Measured { rows, pairs }));
    }
}
