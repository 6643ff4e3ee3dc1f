//! A map in a few numbers per method.

use super::Map;
use super::journal::Rows;
use super::measurement::Measurement;
use super::words::{WRONG_SHARE, settings};
use crate::study::{Record, number, short};

/// The table's line of a method that has every cell.
pub fn line(map: &Map, method: &str, rows: &Rows) -> Record {
    let cells = (0..map.len()).filter_map(|cell| {
        let row = rows.get(&(method.to_owned(), cell))?;
        Some((cell, &row.measurement))
    });
    let measured: Vec<(usize, &Measurement)> = cells.collect();
    let of = |value: fn(&Measurement) -> Option<f64>| -> Vec<f64> {
        measured.iter().filter_map(|(_, m)| value(m)).collect()
    };
    let sum = |count: fn(&Measurement) -> u32| -> f64 {
        measured.iter().map(|(_, m)| f64::from(count(m))).sum()
    };
    let above = |values: &[f64], limit: f64| short(values.iter().filter(|x| **x > limit).count());
    let (errors, wrongs) = (of(|m| m.rms_percent), of(Measurement::wrong_share));
    let shares = measured.iter();
    let worst = shares
        .filter_map(|(cell, m)| Some((*cell, m.wrong_share()?)))
        .reduce(|worst, next| if next.1 > worst.1 { next } else { worst });
    let place = worst.filter(|worst| worst.1 > 0.0);
    let place = place.map(|(cell, _)| settings(map, cell));
    let never = measured.iter().filter(|(_, m)| m.valid == 0).count();
    let wrong_percent = 100.0 * sum(|m| m.wrong) / sum(|m| m.estimates);
    let worst_percent = worst.map(|worst| 100.0 * worst.1);
    Record::default()
        .with("map", map.name)
        .with("method", method)
        .with("cells:", short(measured.len()))
        .with("never valid:", short(never))
        .with("rms %, median:", number(median(errors.clone()), 2))
        .with("cells above 10 %:", above(&errors, 10.0))
        .with(
            "valid share, median:",
            number(median(of(|m| m.valid_share)), 3),
        )
        .with("wrong %, all:", format!("{wrong_percent:.3}"))
        .with("wrong %, worst cell:", number(worst_percent, 1))
        .with("cells above 0.1 %:", above(&wrongs, WRONG_SHARE))
        .with("the worst", place.unwrap_or("–".to_owned()))
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
