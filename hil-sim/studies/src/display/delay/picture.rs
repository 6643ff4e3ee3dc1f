//! The picture: cycles and ms over the delay, and both voltages about a reversal.

use super::{Row, SHOWN_MS, SHOWN_S, stimulus_v};
use crate::output::plot::palette::{BLUE, INK, VERMILION};
use crate::output::plot::{Axis, Key, Mark, Panel, Shape, Stroke, Symbol, in_threes};

const OURS: Symbol = Symbol::new(BLUE, Shape::Circle).faded(0.9);
const RELAYED: Symbol = Symbol::new(VERMILION, Shape::Square).faded(0.9);
const DUE: Stroke = Stroke::new(INK, 0.8).dashed("3 2");

pub fn draw(rows: &[Row]) -> String {
    let note = "Stimulus against the motion it belongs to: v = 70 sin(2π 0.83 t) mm/s, λ = 2 mm. \
         Ours: the display’s ELF. Relayed: what the remote finger feels, sent back, with no other fault.";
    let bad = "ours with 20 % loss and 50 ms jitter";
    let legend = [
        (Key::Symbol(OURS), "ours (measured)"),
        (Key::Symbol(OURS.hollow(true)), bad),
        (Key::Symbol(RELAYED), "relayed over the network (model)"),
        (Key::Line(DUE), "due"),
    ];
    let x = Axis::even(0.0, 500.0, 100.0, "the link’s one-way delay, ms");
    let cycles = Axis::decades(0.0001, 20.0, "");
    let ms = Axis::decades(0.1, 2_000.0, "");
    let panels = [
        Panel::new("phase error, RMS, cycles", &x, &cycles).with(over_delay(rows, |row| {
            (row.ours_cycles, row.relayed_cycles)
        })),
        Panel::new("stimulus behind its motion, ms", &x, &ms)
            .with(over_delay(rows, |row| (row.ours_ms, row.relayed_ms()))),
        voltages(rows),
    ];
    in_threes(note, &legend, &panels)
}

/// Ours and the relayed one, where they have a value that a logarithmic axis can show.
fn over_delay(rows: &[Row], value: impl Fn(&Row) -> (Option<f64>, f64)) -> Vec<Mark> {
    let fair = rows
        .iter()
        .filter(|row| row.link.loss == 0.0 && value(row).1 > 0.0);
    let relayed: Vec<_> = fair.map(|row| (row.link.delay_ms, value(row).1)).collect();
    let ours = rows.iter().filter_map(|row| {
        let symbol = OURS.hollow(row.link.loss > 0.0);
        Some(Mark::symbol(symbol, (row.link.delay_ms, value(row).0?)))
    });
    let line = Mark::Line(Stroke::new(VERMILION, 1.2), relayed.clone());
    let relayed = [line, Mark::Symbols(RELAYED, relayed)];
    relayed.into_iter().chain(ours).collect()
}

fn voltages(rows: &[Row]) -> Panel {
    let x = Axis::even(SHOWN_S.start, SHOWN_S.end, 0.1, "s");
    let y = Axis::even(-6.0, 6.0, 3.0, "");
    let shown = rows.iter().find(|row| !row.drawn.is_empty());
    let begins = shown.map_or(0.0, |row| row.begins_cycles);
    let drawn = |late_s: f64| -> Vec<_> {
        (0..=1_100)
            .map(|step| SHOWN_S.start + (SHOWN_S.end - SHOWN_S.start) * f64::from(step) / 1_100.0)
            .map(|t_s| (t_s, stimulus_v(t_s, late_s, begins)))
            .collect()
    };
    let title = format!("V, at {SHOWN_MS} ms each way, about a reversal");
    let measured = shown.map(|row| Mark::held(Stroke::new(BLUE, 1.2), &row.drawn, &SHOWN_S));
    let relayed = Mark::Line(Stroke::new(VERMILION, 1.2), drawn(2e-3 * SHOWN_MS));
    Panel::new(title, &x, &y)
        .with([relayed, Mark::Line(DUE, drawn(0.0))])
        .with(measured)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim_core::scene::Link;

    #[test]
    fn the_texts_stay_within_the_picture() {
        let rows = [(0.0, 0.0), (SHOWN_MS, 0.0), (500.0, 0.2)].map(|(delay_ms, loss)| Row {
            link: Link {
                delay_ms,
                loss,
                ..Link::default()
            },
            ours_cycles: Some(1e-3),
            ours_ms: Some(0.7),
            edge_ms: Some(0.1),
            relayed_cycles: 0.01 * delay_ms,
            begins_cycles: 0.0,
            drawn: vec![(SHOWN_S.start, 5.0), (SHOWN_S.end, -5.0)],
        });
        crate::output::plot::tests::assert_fits("delay", &draw(&rows));
    }
}
