//! A study's tables, for a terminal and for a page, and all of it as text.

use crate::output::rounded;
use crate::psychophysics::DISCLAIMER;
use crate::psychophysics::interval::{Interval, guessing, wilson};
use crate::psychophysics::mosteller::{LEVEL, Test, critical};
use crate::psychophysics::pair::Pair;
use crate::psychophysics::pairs::mean_share;
use crate::psychophysics::published::{
    CHI_SQUARE, CRITICAL, FREEDOM, SAMPLES_MM, TABLE_3, TABLE_4,
};
use crate::psychophysics::study::{Compared, Study};
use crate::study::{Record, Table, short};

fn fixed(value: f64, decimals: usize) -> String {
    rounded(value, decimals).replace('-', "−")
}

/// The same, or a dash.
fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or("–".to_owned(), |value| fixed(value, decimals))
}

/// From one end to the other, or a dash.
pub fn span(interval: Option<Interval>) -> String {
    interval.map_or("–".to_owned(), |i| {
        format!("{} to {}", fixed(i.low, 2), fixed(i.high, 2))
    })
}

pub fn felt(study: &Study) -> Table {
    let stimuli = study.stimuli();
    let shown = stimuli.filter(|(_, stimulus)| SAMPLES_MM.contains(&stimulus.wavelength_mm));
    let rows = shown.map(|(method, stimulus)| {
        Record::default()
            .with("λ from", method)
            .with("λ, mm", short(stimulus.wavelength_mm))
            .with("waves", short(stimulus.waves))
            .with("mean, mm", fixed(stimulus.mean_mm, 3))
            .with("error, rms %", fixed(stimulus.error_percent, 2))
            .with("scatter, rms %", fixed(stimulus.scatter_percent, 2))
    });
    Table::from_iter(rows).called("What the actuators' voltages present, wave by wave")
}

pub fn limens(study: &Study) -> Table {
    let rows = study.limens.iter().flat_map(|column| {
        column.lines().map(|line| {
            let [paper, once, mean, clean] = line.each_mm.map(|mm| fixed(mm, 3));
            let head = format!("{} mm: {}", column.paper.standard_mm, line.name);
            Record::default()
                .with("standard", head)
                .with("paper", paper)
                .with("ours", once)
                .with("95 %", span(line.interval))
                .with("mean", mean)
                .with("clean", clean)
        })
    });
    Table::from_iter(rows).called("Limens in mm")
}

pub fn shares(study: &Study) -> Table {
    let cell = |pair: &Pair| {
        let interval = span(Some(wilson(pair.correct, pair.trials)));
        format!("{} ({interval})", fixed(pair.share(), 2))
    };
    let pairs = TABLE_3.iter().enumerate().map(|(at, paper)| {
        let [shorter, longer] = [paper.shorter, paper.longer].map(|at| SAMPLES_MM[at]);
        let row = Record::default()
            .with("pair, mm", format!("{shorter} : {longer}"))
            .with("paper", cell(paper));
        study.methods.iter().fold(row, |row, of| {
            let long_run = fixed(of.long_run[at].share(), 4);
            row.with(of.method, cell(&of.once[at]))
                .with("long run", long_run)
        })
    });
    let means = Record::default()
        .with("pair, mm", "mean")
        .with("paper", fixed(mean_share(&TABLE_3), 3));
    let means = study.methods.iter().fold(means, |row, of| {
        let once = fixed(mean_share(&of.once), 3);
        let once = format!("{once} ({})", span(of.mean_share));
        row.with(of.method, once)
            .with("long run", fixed(mean_share(&of.long_run), 4))
    });
    Table::from_iter(pairs.chain([means])).called("Shares of correct answers")
}

pub fn glimpses(study: &Study) -> Table {
    let rows = study.methods.iter().map(|compared| {
        let [wave, taken, stroke] = compared.by_glimpse.map(|share| fixed(share, 4));
        Record::default()
            .with("λ from", compared.method)
            .with("one wave", wave)
            .with("0.1 s (taken above)", taken)
            .with("a stroke", stroke)
    });
    Table::from_iter(rows).called("Mean share in the long run, by how long a sensation is gathered")
}

pub fn scores(study: &Study) -> Table {
    const HEADS: [&str; 5] = ["", "1 mm", "2 mm", "3 mm", "4 mm"];
    let row = |head: String, scores: &mut dyn Iterator<Item = Option<f64>>| {
        let cells = scores.map(|score| number(score, 4));
        Record::of(&HEADS, [head].into_iter().chain(cells))
    };
    let known = |head: String, scores: &[f64]| row(head, &mut scores.iter().copied().map(Some));
    let ends = |intervals: &[Option<Interval>]| {
        let end = |head: &str, end: fn(Interval) -> f64| {
            row(head.to_owned(), &mut intervals.iter().map(|i| i.map(end)))
        };
        [end("  95 % from", |i| i.low), end("       to", |i| i.high)]
    };
    let recount = &study.recount;
    let mut rows = vec![
        known("paper, printed".into(), &TABLE_4),
        known("paper, recounted".into(), &recount.scale.scores),
    ];
    rows.extend(ends(&recount.intervals));
    for compared in &study.methods {
        let method = compared.method;
        let once = format!("{method}, once");
        rows.push(match &compared.scores {
            Some(of) => known(once, of),
            None => row(once, &mut SAMPLES_MM.into_iter().map(|_| None)),
        });
        rows.extend(ends(&compared.score_intervals));
        rows.push(known(
            format!("{method}, long run"),
            &compared.long_run_scores,
        ));
    }
    Table::from_iter(rows).called("Scores")
}

/// Mosteller's tests by what they are of: the paper's numbers counted again, then every contender's.
pub fn tests(study: &Study) -> Vec<(String, Test)> {
    let recount = &study.recount;
    let of_paper = [
        ("paper, cell of 1.00 as 0.95", recount.half_an_answer),
        ("paper, the same by simulation", recount.simulated),
        ("paper, cell of 1.00 left out", recount.left_out),
        ("paper, cell of 1.00 as it is", recount.as_it_is),
    ];
    let of_paper = of_paper.map(|(of, test)| (of.to_owned(), test));
    let ours = study.methods.iter().flat_map(|compared| {
        let of = [
            ("once", compared.test),
            ("long run", compared.long_run_test),
        ];
        let made = of.into_iter().filter_map(|(of, test)| Some((of, test?)));
        made.map(|(of, test)| (format!("{}, {of}", compared.method), test))
    });
    of_paper.into_iter().chain(ours).collect()
}

const fn verdict(rejects: bool) -> &'static str {
    if rejects { "rejected" } else { "not rejected" }
}

pub fn mosteller_tests(study: &Study) -> Table {
    let row = |of: String, chi_square, freedom: u32, critical, p, rejects| {
        Record::default()
            .with("", of)
            .with("χ²", fixed(chi_square, 2))
            .with("freedom", short(freedom))
            .with("critical, 5 %", fixed(critical, 2))
            .with("p", number(p, 3))
            .with("Case V", verdict(rejects))
    };
    let printed = "paper, printed".to_owned();
    let printed = row(printed, CHI_SQUARE, FREEDOM, CRITICAL, None, false);
    let ours = tests(study).into_iter().map(|(of, test)| {
        let rejects = test.rejects();
        row(
            of,
            test.chi_square,
            test.freedom,
            test.critical,
            Some(test.p),
            rejects,
        )
    });
    Table::from_iter([printed].into_iter().chain(ours)).called("Mosteller's χ²")
}

/// The whole study.
pub fn text(study: &Study) -> String {
    let Study {
        repetitions,
        trials,
        glimpse_s,
        ..
    } = study;
    let tables = [
        (
            "What the actuators' voltages present: the hand's travel for each wave, over all strokes. (Where it \
             is called \"mild\", the fingertip on the specimen sticks and slips a little.)"
                .to_owned(),
            felt(study),
        ),
        (
            format!(
                "Table II, method of limits, limens in mm: three observers, two ascending and two descending \
                 series each, λ given to the display. \"95 %\" is the middle of {repetitions} such experiments, \"clean\" \
                 their mean were the stimuli without error."
            ),
            limens(study),
        ),
        (
            format!(
                "Table III, paired comparison, {trials} trials a pair ({} in the paper): share of correct answers, \
                 Wilson's 95 % interval, and where the share goes in the long run. The mean's interval is the \
                 middle 95 % of {repetitions} such experiments, all with the same rubs of these specimens: another --seed is \
                 another hand and other noise, which moves the counts' means by some hundredths.",
                TABLE_3[0].trials
            ),
            shares(study),
        ),
        (
            format!(
                "Mean share in the long run if a sensation is gathered over one wave, {glimpse_s} s (taken above, a \
                 guess), a stroke:"
            ),
            glimpses(study),
        ),
        (
            "Table IV, Thurstone's Case V: least squares without the pairs that were always answered alike."
                .to_owned(),
            scores(study),
        ),
        (
            "Mosteller's test of Case V; in the long run as if its shares were of so many trials:".to_owned(),
            mosteller_tests(study),
        ),
    ];
    let tables = tables.map(|(words, table)| format!("{}\n\n{}\n", wrapped(&words), table.text()));
    let scaled = study.methods.iter();
    let scaled = scaled.map(|of| wrapped(&scaled_text(of, study)) + "\n");
    format!(
        "The paper's experiments with people, simulated: engine {}, seed {}, friction {}.\n{}\n\n{}{}\n{}",
        study.engine,
        study.seed,
        study.friction,
        wrapped(DISCLAIMER),
        tables.concat(),
        scaled.collect::<String>(),
        recount(study),
    )
}

/// How often comparisons with a contender have a scale, and why this one has none.
fn scaled_text(compared: &Compared, study: &Study) -> String {
    let none = compared.no_scale.as_deref();
    let none = none.map_or(String::new(), |reason| format!("once: {reason}; "));
    let rejected = compared.rejected.map_or(String::new(), |rejected| {
        format!(
            " (the 95 % are of those), of which Mosteller's test rejects {:.0} %",
            100.0 * rejected
        )
    });
    format!(
        "{}: {none}{:.1} % of {} such experiments have a scale{rejected}.",
        compared.method,
        100.0 * compared.scaled,
        study.repetitions,
    )
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

fn said(test: &Test) -> String {
    format!(
        "χ² = {:.2}, {} degrees of freedom, critical {:.2}, p = {:.3}: Case V is {}",
        test.chi_square,
        test.freedom,
        test.critical,
        test.p,
        verdict(test.rejects()),
    )
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
