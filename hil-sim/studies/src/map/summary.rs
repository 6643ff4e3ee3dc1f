//! A map in a few numbers per method.

use super::Map;
use super::journal::Rows;
use super::measurement::Measurement;
use super::words::{WRONG_SHARE, settings};

/// The table's head, in Markdown.
pub const HEADER: &str = "\
| map | method | cells | never valid | rms %, median | cells above 10 % | valid share, median | wrong %, all | wrong %, worst cell | cells above 0.1 % | the worst |
| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | --- |";

/// The table's line of a method that has every cell.
pub fn line(map: &Map, method: &str, rows: &Rows) -> String {
    let measured: Vec<(usize, &Measurement)> = (0..map.len())
        .filter_map(|cell| {
            let row = rows.get(&(method.to_owned(), cell))?;
            Some((cell, &row.measurement))
        })
        .collect();
    let errors = || measured.iter().filter_map(|(_, m)| m.rms_percent);
    let wrongs = || measured.iter().filter_map(|(_, m)| m.wrong_share());
    let sum = |count: fn(&Measurement) -> u32| -> f64 {
        measured.iter().map(|(_, m)| f64::from(count(m))).sum()
    };
    let worst = measured
        .iter()
        .filter_map(|(cell, m)| Some((*cell, m.wrong_share()?)))
        .reduce(|worst, next| if next.1 > worst.1 { next } else { worst });
    let number = |value: Option<f64>, decimals: usize| {
        value.map_or("–".to_owned(), |value| format!("{value:.decimals$}"))
    };
    format!(
        "| {} | {method} | {} | {} | {} | {} | {} | {:.3} | {} | {} | {} |",
        map.name,
        measured.len(),
        measured.iter().filter(|(_, m)| m.valid == 0).count(),
        number(median(errors().collect()), 2),
        errors().filter(|percent| *percent > 10.0).count(),
        number(
            median(measured.iter().filter_map(|(_, m)| m.valid_share).collect()),
            3
        ),
        100.0 * sum(|m| m.wrong) / sum(|m| m.estimates),
        number(worst.map(|worst| 100.0 * worst.1), 1),
        wrongs().filter(|share| *share > WRONG_SHARE).count(),
        match worst {
            Some((cell, share)) if share > 0.0 => settings(map, cell),
            _ => "–".to_owned(),
        },
    )
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 {
        values.get(middle).copied()
    } else {
        let below = middle.checked_sub(1)?;
        Some((values[below] + values[middle]) / 2.0)
    }
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn a_median_has_as_much_above_it_as_below() {
        assert_eq!(median(vec![]), None);
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
    }
}
