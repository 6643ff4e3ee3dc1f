//! The picture: a spectrum, the worst spur over frequency, and the means.

use std::f64::consts::PI;

use super::{GOAL_DBC, GOAL_MEAN_MV, Hand, Row, SHOWN_HZ};
use crate::output::plot::palette::{BLUE, GREEN, INK, ORANGE, PURPLE, VERMILION};
use crate::output::plot::{Anchor, Axis, Font, Key, Mark, Panel, Shape, Stroke, Symbol, in_threes};
use protocol::Mode;

fn look(row: &Row) -> (&'static str, Symbol) {
    let (name, colour, shape) = match (row.rate_hz, row.mode) {
        (2_000, Mode::Uniform) => ("2 kHz, uniform", BLUE, Shape::Circle),
        (2_000, Mode::Travelling) => ("2 kHz, travelling", VERMILION, Shape::Square),
        (_, Mode::Uniform) => ("4 kHz, uniform", GREEN, Shape::Diamond),
        (_, Mode::Travelling) => ("4 kHz, travelling", PURPLE, Shape::Up),
    };
    (name, Symbol::new(colour, shape))
}

pub fn draw(rows: &[Row]) -> String {
    let note = "From the LDAC edges of the display’s ELF. Full: the hand moves by whole encoder counts a tick; \
         hollow: between whole counts, where the encoder’s steps show.";
    let mut legend: Vec<(Key, &str)> = Vec::new();
    for (name, symbol) in rows.iter().map(look) {
        if legend.iter().all(|known| known.1 != name) {
            legend.push((Key::Symbol(symbol), name));
        }
    }
    in_threes(note, &legend, &[spectra(rows), spurs(rows), means(rows)])
}

fn goal() -> Mark {
    Mark::Level(GOAL_DBC, format!("goal {GOAL_DBC} dBc"))
}

fn spectra(rows: &[Row]) -> Panel {
    let x = Axis::even(0.0, 1_000.0, 200.0, "Hz");
    let y = Axis::even(-140.0, 0.0, 20.0, "");
    let title = format!("{SHOWN_HZ} Hz at the DAC, 2 kHz: dB over the stimulus");
    let mut panel = Panel::new(title, &x, &y).with([goal()]);
    for (hand, colour, words, dbc) in [
        (Hand::Between, ORANGE, "between counts", -52.0),
        (Hand::Whole, BLUE, "whole counts", -88.0),
    ] {
        // Uniform if it was run: fewer channels, the same words.
        let shown = rows
            .iter()
            .filter(|row| row.rate_hz == 2_000 && row.hand == hand && row.spectrum.is_some())
            .min_by_key(|row| row.mode == Mode::Travelling);
        let Some(row) = shown else { continue };
        let font = Font::new(10.0).coloured(colour).at(Anchor::End);
        panel = panel.with([
            Mark::Line(Stroke::new(colour, 0.8), row.levels_dbc()),
            Mark::Words(font, (1_000.0, dbc), (-4.0, 0.0), words.to_owned()),
        ]);
    }
    panel
}

fn spurs(rows: &[Row]) -> Panel {
    let x = Axis::decades(4.0, 250.0, "stimulus, Hz");
    let y = Axis::even(-120.0, 0.0, 20.0, "");
    let worst = rows.iter().filter_map(|row| {
        let symbol = look(row).1.hollow(row.hand == Hand::Between).faded(0.85);
        Some(Mark::symbol(symbol, (row.frequency_hz?, row.spur?.0)))
    });
    Panel::new("worst spur, 0–1 kHz: dB over the stimulus", &x, &y)
        .with([goal()])
        .with(worst)
}

fn means(rows: &[Row]) -> Panel {
    let x = Axis::decades(0.4, 250.0, "stimulus, or the hand’s strokes, Hz");
    let y = Axis::decades(0.01, 10_000.0, "");
    // A sine's own mean over a second that is no whole number of cycles: 5 V / πf at most.
    let own = (0..=60)
        .map(|step| 4.0 * (250.0f64 / 4.0).powf(f64::from(step) / 60.0))
        .map(|f| (f, 5_000.0 / (PI * f)));
    let words = "any second: 5 V/πf of the sine itself".to_owned();
    let measured = rows.iter().map(|row| {
        let (frequency_hz, hollow) = match row.hand {
            Hand::Stroke { frequency_hz, .. } => (frequency_hz, false),
            hand => (row.frequency_hz.unwrap_or(1.0), hand == Hand::Between),
        };
        let symbol = look(row).1.hollow(hollow).faded(0.85);
        Mark::symbol(symbol, (frequency_hz, row.whole_mean_mv.max(0.01)))
    });
    Panel::new("mean of the worst channel, whole cycles, mV", &x, &y)
        .with([
            Mark::Level(GOAL_MEAN_MV, format!("goal {GOAL_MEAN_MV} mV")),
            Mark::Line(Stroke::new(INK, 1.2).dashed("6 4"), own.collect()),
            Mark::Words(Font::new(10.0), (5.2, 1_100.0), (0.0, 0.0), words),
        ])
        .with(measured)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim_core::judge::spectrum::Spectrum;

    #[test]
    fn the_texts_stay_within_the_picture() {
        let row = |rate_hz, mode, hand| Row {
            rate_hz,
            mode,
            hand,
            speed_mm_s: 70.0,
            wavelength_mm: 2.0,
            frequency_hz: Some(SHOWN_HZ),
            uneven_ticks: 0,
            stimulus_v: Some(5.0),
            spur: Some((-80.0, 900.0)),
            whole_mean_mv: 0.5,
            second_mean_mv: 100.0,
            spectrum: Some(Spectrum {
                bin_hz: 1.0,
                amplitudes_v: vec![0.1; 1_000],
            }),
        };
        let stroke = Hand::Stroke {
            peak_mm_s: 70.0,
            frequency_hz: 0.83,
        };
        let rows = [
            row(2_000, Mode::Uniform, Hand::Whole),
            row(2_000, Mode::Travelling, Hand::Between),
            row(4_000, Mode::Uniform, Hand::Whole),
            row(4_000, Mode::Travelling, stroke),
        ];
        crate::output::plot::tests::assert_fits("purity", &draw(&rows));
    }
}
