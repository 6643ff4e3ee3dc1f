//! A study as files: JSON, and a CSV for each table.

use serde::Serialize;
use serde_json::{Value, json};

use crate::display::finish_csv;
use crate::psychophysics::DISCLAIMER;
use crate::psychophysics::interval::{Interval, guessing, wilson};
use crate::psychophysics::mosteller::Test;
use crate::psychophysics::published::{SAMPLES_MM, TABLE_3, TABLE_4};
use crate::psychophysics::recount::Recount;
use crate::psychophysics::study::{Column, Compared, Stimulus, Study};

/// The study as JSON, with what it does not show.
///
/// # Errors
/// If a number cannot be written, which none should bring about.
pub fn json(study: &Study) -> serde_json::Result<String> {
    let Recount {
        scale,
        half_an_answer,
        left_out,
        as_it_is,
        simulated,
        rejected_though_true,
        ..
    } = &study.recount;
    let mut value = serde_json::to_value(study)?;
    if let Value::Object(fields) = &mut value {
        fields.insert("disclaimer".into(), DISCLAIMER.into());
        let recount = json!({
            "scores": scale.scores,
            "test": half_an_answer,
            "test_without_the_cell": left_out,
            "test_with_the_cell_at_one": as_it_is,
            "test_by_simulation": simulated,
            "rejected_though_true": rejected_though_true,
        });
        fields.insert("paper_recounted".into(), recount);
    }
    serde_json::to_string_pretty(&value)
}

/// The study's CSVs: names and texts.
///
/// # Errors
/// If a row cannot be written, which none should bring about.
pub fn csvs(study: &Study) -> Result<Vec<(&'static str, String)>, csv::Error> {
    Ok(vec![
        ("table-2.csv", table_2(&study.limens)?),
        ("table-3.csv", table_3(&study.methods)?),
        ("table-4.csv", table_4(study)?),
        ("mosteller.csv", mosteller(study)?),
        ("felt.csv", felt(study)?),
        ("waves.csv", waves(study)?),
    ])
}

type Table = csv::Writer<Vec<u8>>;

fn with_header(header: &[&str]) -> Result<Table, csv::Error> {
    // Rows have no header of their own: theirs is written here.
    let mut table = csv::WriterBuilder::new()
        .has_headers(false)
        .from_writer(Vec::new());
    table.write_record(header)?;
    Ok(table)
}

/// A row's cells: what is none stays empty.
fn write(table: &mut Table, row: impl Serialize) -> Result<(), csv::Error> {
    table.serialize(row)
}

fn ends(interval: Option<Interval>) -> (Option<f64>, Option<f64>) {
    (interval.map(|i| i.low), interval.map(|i| i.high))
}

fn table_2(columns: &[Column]) -> Result<String, csv::Error> {
    let mut table = with_header(&[
        "standard_mm",
        "quantity",
        "paper_mm",
        "once_mm",
        "low_mm",
        "high_mm",
        "mean_mm",
        "clean_mean_mm",
    ])?;
    for column in columns {
        for line in column.lines() {
            let [paper, once, mean, clean] = line.each_mm;
            let of = (column.paper.standard_mm, line.name);
            write(
                &mut table,
                (of, paper, once, ends(line.interval), mean, clean),
            )?;
        }
    }
    finish_csv(table)
}

fn table_3(methods: &[Compared]) -> Result<String, csv::Error> {
    let mut table = with_header(&[
        "method",
        "shorter_mm",
        "longer_mm",
        "correct",
        "trials",
        "share",
        "wilson_low",
        "wilson_high",
        "guessing_p",
        "long_run_share",
    ])?;
    let mut row = |method: &str, pair: &crate::psychophysics::pair::Pair, long_run: Option<f64>| {
        let samples = (SAMPLES_MM[pair.shorter], SAMPLES_MM[pair.longer]);
        let interval = ends(Some(wilson(pair.correct, pair.trials)));
        let by_chance = guessing(pair.correct as u32, pair.trials as u32);
        let counts = (pair.correct, pair.trials, pair.share());
        write(
            &mut table,
            (method, samples, counts, interval, by_chance, long_run),
        )
    };
    for pair in &TABLE_3 {
        row("paper", pair, None)?;
    }
    for compared in methods {
        for (pair, long_run) in compared.once.iter().zip(&compared.long_run) {
            row(compared.method, pair, Some(long_run.share()))?;
        }
    }
    finish_csv(table)
}

fn table_4(study: &Study) -> Result<String, csv::Error> {
    let mut table = with_header(&[
        "method",
        "wavelength_mm",
        "printed_score",
        "score",
        "low",
        "high",
        "long_run_score",
    ])?;
    let none: Option<f64> = None;
    for (sample, wavelength_mm) in SAMPLES_MM.into_iter().enumerate() {
        let recount = &study.recount;
        let row = (
            "paper",
            wavelength_mm,
            TABLE_4[sample],
            recount.scale.scores[sample],
            ends(recount.intervals[sample]),
            none,
        );
        write(&mut table, row)?;
    }
    for compared in &study.methods {
        for (sample, wavelength_mm) in SAMPLES_MM.into_iter().enumerate() {
            let row = (
                compared.method,
                wavelength_mm,
                none,
                compared.scores.as_ref().map(|scores| scores[sample]),
                ends(compared.score_intervals[sample]),
                compared.long_run_scores.get(sample),
            );
            write(&mut table, row)?;
        }
    }
    finish_csv(table)
}

fn mosteller(study: &Study) -> Result<String, csv::Error> {
    let mut table = with_header(&["of", "chi_square", "freedom", "critical", "p", "rejected"])?;
    let Recount {
        half_an_answer,
        left_out,
        as_it_is,
        simulated,
        ..
    } = study.recount;
    let mut tests: Vec<(String, Test)> = vec![
        ("paper, cell of 1.00 as 0.95".into(), half_an_answer),
        ("paper, the same by simulation".into(), simulated),
        ("paper, cell of 1.00 left out".into(), left_out),
        ("paper, cell of 1.00 as it is".into(), as_it_is),
    ];
    for compared in &study.methods {
        tests.extend(
            compared
                .test
                .map(|test| (format!("{}, once", compared.method), test)),
        );
        let long_run = compared.long_run_test;
        tests.extend(long_run.map(|test| (format!("{}, long run", compared.method), test)));
    }
    for (of, test) in tests {
        write(&mut table, (of, test, test.rejects()))?;
    }
    finish_csv(table)
}

/// Every stimulus with who made it.
fn stimuli(study: &Study) -> impl Iterator<Item = (&'static str, &Stimulus)> {
    let given = study.given.iter().map(|stimulus| ("given", stimulus));
    given.chain(study.methods.iter().flat_map(|compared| {
        let samples = compared.samples.iter();
        samples.map(|stimulus| (compared.method, stimulus))
    }))
}

fn felt(study: &Study) -> Result<String, csv::Error> {
    let mut table = with_header(&[
        "method",
        "wavelength_mm",
        "waves",
        "presented_mean_mm",
        "error_rms_percent",
        "scatter_rms_percent",
    ])?;
    for (method, stimulus) in stimuli(study) {
        write(&mut table, (method, stimulus))?;
    }
    finish_csv(table)
}

fn waves(study: &Study) -> Result<String, csv::Error> {
    let mut table = with_header(&[
        "method",
        "wavelength_mm",
        "stroke",
        "from_s",
        "to_s",
        "presented_mm",
    ])?;
    for (method, stimulus) in stimuli(study) {
        for wave in stimulus.felt().waves() {
            let (of, span) = ((method, stimulus.wavelength_mm), (wave.from_s, wave.to_s));
            write(&mut table, (of, wave.stroke, span, wave.wavelength_mm))?;
        }
    }
    finish_csv(table)
}
