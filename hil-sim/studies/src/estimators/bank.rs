//! What the estimator `bank` gave before its successor took its place: rows of `hil-sim chart estimators`
//! at the last commit that had it, read from `bank.csv`, whose first line names that commit.

use super::costs::Cost;
use super::family::Family;
use super::result::Entry;
use super::score::Score;

/// How the chart and its CSV call it.
pub const METHOD: &str = "bank (until 2026-11, as committed)";

const ROWS: &str = include_str!("bank.csv");

/// A row, named as in the chart's CSV.
#[derive(serde::Deserialize)]
struct Row {
    family: String,
    knob: String,
    value: u16,
    instructions_per_ms: f64,
    worst_ms_instructions: f64,
    rms_percent: Option<f64>,
    worst_rms_percent: Option<f64>,
    worst_scene: String,
    valid_share: Option<f64>,
    wrong_share: Option<f64>,
    settling_ms: Option<f64>,
    longest_settling_ms: Option<f64>,
}

/// Its settings as entries, with a score for each of these families; empty for one that it never met.
pub fn entries(families: &[Family]) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for row in rows() {
        let of = (knob(&row.knob), row.value);
        let known = entries.iter().position(|e| (e.knob, e.value) == of);
        let place = known.unwrap_or_else(|| {
            entries.push(Entry {
                method: METHOD,
                knob: of.0,
                value: of.1,
                setting: None,
                cost: Some(Cost {
                    mean: row.instructions_per_ms,
                    worst: Some(row.worst_ms_instructions),
                }),
                scores: vec![Score::default(); families.len()],
            });
            entries.len() - 1
        });
        if let Some(family) = families.iter().position(|f| f.folder == row.family) {
            entries[place].scores[family] = Score {
                rms_percent: row.rms_percent,
                worst: row.worst_rms_percent.map(|rms| (rms, row.worst_scene)),
                valid_share: row.valid_share,
                wrong_share: row.wrong_share,
                settling_ms: row.settling_ms,
                longest_settling_ms: row.longest_settling_ms,
            };
        }
    }
    entries
}

fn rows() -> Vec<Row> {
    csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(ROWS.as_bytes())
        .into_deserialize()
        .collect::<Result<_, _>>()
        .expect("a test reads the committed rows")
}

/// Its knobs, as the chart's CSV called them.
fn knob(name: &str) -> &'static str {
    match name {
        "travel_percent" => "travel_percent",
        "candidates" => "candidates",
        _ => "gauges",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn families(folders: &[&'static str]) -> Vec<Family> {
        folders
            .iter()
            .map(|folder| Family {
                folder,
                title: "",
                scenes: Vec::new(),
            })
            .collect()
    }

    #[test]
    fn the_file_names_its_commit_and_every_row_is_read() {
        assert!(ROWS.starts_with("# Measured at commit e333d15"));
        // A line for the commit and one for the columns.
        assert_eq!(rows().len() + 2, ROWS.lines().count());
    }

    #[test]
    fn each_setting_is_one_entry_with_a_score_for_each_family() {
        let families = families(&["boundary", "table-1-20-db", "new"]);
        let entries = entries(&families);
        // Travel 50–150, candidates 12–24, gauges 1–5.
        assert_eq!(entries.len(), 4 + 4 + 3);
        for entry in &entries {
            assert!(entry.cost.is_some_and(|cost| cost.mean > 1_000.0));
            assert!(entry.scores[0].settling_ms.is_some(), "{entry:?}");
            assert!(entry.scores[1].rms_percent.is_some(), "{entry:?}");
            assert_eq!(entry.scores[2], Score::default());
        }
    }
}
