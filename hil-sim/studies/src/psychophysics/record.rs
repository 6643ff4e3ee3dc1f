//! A study as files: JSON, and a CSV for each table.

use serde_json::{Value, json};

use crate::psychophysics::DISCLAIMER;
use crate::psychophysics::interval::{Interval, guessing, wilson};
use crate::psychophysics::published::{SAMPLES_MM, TABLE_3, TABLE_4};
use crate::psychophysics::recount::Recount;
use crate::psychophysics::study::{Column, Compared, Study};
use crate::psychophysics::tables;
use crate::study::csv_text_under;

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

fn ends(interval: Option<Interval>) -> (Option<f64>, Option<f64>) {
    (interval.map(|i| i.low), interval.map(|i| i.high))
}

fn table_2(columns: &[Column]) -> Result<String, csv::Error> {
    let header = [
        "standard_mm",
        "quantity",
        "paper_mm",
        "once_mm",
        "low_mm",
        "high_mm",
        "mean_mm",
        "clean_mean_mm",
    ];
    let rows = columns.iter().flat_map(|column| {
        column.lines().map(|line| {
            let [paper, once, mean, clean] = line.each_mm;
            let of = (column.paper.standard_mm, line.name);
            (of, paper, once, ends(line.interval), mean, clean)
        })
    });
    csv_text_under(&header, rows)
}

fn table_3(methods: &[Compared]) -> Result<String, csv::Error> {
    let header = [
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
    ];
    let paper = TABLE_3.iter().map(|pair| ("paper", pair, None));
    let ours = methods.iter().flat_map(|compared| {
        let pairs = compared.once.iter().zip(&compared.long_run);
        pairs.map(|(pair, long_run)| (compared.method, pair, Some(long_run.share())))
    });
    let rows = paper.chain(ours).map(|(method, pair, long_run)| {
        let samples = (SAMPLES_MM[pair.shorter], SAMPLES_MM[pair.longer]);
        let interval = ends(Some(wilson(pair.correct, pair.trials)));
        let by_chance = guessing(pair.correct as u32, pair.trials as u32);
        let counts = (pair.correct, pair.trials, pair.share());
        (method, samples, counts, interval, by_chance, long_run)
    });
    csv_text_under(&header, rows)
}

fn table_4(study: &Study) -> Result<String, csv::Error> {
    let header = [
        "method",
        "wavelength_mm",
        "printed_score",
        "score",
        "low",
        "high",
        "long_run_score",
    ];
    let Recount {
        scale, intervals, ..
    } = &study.recount;
    let samples = || SAMPLES_MM.into_iter().enumerate();
    let paper = samples().map(|(sample, wavelength_mm)| {
        let (printed, score) = (Some(TABLE_4[sample]), Some(scale.scores[sample]));
        let of = ("paper", wavelength_mm, printed);
        (of, score, ends(intervals[sample]), None)
    });
    let ours = study.methods.iter().flat_map(|compared| {
        samples().map(|(sample, wavelength_mm)| {
            let score = compared.scores.as_ref().map(|scores| scores[sample]);
            let of = (compared.method, wavelength_mm, None);
            let long_run = compared.long_run_scores.get(sample).copied();
            (of, score, ends(compared.score_intervals[sample]), long_run)
        })
    });
    csv_text_under(&header, paper.chain(ours))
}

fn mosteller(study: &Study) -> Result<String, csv::Error> {
    let header = ["of", "chi_square", "freedom", "critical", "p", "rejected"];
    let tests = tables::tests(study);
    let rows = tests
        .into_iter()
        .map(|(of, test)| (of, test, test.rejects()));
    csv_text_under(&header, rows)
}

fn felt(study: &Study) -> Result<String, csv::Error> {
    let header = [
        "method",
        "wavelength_mm",
        "waves",
        "presented_mean_mm",
        "error_rms_percent",
        "scatter_rms_percent",
    ];
    csv_text_under(&header, study.stimuli())
}

fn waves(study: &Study) -> Result<String, csv::Error> {
    let header = [
        "method",
        "wavelength_mm",
        "stroke",
        "from_s",
        "to_s",
        "presented_mm",
    ];
    let rows = study.stimuli().flat_map(|(method, stimulus)| {
        let waves = stimulus.felt().waves().iter();
        waves.map(move |wave| {
            let (of, span) = ((method, stimulus.wavelength_mm), (wave.from_s, wave.to_s));
            (of, wave.stroke, span, wave.wavelength_mm)
        })
    });
    csv_text_under(&header, rows)
}
