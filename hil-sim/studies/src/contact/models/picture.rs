//! The picture: error over speed, a panel for each case.

use super::{Entrant, Row, cases};
use crate::output::plot::panel::{
    AROUND, Look, MARGIN, PANEL_HEIGHT, PANEL_WIDTH, Panel, SOFT, Scale, Shape, axes, line, look,
    mark, page, polyline, text,
};
use hil_sim_core::scene::Integrator;
use hil_sim_core::scene::Rung;

const HEAD: f64 = 70.0;
/// Errors below are drawn there.
const LEAST_PERCENT: f64 = 1e-5;

/// What a rung that is solved exactly looks like.
fn rung_look(rung: Rung) -> Look {
    let colour = match rung {
        Rung::Kinematic => "#56B4E9",
        Rung::Rigid => "#0072B2",
        Rung::Viscoelastic => "#009E73",
        Rung::StickSlip => "#D55E00",
        Rung::Reference => "#24292f",
    };
    look(rung.name(), colour, Shape::Circle)
}

/// What an integrator looks like.
fn integrator_look(integrator: Integrator) -> Look {
    let (colour, shape) = match integrator {
        Integrator::Euler => ("#CC79A7", Shape::Up),
        Integrator::SemiImplicit => ("#E69F00", Shape::Down),
        Integrator::Rk4 => ("#8250df", Shape::Square),
        Integrator::Implicit => ("#6a737d", Shape::Diamond),
        Integrator::Adaptive => ("#b35900", Shape::Diamond),
        Integrator::Radau => ("#24292f", Shape::Square),
    };
    look(integrator.name(), colour, shape)
}

/// Draws it.
pub fn draw(rows: &[Row]) -> String {
    let mut svg = page(HEAD + PANEL_HEIGHT + MARGIN);
    text(
        &mut svg,
        MARGIN + 8.0,
        20.0,
        &format!("font-size=\"12\" fill=\"{SOFT}\""),
        "Contact models: error to the reference over speed on one core; 50 mm/s, or 100 mm/s at 8 Hz. \
         Full: a rung as it is; hollow, joined: by steps, 250 µs on the right, 1 µs on the left.",
    );
    let legend = Rung::ALL
        .iter()
        .filter(|rung| **rung != Rung::Reference)
        .map(|rung| (rung_look(*rung), false))
        .chain(
            Integrator::ALL
                .iter()
                .filter(|integrator| **integrator != Integrator::Radau)
                .map(|integrator| (integrator_look(*integrator), true)),
        );
    for (index, (look, hollow)) in legend.enumerate() {
        let x = MARGIN + 14.0 + index as f64 * 108.0;
        mark(&mut svg, (x, 40.0), &look, hollow, 1.0);
        text(&mut svg, x + 10.0, 44.0, "font-size=\"12\"", look.method);
    }
    text(
        &mut svg,
        MARGIN + 8.0,
        60.0,
        &format!("font-size=\"11\" fill=\"{SOFT}\""),
        "dashed: the reference’s speed",
    );
    let x = Scale::decades(1.0, 1e5, "virtual seconds per second");
    let y = Scale::decades(LEAST_PERCENT, 1_000.0, "");
    for (column, case) in cases().iter().enumerate() {
        let panel = Panel {
            left: MARGIN + column as f64 * PANEL_WIDTH + AROUND[0],
            top: HEAD + AROUND[1],
            x: &x,
            y: &y,
        };
        axes(&mut svg, &panel, case.name);
        let here: Vec<&Row> = rows.iter().filter(|row| row.case == case.name).collect();
        draw_case(&mut svg, &panel, &here);
    }
    svg.push_str("</svg>\n");
    svg
}

fn draw_case(svg: &mut String, panel: &Panel<'_>, rows: &[&Row]) {
    let at = |row: &Row| row.error_percent.map(|percent| panel.at(row.pace, percent));
    for integrator in Integrator::ALL {
        let look = integrator_look(integrator);
        let steps: Vec<_> = rows
            .iter()
            .filter(|row| row.entrant.integrator == Some(integrator))
            .filter_map(|row| at(row))
            .collect();
        if integrator == Integrator::Radau {
            continue;
        }
        polyline(
            svg,
            &steps,
            &format!("stroke=\"{}\" stroke-width=\"1\"", look.colour),
        );
        for point in steps {
            mark(svg, point, &look, true, 1.0);
        }
    }
    for row in rows {
        let Entrant {
            rung, integrator, ..
        } = row.entrant;
        if integrator.is_some() {
            continue;
        }
        if rung == Rung::Reference {
            let (x, _) = panel.at(row.pace, 1.0);
            let style = format!("stroke=\"{SOFT}\" stroke-width=\"1.2\" stroke-dasharray=\"4 3\"");
            line(svg, (x, panel.top), (x, panel.top + Panel::HIGH), &style);
        } else if let Some(point) = at(row) {
            mark(svg, point, &rung_look(rung), false, 1.0);
        }
    }
}
