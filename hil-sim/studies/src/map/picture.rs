//! A map's picture: for each method a row of heat maps, one for each quantity.

use super::axis::{Axis as MapAxis, Scale};
use super::journal::Rows;
use super::measurement::Measurement;
use super::ramp::{LEVELS, Ramp, level};
use super::{DURATION_S, Map};
use crate::output::plot::palette::{INK, PAPER};
use crate::output::plot::{Axis, Cells, HATCH, Key, Mark, Page, Panel, Stroke};

const PANEL_HEIGHT: f64 = 190.0;
/// A named axis needs room for its words.
const NAMED_STEP: f64 = 13.0;
/// Height of the bar that shows a quantity's colours.
const BAR_HEIGHT: f64 = 11.0;
/// Around cells that are above a quantity's line: white below dark, to be seen on every colour.
const BORDER: [Stroke; 2] = [Stroke::new(PAPER, 2.8), Stroke::new(INK, 1.2)];

struct Quantity {
    title: &'static str,
    ramp: Ramp,
    /// In the unit of the colour bar.
    value: fn(&Measurement) -> Option<f64>,
    /// Share of the way along the ramp.
    share: fn(f64) -> f64,
    ticks: &'static [(f64, &'static str)],
    /// Cells above it are set off by a line.
    line: Option<f64>,
    /// Whether 0 is a case of its own, drawn white.
    white_zero: bool,
}

const QUANTITIES: [Quantity; 3] = [
    Quantity {
        title: "rms error of the valid estimates",
        ramp: Ramp::Ember,
        value: |measured| measured.rms_percent,
        share: |percent| decades_above(0.1, percent),
        ticks: &[(0.1, "0.1"), (1.0, "1"), (10.0, "10"), (100.0, "100 %")],
        line: Some(10.0),
        white_zero: false,
    },
    Quantity {
        title: "valid share of the time in motion",
        ramp: Ramp::Meadow,
        value: |measured| measured.valid_share.map(|share| 100.0 * share),
        share: |percent| percent / 100.0,
        ticks: &[
            (0.0, "0"),
            (25.0, "25"),
            (50.0, "50"),
            (75.0, "75"),
            (100.0, "100 %"),
        ],
        line: None,
        white_zero: false,
    },
    Quantity {
        title: "valid, yet more than 10 % off",
        ramp: Ramp::Ember,
        value: |measured| measured.wrong_share().map(|share| 100.0 * share),
        share: |percent| decades_above(0.1, percent),
        ticks: &[(0.1, "0.1"), (1.0, "1"), (10.0, "10"), (100.0, "100 %")],
        line: Some(0.1),
        white_zero: true,
    },
];

/// Thirds of three decades.
fn decades_above(least: f64, value: f64) -> f64 {
    (value / least).log10() / 3.0
}

/// Draws these methods' rows of a map; each must have every cell.
pub fn draw(map: &Map, methods: &[&str], rows: &Rows) -> String {
    let mut page = Page::default();
    page.title(map.title);
    let conditions = map.conditions;
    page.note(&format!(
        "{conditions}; {DURATION_S:.0} s a cell, native engine"
    ));
    let (x, y) = (axis(&map.x), axis(&map.y));
    let mut panels: Vec<Panel> = QUANTITIES.iter().map(colour_bar).collect();
    for (row, method) in methods.iter().enumerate() {
        for (column, quantity) in QUANTITIES.iter().enumerate() {
            let values: Vec<Option<f64>> = (0..map.len())
                .map(|cell| (quantity.value)(&rows.get(&((*method).to_owned(), cell))?.measurement))
                .collect();
            // Neighbours share words: methods and y stand on the left, x below.
            let is_last = row + 1 == methods.len();
            let x = if is_last { x.clone() } else { x.wordless() };
            let panel = match column {
                0 => Panel::new(*method, &x, &y),
                _ => Panel::new("", &x, &y.wordless()),
            };
            panels.push(panel.with(marks(map, quantity, &values)));
        }
    }
    let high = match map.y.scale {
        Scale::Named => NAMED_STEP * map.y.steps.len() as f64,
        Scale::Linear | Scale::Log => PANEL_HEIGHT,
    };
    page.panels(QUANTITIES.len(), &[BAR_HEIGHT, high], &panels);
    page.legend(&[
        (
            Key::Fill(HATCH.to_owned()),
            "nothing to show: never valid, or no faster than 5 mm/s",
        ),
        (Key::Fill(PAPER.light.to_owned()), "none wrong"),
        (
            Key::Line(Stroke::new(INK, 1.6)),
            "10 % of error; 0.1 % wrong, the most allowed",
        ),
    ]);
    page.finish()
}

/// A map's axis: its steps are 1 apart, each in the middle of its cells. Named steps begin at the upper end.
fn axis(of: &MapAxis) -> Axis {
    let ticks = of.ticks().into_iter();
    let ticks = ticks.filter_map(|(value, label)| Some((of.along(value)?, label)));
    let end = of.steps.len() as f64 - 0.5;
    if of.scale != Scale::Named {
        return Axis::named(of.label, -0.5..end, ticks.collect());
    }
    let label = if of.groups.is_empty() { of.label } else { "" };
    let mut first = 0;
    let groups = of.groups.iter().map(|(name, count)| {
        first += count;
        (first as f64 - 0.5 * *count as f64 - 0.5, name.clone())
    });
    Axis {
        groups: groups.collect(),
        ..Axis::named(label, end..-0.5, ticks.collect())
    }
}

/// The fills of cells: a ramp's, and white for what is nothing at all.
fn fills(ramp: Ramp) -> Vec<String> {
    let levels = (0..LEVELS).map(|level| ramp.colour(level));
    levels.chain([PAPER.light.to_owned()]).collect()
}

/// The quantity's name, its colours and their values.
fn colour_bar(quantity: &Quantity) -> Panel {
    let ticks = quantity.ticks.iter();
    let ticks = ticks.map(|(value, label)| ((quantity.share)(*value), (*label).to_owned()));
    let (x, y) = (
        Axis::named("", 0.0..1.0, ticks.collect()),
        Axis::named("", 0.0..1.0, vec![]),
    );
    let colours = Mark::Cells(Cells {
        columns: LEVELS,
        cells: (0..LEVELS).map(Some).collect(),
        fills: fills(quantity.ramp),
    });
    let line = quantity.line.into_iter().flat_map(|value| {
        let share = (quantity.share)(value);
        BORDER.map(|stroke| Mark::Upright(stroke, share, String::new()))
    });
    Panel::new(quantity.title, &x, &y)
        .with([colours])
        .with(line)
}

fn marks(map: &Map, quantity: &Quantity, values: &[Option<f64>]) -> Vec<Mark> {
    let (columns, rows) = (map.x.steps.len(), map.y.steps.len());
    let shown = |column: usize, row: usize| values[map.cell(column, row)];
    let from_below = |line: usize| match map.y.scale {
        Scale::Named => rows - 1 - line,
        Scale::Linear | Scale::Log => line,
    };
    let places = (0..rows).flat_map(|line| (0..columns).map(move |column| (column, line)));
    let fill_of = |value| shade(quantity, value);
    let mut marks = vec![Mark::Cells(Cells {
        columns,
        cells: places
            .map(|(column, line)| shown(column, from_below(line)).map(fill_of))
            .collect(),
        fills: fills(quantity.ramp),
    })];
    if let Some(limit) = quantity.line {
        let above = |column, row| shown(column, row).map(|value| value > limit);
        let corner = |(column, row): (usize, usize)| (column as f64 - 0.5, row as f64 - 0.5);
        let edges: Vec<_> = border(columns, rows, above)
            .into_iter()
            .map(|(from, to)| (corner(from), corner(to)))
            .collect();
        marks.extend(BORDER.map(|stroke| Mark::Segments(stroke, edges.clone())));
    }
    let mut first = 0;
    for (_, steps) in &map.y.groups {
        let between = first as f64 - 0.5;
        let ends = vec![(-0.5, between), (columns as f64 - 0.5, between)];
        if first > 0 {
            marks.push(Mark::Line(Stroke::new(PAPER, 3.0), ends));
        }
        first += steps;
    }
    marks
}

/// The fill of what is nothing at all, behind the ramp's levels.
const NOTHING: usize = LEVELS;

fn shade(quantity: &Quantity, value: f64) -> usize {
    if value == 0.0 && quantity.white_zero {
        NOTHING
    } else {
        level((quantity.share)(value))
    }
}

type Edge = ((usize, usize), (usize, usize));

/// The edges between neighbouring cells of which one is above and the other is not.
fn border(columns: usize, rows: usize, above: impl Fn(usize, usize) -> Option<bool>) -> Vec<Edge> {
    let parts = |one: Option<bool>, other: Option<bool>| {
        one.zip(other).is_some_and(|(one, other)| one != other)
    };
    let mut edges = Vec::new();
    for line in 0..rows {
        for column in 0..columns {
            let here = above(column, line);
            if column + 1 < columns && parts(here, above(column + 1, line)) {
                edges.push(((column + 1, line), (column + 1, line + 1)));
            }
            if line + 1 < rows && parts(here, above(column, line + 1)) {
                edges.push(((column, line + 1), (column + 1, line + 1)));
            }
        }
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_border_runs_between_what_is_above_and_what_is_not() {
        // Three columns, two lines: only the upper middle one is above; lower right has no value.
        let above = |column, line| match (column, line) {
            (1, 0) => Some(true),
            (2, 1) => None,
            _ => Some(false),
        };
        let edges = border(3, 2, above);
        assert_eq!(
            edges,
            [((1, 0), (1, 1)), ((2, 0), (2, 1)), ((1, 1), (2, 1)),]
        );
    }

    #[test]
    fn nothing_wrong_is_white_and_a_tenth_of_a_percent_is_not() {
        let wrong = &QUANTITIES[2];
        assert_eq!(shade(wrong, 0.0), NOTHING);
        assert_eq!(shade(wrong, 0.1), 0);
        assert_eq!(shade(wrong, 100.0), LEVELS - 1);
        // No error at all and no valid time at all are ends of their ramps.
        assert_eq!(shade(&QUANTITIES[0], 0.0), 0);
        assert_eq!(shade(&QUANTITIES[1], 0.0), 0);
    }

    #[test]
    fn the_texts_of_every_map_stay_within_its_picture() {
        for map in crate::map::catalogue() {
            crate::output::plot::tests::assert_fits(
                map.name,
                &draw(&map, &crate::map::METHODS, &Rows::new()),
            );
        }
    }
}
