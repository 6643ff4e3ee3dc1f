//! Where a method fails on a map, in plain sentences. Every number in them is counted on the map.

use super::Map;
use super::axis::{Axis, Scale};
use super::journal::Rows;
use super::measurement::Measurement;

/// A method is silent at a place if it is valid for less of the time in motion than this.
const SPEAKS: f64 = 0.5;
/// Most of the estimates that may be wrong.
pub const WRONG_SHARE: f64 = 0.001;

struct Place<'r> {
    cell: usize,
    measured: &'r Measurement,
}

impl Place<'_> {
    fn speaks(&self) -> bool {
        self.measured
            .valid_share
            .is_some_and(|share| share >= SPEAKS)
    }
}

/// The sentences of these methods, each of which must have every cell, as Markdown.
pub fn text(map: &Map, methods: &[&str], rows: &Rows) -> String {
    let mut text = format!("**{}** ({}).\n", map.title, map.conditions);
    for method in methods {
        text += "\n- ";
        text += &sentences(map, method, rows).join(" ");
    }
    text + "\n"
}

/// What is to be said of a method that has every cell.
pub fn sentences(map: &Map, method: &str, rows: &Rows) -> Vec<String> {
    let places: Vec<Place> = (0..map.len())
        .filter_map(|cell| {
            let measured = &rows.get(&(method.to_owned(), cell))?.measurement;
            // Where nothing moves there is nothing to say.
            measured.valid_share?;
            Some(Place { cell, measured })
        })
        .collect();
    vec![
        silence(map, method, &places),
        errors(map, &places),
        wrongs(map, &places),
    ]
}

fn silence(map: &Map, method: &str, places: &[Place<'_>]) -> String {
    let silent = places.iter().filter(|place| !place.speaks()).count();
    let all = places.len();
    let half = 100.0 * SPEAKS;
    if silent == 0 {
        return format!(
            "{method} is valid for at least {half:.0} % of the time at all {all} places."
        );
    }
    let mut sentence = format!(
        "{method} is valid for less than {half:.0} % of the time at {silent} of {all} places"
    );
    let mut parts = Vec::new();
    for (axis, is_x) in [(&map.x, true), (&map.y, false)] {
        let step = |place: &Place<'_>| {
            let (column, row) = map.place(place.cell);
            if is_x { column } else { row }
        };
        let with = |speaking: bool| -> Vec<usize> {
            (0..axis.steps.len())
                .filter(|number| {
                    let mut there = places
                        .iter()
                        .filter(|place| step(place) == *number)
                        .peekable();
                    there.peek().is_some() && there.all(|place| place.speaks() == speaking)
                })
                .collect()
        };
        for (steps, word) in [(with(false), "everywhere"), (with(true), "nowhere")] {
            if !steps.is_empty() && steps.len() < axis.steps.len() {
                parts.push(format!(
                    "{word} at {} ({})",
                    ranges(axis, &steps),
                    axis.label
                ));
            }
        }
    }
    if !parts.is_empty() {
        sentence += ": ";
        sentence += &parts.join("; ");
    }
    sentence + "."
}

fn errors(map: &Map, places: &[Place<'_>]) -> String {
    let mut errors: Vec<(f64, usize)> = places
        .iter()
        .filter(|place| place.speaks())
        .filter_map(|place| Some((place.measured.rms_percent?, place.cell)))
        .collect();
    errors.sort_by(|one, other| one.0.total_cmp(&other.0));
    match (errors.get(errors.len() / 2), errors.last()) {
        (Some(middle), Some(worst)) => format!(
            "At the other places its error is {:.2} % in the middle and {:.2} % at worst ({}).",
            middle.0,
            worst.0,
            settings(map, worst.1)
        ),
        _ => "There is no other place.".to_owned(),
    }
}

fn wrongs(map: &Map, places: &[Place<'_>]) -> String {
    let most = 100.0 * WRONG_SHARE;
    let above: Vec<(f64, usize)> = places
        .iter()
        .filter_map(|place| Some((place.measured.wrong_share()?, place.cell)))
        .filter(|(share, _)| *share > WRONG_SHARE)
        .collect();
    let worst = above
        .iter()
        .copied()
        .reduce(|worst, next| if next.0 > worst.0 { next } else { worst });
    match worst {
        None => {
            format!("Nowhere are more than {most} % of its estimates valid and more than 10 % off.")
        }
        Some((share, cell)) => format!(
            "At {} more than {most} % of its estimates are valid and more than 10 % off, at worst {:.1} % ({}).",
            match above.len() {
                1 => "one place".to_owned(),
                count => format!("{count} places"),
            },
            100.0 * share,
            settings(map, cell)
        ),
    }
}

/// Steps of an axis, those beside one another as ranges.
fn ranges(axis: &Axis, steps: &[usize]) -> String {
    let label = |step: usize| match axis.scale {
        // Named steps repeat in each group.
        Scale::Named => axis.place(&axis.steps[step]),
        Scale::Linear | Scale::Log => axis.steps[step].label.replace('-', "−"),
    };
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for &step in steps {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == step => *last = step,
            _ => runs.push((step, step)),
        }
    }
    let text = |(first, last)| match first == last {
        true => label(first),
        false => format!("{} to {}", label(first), label(last)),
    };
    let texts: Vec<String> = runs.into_iter().map(text).collect();
    texts.join(", ")
}

pub fn settings(map: &Map, cell: usize) -> String {
    let settings = map
        .own(cell)
        .map(|of| format!("{} = {}", of.knob.column, of.value));
    settings.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::map::knob::Knob;
    use crate::map::row::Row;

    /// Three speeds by two wavelengths.
    fn map() -> Map {
        Map {
            name: "small",
            title: "Small",
            conditions: "",
            x: Axis::linear("speed v in mm/s", Knob::SPEED, 30.0, 70.0, 3),
            y: Axis::listed("wavelength λ in mm", Knob::WAVELENGTH, &[1.0, 4.0]),
            base: Vec::new(),
        }
    }

    fn rows(valid: [Option<f64>; 6], wrong: [u32; 6]) -> Rows {
        let mut rows = BTreeMap::new();
        for (cell, (valid_share, wrong)) in valid.into_iter().zip(wrong).enumerate() {
            let measurement = Measurement {
                rms_percent: Some(cell as f64),
                valid_share,
                estimates: 1_000,
                wrong,
                ..Measurement::default()
            };
            let row = Row {
                cell,
                method: "it".to_owned(),
                measurement,
            };
            rows.insert(("it".to_owned(), cell), row);
        }
        rows
    }

    #[test]
    fn sentences_count_what_the_map_holds() {
        // Silent at 70 mm/s, and with 4 mm at 50 as well; wrong at 30 mm/s on 4 mm.
        let valid = [0.9, 0.8, 0.1, 0.6, 0.3, 0.0].map(Some);
        let said = sentences(&map(), "it", &rows(valid, [0, 1, 0, 5, 0, 0]));
        assert_eq!(
            said,
            [
                "it is valid for less than 50 % of the time at 3 of 6 places: everywhere at 70 (speed v in \
                 mm/s); nowhere at 30 (speed v in mm/s).",
                "At the other places its error is 1.00 % in the middle and 3.00 % at worst (speed_mm_s = 30, \
                 wavelength_mm = 4).",
                "At one place more than 0.1 % of its estimates are valid and more than 10 % off, at worst 0.5 % \
                 (speed_mm_s = 30, wavelength_mm = 4).",
            ]
        );
    }

    #[test]
    fn a_method_that_never_fails_is_said_to_and_rest_is_left_out() {
        let mut valid = [Some(1.0); 6];
        valid[0] = None;
        let said = sentences(&map(), "it", &rows(valid, [0; 6]));
        assert_eq!(
            said[0],
            "it is valid for at least 50 % of the time at all 5 places."
        );
        assert!(said[2].starts_with("Nowhere"));
        let silent = sentences(&map(), "it", &rows([Some(0.0); 6], [0; 6]));
        assert_eq!(
            silent[0],
            "it is valid for less than 50 % of the time at 6 of 6 places."
        );
        assert_eq!(silent[1], "There is no other place.");
    }
}
