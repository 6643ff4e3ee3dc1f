//! `[[fault]]`: what breaks, and when.

use super::csv_rows::quoted;
use super::table::Table;
use crate::scene::SceneError;
use crate::scene::fault::{Fault, Kind, Lasts, MOST_KEYS};

pub(super) fn read(tables: Vec<Table<'_>>, duration_s: f64) -> Result<Vec<Fault>, SceneError> {
    tables
        .into_iter()
        .map(|table| one(table, duration_s))
        .collect()
}

fn one(mut table: Table<'_>, duration_s: f64) -> Result<Fault, SceneError> {
    let at_s = table.needed_number("at_s")?;
    if at_s >= duration_s {
        let message = format!("comes after the scene's end at {duration_s} s: give less");
        return Err(table.refuse("at_s", message));
    }
    let Some(name) = table.text("kind")? else {
        return Err(table.refuse("kind", "is missing: give one of those in `hil-sim faults`"));
    };
    let Some(kind) = Kind::from_name(name) else {
        let names: Vec<&str> = Kind::all().map(Kind::name).collect();
        let message = format!(
            "{} is unknown: give one of {}",
            quoted(name),
            names.join(", ")
        );
        return Err(table.refuse("kind", message));
    };
    let row = kind.row();
    let for_s = match row.lasts {
        Lasts::Once => None,
        Lasts::For(_) | Lasts::ForGood => {
            let for_s = table.number("for_s")?;
            for_s.or(row.lasts.default_s())
        }
    };
    let mut values = [0.0; MOST_KEYS];
    for (value, key) in values.iter_mut().zip(row.keys) {
        let given = table.between(key.name, key.low, key.high, key.whole)?;
        *value = given.unwrap_or(key.default);
    }
    table.finish(&format!(" with kind = \"{name}\""))?;
    Ok(Fault {
        kind,
        at_s,
        for_s,
        values,
    })
}
