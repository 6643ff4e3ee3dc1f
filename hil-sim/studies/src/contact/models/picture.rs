//! The picture: error over speed, a panel for each case.

use super::{Row, cases};
use crate::output::plot::palette::{
    BLUE, BROWN, GREEN, INK, ORANGE, PURPLE, SKY, SOFT, VERMILION, VIOLET,
};
use crate::output::plot::{Axis, Key, Mark, Panel, Shape, Stroke, Symbol, in_threes};
use hil_sim_core::scene::{ContactModel, Integrator};

/// Errors below are drawn there.
const LEAST_PERCENT: f64 = 1e-5;
/// How the speed of the reference is drawn.
const REFERENCE: Stroke = Stroke::new(SOFT, 1.2).dashed("4 3");

fn of_rung(rung: ContactModel) -> Symbol {
    let colour = match rung {
        ContactModel::Kinematic => SKY,
        ContactModel::Rigid => BLUE,
        ContactModel::Viscoelastic => GREEN,
        ContactModel::StickSlip => VERMILION,
        ContactModel::Reference => INK,
    };
    Symbol::new(colour, Shape::Circle)
}

fn of_integrator(integrator: Integrator) -> Symbol {
    let (colour, shape) = match integrator {
        Integrator::Euler => (PURPLE, Shape::Up),
        Integrator::SemiImplicit => (ORANGE, Shape::Down),
        Integrator::Rk4 => (VIOLET, Shape::Square),
        Integrator::Implicit => (SOFT, Shape::Diamond),
        Integrator::Adaptive => (BROWN, Shape::Diamond),
        Integrator::Radau => (INK, Shape::Square),
    };
    Symbol::new(colour, shape).hollow(true)
}

fn integrators() -> impl Iterator<Item = Integrator> {
    let all = Integrator::ALL.iter().copied();
    all.filter(|integrator| *integrator != Integrator::Radau)
}

pub fn draw(rows: &[Row]) -> String {
    let note = "Contact models: error to the reference, in %, over speed on one core; 50 mm/s, or 100 mm/s at 8 Hz. \
         Full: a rung as it is; hollow, joined: by steps, 250 µs on the right, 1 µs on the left.";
    let rungs = ContactModel::ALL.iter();
    let rungs = rungs.filter(|rung| **rung != ContactModel::Reference);
    let mut legend: Vec<(Key, &str)> = rungs
        .map(|rung| (Key::Symbol(of_rung(*rung)), rung.name()))
        .collect();
    legend.extend(integrators().map(|of| (Key::Symbol(of_integrator(of)), of.name())));
    legend.push((Key::Line(REFERENCE), "the reference’s speed"));
    let x = Axis::decades(1.0, 1e5, "virtual seconds per second");
    let y = Axis::decades(LEAST_PERCENT, 1_000.0, "");
    let panels = cases().map(|case| {
        let here: Vec<&Row> = rows.iter().filter(|row| row.case == case.name).collect();
        Panel::new(case.name, &x, &y).with(marks(&here))
    });
    in_threes(note, &legend, &panels)
}

fn marks(rows: &[&Row]) -> Vec<Mark> {
    let at = |row: &&Row| Some((row.pace, row.error_percent?));
    let by = |integrator| move |row: &&&Row| row.entrant.integrator == integrator;
    let mut marks = Vec::new();
    for integrator in integrators() {
        let steps: Vec<_> = rows
            .iter()
            .filter(by(Some(integrator)))
            .filter_map(at)
            .collect();
        let symbol = of_integrator(integrator);
        marks.push(Mark::thin(symbol.colour, steps.clone()));
        marks.push(Mark::Symbols(symbol, steps));
    }
    for row in rows.iter().filter(by(None)) {
        match row.entrant.rung {
            ContactModel::Reference => {
                marks.push(Mark::Upright(REFERENCE, row.pace, String::new()));
            }
            rung => marks.extend(at(row).map(|point| Mark::symbol(of_rung(rung), point))),
        }
    }
    marks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::models::entrants;

    #[test]
    fn the_texts_stay_within_the_picture() {
        let rows: Vec<Row> = cases()
            .iter()
            .flat_map(|case| {
                entrants(case)
                    .into_iter()
                    .zip(1..)
                    .map(|(entrant, place)| Row {
                        case: case.name,
                        entrant,
                        pace: 10.0 * f64::from(place),
                        error_percent: (place != 2).then_some(1e-3 * f64::from(place)),
                    })
            })
            .collect();
        crate::output::plot::tests::assert_fits("models", &draw(&rows));
    }
}
