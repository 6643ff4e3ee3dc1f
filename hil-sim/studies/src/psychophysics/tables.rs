//! A study as text for a terminal.

use std::fmt::Write;

use crate::psychophysics::DISCLAIMER;
use crate::psychophysics::interval::{Interval, guessing, wilson};
use crate::psychophysics::mosteller::{LEVEL, Test, critical};
use crate::psychophysics::pair::Pair;
use crate::psychophysics::pairs::mean_share;
use crate::psychophysics::published::{
    CHI_SQUARE, CRITICAL, FREEDOM, SAMPLES_MM, TABLE_3, TABLE_4,
};
use crate::psychophysics::study::{Compared, Study};

/// The whole study.
pub fn text(study: &Study) -> String {
    let mut text = format!(
        "The paper's experiments with people, simulated: engine {}, seed {}, friction {}.\n{}\n\n",
        study.engine,
        study.seed,
        study.friction,
        wrapped(DISCLAIMER),
    );
    text += &felt(study);
    text += &limens(study);
    text += &shares(study);
    text += &scales(study);
    text += &recount(study);
    text
}

/// Lines of at most 100 characters.
fn wrapped(text: &str) -> String {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.is_empty() => *line = word.to_owned(),
            Some(line) if line.chars().count() + word.chars().count() < 100 => {
                *line += " ";
                *line += word;
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines.join("\n")
}

fn span(interval: Option<Interval>) -> String {
    interval.map_or("–".into(), |i| format!("{:.2}–{:.2}", i.low, i.high))
}

fn felt(study: &Study) -> String {
    let mut text = String::from(
        "What the actuators' voltages present: the hand's travel for each wave, over all strokes. (Where it is\n\
         called \"mild\", the fingertip on the specimen sticks and slips a little.)\n\n\
         λ, mm  estimator      waves  mean, mm  error rms, %  scatter rms, %\n",
    );
    let given = study
        .given
        .iter()
        .filter(|stimulus| SAMPLES_MM.contains(&stimulus.wavelength_mm))
        .map(|stimulus| ("given", stimulus));
    let estimated = study
        .methods
        .iter()
        .flat_map(|compared| compared.samples.iter().map(|s| (compared.method, s)));
    for (method, stimulus) in given.chain(estimated) {
        let _ = writeln!(
            text,
            "{:>5}  {method:<13} {:>6} {:>9.3} {:>13.2} {:>15.2}",
            stimulus.wavelength_mm,
            stimulus.waves,
            stimulus.mean_mm,
            stimulus.error_percent,
            stimulus.scatter_percent,
        );
    }
    text + "\n"
}

fn limens(study: &Study) -> String {
    let mut text = format!(
        "Table II, method of limits: three observers, two ascending and two descending series each, λ given\n\
         to the display. \"95 %\" is the middle of {} such experiments, \"clean\" their mean were the stimuli\n\
         without error.\n\n\
         standard                           paper    ours       95 %      mean   clean\n",
        study.repetitions
    );
    for column in &study.limens {
        for (at, line) in column.lines().into_iter().enumerate() {
            let standard = match at {
                0 => format!("{} mm", column.paper.standard_mm),
                _ => String::new(),
            };
            let [paper, once, mean, clean] = line.each_mm;
            let _ = writeln!(
                text,
                "{standard:>8}  {:<22} {paper:>8.3} {once:>7.3} {:>11} {mean:>8.3} {clean:>7.3}",
                line.name,
                span(line.interval),
            );
        }
    }
    text + "\n"
}

fn cell(pair: &Pair) -> String {
    format!(
        "{:.2} ({})",
        pair.share(),
        span(Some(wilson(pair.correct, pair.trials)))
    )
}

fn shares(study: &Study) -> String {
    let mut text = format!(
        "Table III, paired comparison, {} trials a pair ({} in the paper): share of correct answers, Wilson's\n\
         95 % interval, and where the share goes in the long run.\n\n\
         pair     paper           ",
        study.trials, TABLE_3[0].trials,
    );
    for compared in &study.methods {
        let _ = write!(text, "  {:<16} long run", compared.method);
    }
    text += "\n";
    for (at, paper) in TABLE_3.iter().enumerate() {
        let _ = write!(
            text,
            "{} : {}    {:<16}",
            SAMPLES_MM[paper.shorter],
            SAMPLES_MM[paper.longer],
            cell(paper)
        );
        for compared in &study.methods {
            let long_run = compared.long_run[at].share();
            let _ = write!(text, "  {:<16} {long_run:>8.4}", cell(&compared.once[at]));
        }
        text += "\n";
    }
    let _ = write!(
        text,
        "mean     {:<16}",
        format!("{:.3}", mean_share(&TABLE_3))
    );
    for compared in &study.methods {
        let once = format!(
            "{:.3} ({})",
            mean_share(&compared.once),
            span(compared.mean_share)
        );
        let _ = write!(text, "  {once:<16} {:>8.4}", mean_share(&compared.long_run));
    }
    let _ = writeln!(
        text,
        "\n\nThe mean's interval is the middle 95 % of {} such experiments, all with the same rubs of these specimens:\n\
         another --seed is another hand and other noise, which moves the counts' means by some hundredths.\n\
         Mean share in the long run if a sensation is gathered over one wave, {} s (taken above, a guess), a stroke:",
        study.repetitions, study.glimpse_s,
    );
    for compared in &study.methods {
        let [wave, taken, stroke] = compared.by_glimpse;
        let _ = writeln!(
            text,
            "  {:<13} {wave:.4}  {taken:.4}  {stroke:.4}",
            compared.method
        );
    }
    text + "\n"
}

fn scores(scores: &[f64]) -> String {
    scores
        .iter()
        .map(|score| format!("{score:>8.4}"))
        .collect::<Vec<_>>()
        .join("")
}

fn said(test: &Test) -> String {
    format!(
        "χ² = {:.2}, {} degrees of freedom, critical {:.2}, p = {:.3}: Case V is {}",
        test.chi_square,
        test.freedom,
        test.critical,
        test.p,
        if test.rejects() {
            "rejected"
        } else {
            "not rejected"
        }
    )
}

fn scales(study: &Study) -> String {
    let mut text = String::from(
        "Table IV, Thurstone's Case V: least squares without the pairs that were always answered alike.\n\n\
         \x20                            1 mm    2 mm    3 mm    4 mm\n",
    );
    let _ = writeln!(text, "paper, printed          {}", scores(&TABLE_4));
    let _ = writeln!(
        text,
        "paper, recounted        {}",
        scores(&study.recount.scale.scores)
    );
    let ends = |intervals: &[Option<Interval>], end: fn(&Interval) -> f64| -> String {
        let ends = intervals.iter().map(|interval| {
            interval
                .as_ref()
                .map_or("       –".into(), |i| format!("{:>8.4}", end(i)))
        });
        ends.collect()
    };
    let _ = writeln!(
        text,
        "  95 % from             {}",
        ends(&study.recount.intervals, |i| i.low)
    );
    let _ = writeln!(
        text,
        "       to               {}",
        ends(&study.recount.intervals, |i| i.high)
    );
    for compared in &study.methods {
        text += &scale_of(compared, study.repetitions, &ends);
    }
    text + "\n"
}

fn scale_of(
    compared: &Compared,
    repetitions: u32,
    ends: &impl Fn(&[Option<Interval>], fn(&Interval) -> f64) -> String,
) -> String {
    let method = compared.method;
    let mut text = String::new();
    match (&compared.scores, &compared.no_scale) {
        (Some(of), _) => {
            let _ = writeln!(text, "{:<24}{}", format!("{method}, once"), scores(of));
        }
        (None, reason) => {
            let reason = reason.as_deref().unwrap_or("no scale");
            let _ = writeln!(text, "{method}, once\n  {reason}");
        }
    }
    let _ = writeln!(
        text,
        "  95 % from             {}",
        ends(&compared.score_intervals, |i| i.low)
    );
    let _ = writeln!(
        text,
        "       to               {}",
        ends(&compared.score_intervals, |i| i.high)
    );
    let long_run = scores(&compared.long_run_scores);
    let _ = writeln!(text, "{:<24}{long_run}", format!("{method}, long run"));
    if let Some(test) = &compared.test {
        let _ = writeln!(text, "  {}", said(test));
    }
    let _ = write!(
        text,
        "  {:.1} % of {} such experiments have a scale",
        100.0 * compared.scaled,
        repetitions,
    );
    if let Some(rejected) = compared.rejected {
        let _ = write!(
            text,
            " (the 95 % are of those), of which Mosteller's test rejects {:.0} %",
            100.0 * rejected
        );
    }
    if let Some(test) = &compared.long_run_test {
        let _ = write!(text, "\n  in the long run: {}", said(test));
    }
    text + "\n"
}

fn recount(study: &Study) -> String {
    let recount = &study.recount;
    let pairs = TABLE_3.len() as f64;
    let worst = guessing(9, 10);
    format!(
        "The paper's own numbers, counted again:\n\
         - Table IV follows from Table III to its last digit if the cell of 1.00 is left out. Its intervals\n\
         \x20 (parametric bootstrap of shares (k + ½)/(n + 1)) are as wide as the scale: ten trials a pair order\n\
         \x20 the samples, and measure no distances.\n\
         - With that cell at 0.95:\n\
         \x20 {}.\n\
         \x20 The paper has {CHI_SQUARE} too, takes {FREEDOM} degrees of freedom, critical {CRITICAL} ({:.2} here), and\n\
         \x20 says that the model fits. Four samples have (4 − 1)(4 − 2)/2 = 3: at {:.0} % it does not fit.\n\
         - Without the cell, {}.\n\
         - With the cell at 1, {}.\n\
         - Ten trials a pair are few for this test: of {} tables drawn from the paper's own scale, so that Case V\n\
         \x20 holds, it rejects {:.0} % instead of {:.0} %. Held against those tables:\n\
         \x20 {}.\n\
         - Nine of ten right, which the paper marks as significant at 95 %, come about by guessing in {:.1} %,\n\
         \x20 each pair by itself (exact, one-sided); for six pairs at once (Bonferroni) in up to {:.1} %. Only the\n\
         \x20 pair of 2 and 4 mm (ten of ten: {:.2} %, times six {:.1} %) stands that.\n",
        said(&recount.half_an_answer),
        critical(FREEDOM).unwrap_or(f64::NAN),
        100.0 * LEVEL,
        said(&recount.left_out),
        said(&recount.as_it_is),
        study.repetitions,
        100.0 * recount.rejected_though_true,
        100.0 * LEVEL,
        said(&recount.simulated),
        100.0 * worst,
        100.0 * (pairs * worst).min(1.0),
        100.0 * guessing(10, 10),
        100.0 * pairs * guessing(10, 10),
    )
}
