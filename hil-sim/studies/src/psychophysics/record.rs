//! A study as files: JSON, and a CSV for each table.

use serde_json::{Value, json};

use crate::psychophysics::DISCLAIMER;
use crate::psychophysics::interval::{Interval, guessing, wilson};
use crate::psychophysics::published::{SAMPLES_MM, TABLE_3, TABLE_4};
use crate::psychophysics::recount::Recount;
use crate::psychophysics::study::{Column, Compared, Study};
use crate::psychophysics::tables;
use crate::study::{Record, csv, short};

/// The study as JSON, with what it does not show.
pub fn json(study: &Study) -> serde_json::Result<String> {
    let recount = &study.recount;
    let mut value = serde_json::to_value(study)?;
    if let Value::Object(fields) = &mut value {
        fields.insert("disclaimer".into(), DISCLAIMER.into());
        let recount = json!({
            "scores": recount.scale.scores,
            "test": recount.half_an_answer,
            "test_without_the_cell": recount.left_out,
            "test_with_the_cell_at_one": recount.as_it_is,
            "test_by_simulation": recount.simulated,
            "rejected_though_true": recount.rejected_though_true,
        });
        fields.insert("paper_recounted".into(), recount);
    }
    serde_json::to_string_pretty(&value)
}

/// The study's CSVs: names and texts.
pub fn csvs(study: &Study) -> Vec<(&'static str, String)> {
    vec![
        ("table-2.csv", table_2(&study.limens)),
        ("table-3.csv", table_3(&study.methods)),
        ("table-4.csv", table_4(study)),
        ("mosteller.csv", mosteller(study)),
        ("felt.csv", felt(study)),
        ("waves.csv", waves(study)),
    ]
}

impl Record {
    /// The same with an interval's ends, empty if there is none.
    fn between(self, [low, high]: [&'static str; 2], interval: Option<Interval>) -> Self {
        self.with(low, interval.map(|i| i.low))
            .with(high, interval.map(|i| i.high))
    }
}

fn table_2(columns: &[Column]) -> String {
    csv(columns.iter().flat_map(|column| {
        column.lines().map(|line| {
            let [paper, once, mean, clean] = line.each_mm;
            Record::default()
                .with("standard_mm", column.paper.standard_mm)
                .with("quantity", line.name)
                .with("paper_mm", paper)
                .with("once_mm", once)
                .between(["low_mm", "high_mm"], line.interval)
                .with("mean_mm", mean)
                .with("clean_mean_mm", clean)
        })
    }))
}

fn table_3(methods: &[Compared]) -> String {
    let paper = TABLE_3.iter().map(|pair| ("paper", pair, None));
    let ours = methods.iter().flat_map(|compared| {
        let pairs = compared.once.iter().zip(&compared.long_run);
        pairs.map(|(pair, long_run)| (compared.method, pair, Some(long_run.share())))
    });
    csv(paper.chain(ours).map(|(method, pair, long_run)| {
        let interval = wilson(pair.correct, pair.trials);
        let by_chance = guessing(pair.correct as u32, pair.trials as u32);
        Record::default()
            .with("method", method)
            .with("shorter_mm", SAMPLES_MM[pair.shorter])
            .with("longer_mm", SAMPLES_MM[pair.longer])
            .with("correct", pair.correct)
            .with("trials", pair.trials)
            .with("share", pair.share())
            .between(["wilson_low", "wilson_high"], Some(interval))
            .with("guessing_p", by_chance)
            .with("long_run_share", long_run)
    }))
}

fn table_4(study: &Study) -> String {
    let Recount {
        scale, intervals, ..
    } = &study.recount;
    let paper = (
        "paper",
        Some(&TABLE_4[..]),
        Some(&scale.scores),
        intervals,
        &[][..],
    );
    let ours = study.methods.iter().map(|of| {
        let (scores, long_run) = (of.scores.as_ref(), &of.long_run_scores[..]);
        (of.method, None, scores, &of.score_intervals, long_run)
    });
    let all = [paper].into_iter().chain(ours);
    csv(
        all.flat_map(|(method, printed, scores, intervals, long_run)| {
            (0..SAMPLES_MM.len()).map(move |sample| {
                Record::default()
                    .with("method", method)
                    .with("wavelength_mm", SAMPLES_MM[sample])
                    .with("printed_score", printed.map(|scores| scores[sample]))
                    .with("score", scores.map(|scores| scores[sample]))
                    .between(["low", "high"], intervals[sample])
                    .with("long_run_score", long_run.get(sample).copied())
            })
        }),
    )
}

fn mosteller(study: &Study) -> String {
    csv(tables::tests(study).into_iter().map(|(of, test)| {
        Record::default()
            .with("of", of)
            .with("chi_square", test.chi_square)
            .with("freedom", short(test.freedom))
            .with("critical", test.critical)
            .with("p", test.p)
            .with("rejected", short(test.rejects()))
    }))
}

fn felt(study: &Study) -> String {
    csv(study.stimuli().map(|(method, stimulus)| {
        Record::default()
            .with("method", method)
            .with("wavelength_mm", stimulus.wavelength_mm)
            .with("waves", short(stimulus.waves))
            .with("presented_mean_mm", stimulus.mean_mm)
            .with("error_rms_percent", stimulus.error_percent)
            .with("scatter_rms_percent", stimulus.scatter_percent)
    }))
}

fn waves(study: &Study) -> String {
    csv(study.stimuli().flat_map(|(method, stimulus)| {
        stimulus.felt.waves.iter().map(move |wave| {
            Record::default()
                .with("method", method)
                .with("wavelength_mm", stimulus.wavelength_mm)
                .with("stroke", short(wave.stroke))
                .with("from_s", wave.from_s)
                .with("to_s", wave.to_s)
                .with("presented_mm", wave.wavelength_mm)
        })
    }))
}
