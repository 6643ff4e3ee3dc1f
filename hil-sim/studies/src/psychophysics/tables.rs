//! A study's tables, for a terminal and for a page, and all of it as text.

use crate::psychophysics::DISCLAIMER;
use crate::psychophysics::interval::{Interval, guessing, wilson};
use crate::psychophysics::mosteller::{LEVEL, Test, critical};
use crate::psychophysics::pair::Pair;
use crate::psychophysics::pairs::mean_share;
use crate::psychophysics::published::{
    CHI_SQUARE, CRITICAL, FREEDOM, SAMPLES_MM, TABLE_3, TABLE_4,
};
use crate::psychophysics::study::{Compared, Study};

/// A table.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// What it is of.
    pub caption: &'static str,
    /// Its heads.
    pub heads: Vec<String>,
    /// Its rows, the first cell of each its head.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    fn new(caption: &'static str, heads: &[&str], rows: Vec<Vec<String>>) -> Self {
        Self {
            caption,
            heads: heads.iter().map(|&head| head.to_owned()).collect(),
            rows,
        }
    }

    /// In columns for a terminal: the first to the left, the others to the right.
    fn text(&self) -> String {
        let lines = || std::iter::once(&self.heads).chain(&self.rows);
        let width = |column: usize| {
            let widths = lines().filter_map(|line| Some(line.get(column)?.chars().count()));
            widths.max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.heads.len()).map(width).collect();
        let line = |cells: &Vec<String>| {
            let cells = cells.iter().zip(&widths).enumerate();
            let padded = cells.map(|(column, (cell, &width))| match column {
                0 => format!("{cell:<width$}"),
                _ => format!("{cell:>width$}"),
            });
            padded.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
        };
        lines().map(line).collect()
    }
}

/// A number with so many decimals.
fn fixed(value: f64, decimals: usize) -> String {
    format!("{value:.decimals$}").replace('-', "−")
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

/// A row: its head, then its cells.
fn row(head: impl Into<String>, cells: impl IntoIterator<Item = String>) -> Vec<String> {
    std::iter::once(head.into()).chain(cells).collect()
}

/// What the stimuli felt like.
pub fn felt(study: &Study) -> Table {
    let heads = [
        "λ from",
        "λ, mm",
        "waves",
        "mean, mm",
        "error, rms %",
        "scatter, rms %",
    ];
    let shown = study
        .stimuli()
        .filter(|(_, stimulus)| SAMPLES_MM.contains(&stimulus.wavelength_mm));
    let rows = shown.map(|(method, stimulus)| {
        let cells = [
            stimulus.wavelength_mm.to_string(),
            stimulus.waves.to_string(),
            fixed(stimulus.mean_mm, 3),
            fixed(stimulus.error_percent, 2),
            fixed(stimulus.scatter_percent, 2),
        ];
        row(method, cells)
    });
    let caption = "What the actuators' voltages present, wave by wave";
    Table::new(caption, &heads, rows.collect())
}

/// Table II.
pub fn limens(study: &Study) -> Table {
    let heads = ["standard", "paper", "ours", "95 %", "mean", "clean"];
    let rows = study.limens.iter().flat_map(|column| {
        column.lines().map(|line| {
            let [paper, once, mean, clean] = line.each_mm.map(|mm| fixed(mm, 3));
            let head = format!("{} mm: {}", column.paper.standard_mm, line.name);
            row(head, [paper, once, span(line.interval), mean, clean])
        })
    });
    Table::new("Limens in mm", &heads, rows.collect())
}

/// Table III.
pub fn shares(study: &Study) -> Table {
    let cell = |pair: &Pair| {
        let interval = span(Some(wilson(pair.correct, pair.trials)));
        format!("{} ({interval})", fixed(pair.share(), 2))
    };
    let methods = &study.methods;
    let heads = methods.iter().flat_map(|of| [of.method, "long run"]);
    let heads: Vec<&str> = ["pair, mm", "paper"].into_iter().chain(heads).collect();
    let pairs = TABLE_3.iter().enumerate().map(|(at, paper)| {
        let ours = methods.iter().flat_map(|of| {
            let long_run = fixed(of.long_run[at].share(), 4);
            [cell(&of.once[at]), long_run]
        });
        let [shorter, longer] = [paper.shorter, paper.longer].map(|at| SAMPLES_MM[at]);
        let cells = std::iter::once(cell(paper)).chain(ours);
        row(format!("{shorter} : {longer}"), cells)
    });
    let means = methods.iter().flat_map(|of| {
        let once = fixed(mean_share(&of.once), 3);
        let long_run = fixed(mean_share(&of.long_run), 4);
        [format!("{once} ({})", span(of.mean_share)), long_run]
    });
    let of_paper = fixed(mean_share(&TABLE_3), 3);
    let mean = row("mean", std::iter::once(of_paper).chain(means));
    let rows = pairs.chain(std::iter::once(mean)).collect();
    Table::new("Shares of correct answers", &heads, rows)
}

/// Mean shares by how long a sensation is gathered.
pub fn glimpses(study: &Study) -> Table {
    let rows = study.methods.iter().map(|compared| {
        let shares = compared.by_glimpse.map(|share| fixed(share, 4));
        row(compared.method, shares)
    });
    Table::new(
        "Mean share in the long run, by how long a sensation is gathered",
        &["λ from", "one wave", "0.1 s (taken above)", "a stroke"],
        rows.collect(),
    )
}

/// Table IV.
pub fn scores(study: &Study) -> Table {
    let scores = |head: String, scores: &[f64]| row(head, scores.iter().map(|&s| fixed(s, 4)));
    let ends = |intervals: &[Option<Interval>]| {
        let end = |end: fn(Interval) -> f64| {
            let ends = intervals.iter().map(|i| number(i.map(end), 4));
            ends.collect::<Vec<_>>()
        };
        [
            row("  95 % from", end(|i| i.low)),
            row("       to", end(|i| i.high)),
        ]
    };
    let recount = &study.recount;
    let mut rows = vec![
        scores("paper, printed".into(), &TABLE_4),
        scores("paper, recounted".into(), &recount.scale.scores),
    ];
    rows.extend(ends(&recount.intervals));
    for compared in &study.methods {
        let method = compared.method;
        let once = format!("{method}, once");
        rows.push(match &compared.scores {
            Some(of) => scores(once, of),
            None => row(once, SAMPLES_MM.map(|_| number(None, 4))),
        });
        rows.extend(ends(&compared.score_intervals));
        let long_run = &compared.long_run_scores;
        rows.push(scores(format!("{method}, long run"), long_run));
    }
    Table::new("Scores", &["", "1 mm", "2 mm", "3 mm", "4 mm"], rows)
}

/// Mosteller's tests by what they are of: the paper's numbers counted again, then every contender's.
pub fn tests(study: &Study) -> Vec<(String, Test)> {
    let recount = &study.recount;
    let mut tests = vec![
        (
            "paper, cell of 1.00 as 0.95".to_owned(),
            recount.half_an_answer,
        ),
        (
            "paper, the same by simulation".to_owned(),
            recount.simulated,
        ),
        ("paper, cell of 1.00 left out".to_owned(), recount.left_out),
        ("paper, cell of 1.00 as it is".to_owned(), recount.as_it_is),
    ];
    for compared in &study.methods {
        let of = [
            ("once", compared.test),
            ("long run", compared.long_run_test),
        ];
        let made = of.into_iter().filter_map(|(of, test)| Some((of, test?)));
        tests.extend(made.map(|(of, test)| (format!("{}, {of}", compared.method), test)));
    }
    tests
}

/// Mosteller's tests, below what the paper printed.
pub fn mosteller(study: &Study) -> Table {
    let verdict = |rejects| if rejects { "rejected" } else { "not rejected" };
    let cells = |chi_square, freedom: u32, critical, p, rejects| {
        [
            fixed(chi_square, 2),
            freedom.to_string(),
            fixed(critical, 2),
            number(p, 3),
            verdict(rejects).to_owned(),
        ]
    };
    let printed = cells(CHI_SQUARE, FREEDOM, CRITICAL, None, false);
    let ours = tests(study).into_iter().map(|(of, test)| {
        let Test {
            chi_square,
            freedom,
            critical,
            p,
            ..
        } = test;
        row(
            of,
            cells(chi_square, freedom, critical, Some(p), test.rejects()),
        )
    });
    let rows = std::iter::once(row("paper, printed", printed)).chain(ours);
    let heads = ["", "χ²", "freedom", "critical, 5 %", "p", "Case V"];
    Table::new("Mosteller's χ²", &heads, rows.collect())
}

/// The whole study.
pub fn text(study: &Study) -> String {
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
                 series each, λ given to the display. \"95 %\" is the middle of {} such experiments, \"clean\" \
                 their mean were the stimuli without error.",
                study.repetitions
            ),
            limens(study),
        ),
        (
            format!(
                "Table III, paired comparison, {} trials a pair ({} in the paper): share of correct answers, \
                 Wilson's 95 % interval, and where the share goes in the long run. The mean's interval is the \
                 middle 95 % of {} such experiments, all with the same rubs of these specimens: another --seed is \
                 another hand and other noise, which moves the counts' means by some hundredths.",
                study.trials, TABLE_3[0].trials, study.repetitions
            ),
            shares(study),
        ),
        (
            format!(
                "Mean share in the long run if a sensation is gathered over one wave, {} s (taken above, a \
                 guess), a stroke:",
                study.glimpse_s
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
            mosteller(study),
        ),
    ];
    let tables = tables
        .into_iter()
        .map(|(words, table)| format!("{}\n\n{}\n", wrapped(&words), table.text()));
    let scaled = study
        .methods
        .iter()
        .map(|of| wrapped(&scaled(of, study)) + "\n");
    format!(
        "The paper's experiments with people, simulated: engine {}, seed {}, friction {}.\n{}\n\n{}{}\n{}",
        study.engine,
        study.seed,
        study.friction,
        wrapped(DISCLAIMER),
        tables.collect::<String>(),
        scaled.collect::<String>(),
        recount(study),
    )
}

/// How often comparisons with a contender have a scale, and why this one has none.
fn scaled(compared: &Compared, study: &Study) -> String {
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
        if test.rejects() {
            "rejected"
        } else {
            "not rejected"
        }
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
