//! The picture: a map for each integrator, clinging above, swinging below.

use super::{
    BRISTLES_N_PER_M, CLINGING_STEPS_S, FINGERTIP_N_PER_M, Map, Outcome, SWINGING_STEPS_S, Test,
};
use crate::output::plot::palette::INK;
use crate::output::plot::{Axis, Cells, Key, Mark, PANEL_HEIGHT, Page, Panel, Stroke};

/// What became of a fingertip: its fill, and words.
const OUTCOMES: [(Outcome, &str, &str); 4] = [
    (Outcome::Sound, "#cfe8d5", "as the equations say"),
    (
        Outcome::Creeps,
        "#f2e2a0",
        "creeps, or its swing dies too soon",
    ),
    (Outcome::Chatters, "#e8935a", "chatters, or its swing grows"),
    (Outcome::Diverges, "#7a1f3d", "diverges"),
];
const LIMIT: Stroke = Stroke::new(INK, 1.6);

pub fn draw(maps: &[Map]) -> String {
    let mut page = Page::default();
    page.note(
        "Above: bristles of a stiffness; the arm rubs at 70 mm/s and stops, the fingertip should rest. \
         Below: a spring without friction; the fingertip should swing.",
    );
    let fills = OUTCOMES.map(|(_, fill, words)| (Key::Fill(fill.to_owned()), words));
    let mut legend = fills.to_vec();
    legend.push((Key::Line(LIMIT), "longest step allowed"));
    page.legend(&legend);
    for test in [Test::LuGre, Test::SteppedSpring] {
        let of_test = |integrator| {
            let mut maps = maps.iter().filter(|map| map.test == test);
            maps.find(|map| map.integrator == integrator)
        };
        let panels: Vec<Panel> = super::integrators()
            .filter_map(of_test)
            .map(panel)
            .collect();
        page.panels(4, &[PANEL_HEIGHT - 20.0], &panels);
    }
    page.finish()
}

fn panel(map: &Map) -> Panel {
    let (steps_s, stiffnesses, what) = match map.test {
        Test::LuGre => (CLINGING_STEPS_S, BRISTLES_N_PER_M, "bristles, N/m"),
        Test::SteppedSpring => (SWINGING_STEPS_S, FINGERTIP_N_PER_M, "spring, N/m"),
    };
    let x = Axis::decades(steps_s.0 * 1e6, steps_s.1 * 1e6, "step, µs");
    let y = Axis::powers(stiffnesses.0, stiffnesses.1, "");
    let fill_of = |outcome| OUTCOMES.iter().position(|known| known.0 == outcome);
    let cells = map.rows.iter().flat_map(|row| &row.cells);
    let limit = map
        .rows
        .iter()
        .filter(|row| (steps_s.0..=steps_s.1).contains(&row.allowed_s))
        .map(|row| (row.allowed_s * 1e6, row.stiffness_n_per_m));
    Panel::new(format!("{}: {what}", map.integrator.name()), &x, &y).with([
        Mark::Cells(Cells {
            columns: map.rows.first().map_or(1, |row| row.cells.len()),
            cells: cells.map(|cell| fill_of(cell.1)).collect(),
            fills: OUTCOMES.map(|(_, fill, _)| fill.to_owned()).to_vec(),
        }),
        Mark::Line(LIMIT, limit.collect()),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::stability::{MapRow, integrators};

    #[test]
    fn the_texts_stay_within_the_picture() {
        let row = |stiffness_n_per_m| MapRow {
            stiffness_n_per_m,
            allowed_s: 1e-5,
            cells: OUTCOMES.map(|(outcome, ..)| (1e-5, outcome)).to_vec(),
        };
        let maps: Vec<Map> = [Test::LuGre, Test::SteppedSpring]
            .into_iter()
            .flat_map(|test| {
                integrators().map(move |integrator| Map {
                    test,
                    integrator,
                    rows: vec![row(1e3), row(1e5)],
                })
            })
            .collect();
        crate::output::plot::tests::assert_fits("stability", &draw(&maps));
    }
}
