//! Tables II to IV: the experiments with people, simulated.

use crate::paper::exhibit::{Exhibit, Part, number};
use crate::psychophysics::interval::{Interval, wilson};
use crate::psychophysics::mosteller::Test;
use crate::psychophysics::pair::Pair;
use crate::psychophysics::pairs::mean_share;
use crate::psychophysics::published::{
    CHI_SQUARE, CRITICAL, FREEDOM, SAMPLES_MM, TABLE_3, TABLE_4,
};
use crate::psychophysics::study::Study;

fn span(interval: Option<Interval>) -> String {
    interval.map_or("–".into(), |i| {
        format!("{} to {}", number(Some(i.low), 2), number(Some(i.high), 2))
    })
}

fn texts(heads: &[&str]) -> Vec<String> {
    heads.iter().map(|&head| head.to_owned()).collect()
}

/// What the stimuli felt like.
fn felt(study: &Study) -> Part {
    let given = study.given.iter().map(|stimulus| ("given", stimulus));
    let estimated = study
        .methods
        .iter()
        .flat_map(|compared| compared.samples.iter().map(|s| (compared.method, s)));
    let rows = given
        .chain(estimated)
        .filter(|(_, stimulus)| SAMPLES_MM.contains(&stimulus.wavelength_mm))
        .map(|(method, stimulus)| {
            vec![
                method.to_owned(),
                stimulus.wavelength_mm.to_string(),
                stimulus.waves.to_string(),
                number(Some(stimulus.mean_mm), 3),
                number(Some(stimulus.error_percent), 2),
                number(Some(stimulus.scatter_percent), 2),
            ]
        });
    Part::Table {
        caption: "What the actuators' voltages present, wave by wave".into(),
        heads: texts(&[
            "λ from",
            "λ, mm",
            "waves",
            "mean, mm",
            "error, rms %",
            "scatter, rms %",
        ]),
        rows: rows.collect(),
    }
}

pub(super) fn table_2(study: &Study) -> Exhibit {
    let mut rows = Vec::new();
    let mut added_mm = 0.0f64;
    for column in &study.limens {
        added_mm = added_mm.max((column.mean.limen_mm - column.clean.limen_mm).abs());
        for line in column.lines() {
            let [paper, once, mean, clean] = line.each_mm.map(|mm| number(Some(mm), 3));
            let head = format!("{} mm: {}", column.paper.standard_mm, line.name);
            rows.push(vec![head, paper, once, span(line.interval), mean, clean]);
        }
    }
    Exhibit {
        id: "table-2",
        title: "Table II: limens by the method of limits".into(),
        paper: format!(
            "Three subjects, λ given to the display, steps of 0.2 mm, two series either way. Our observers have the \
             paper's limens as 75 % points; \"95 %\" is the middle of {} experiments of that size, \"clean\" their mean \
             were the stimuli without error.",
            study.repetitions
        ),
        seen: format!(
            "The display's stimulus changes no limen by more than {added_mm:.3} mm, and an experiment of the paper's \
             size can miss a limen by a third to either side. That our means are the paper's only says that what was \
             put in came out, through real voltages; the rest of the difference is the method's, in which the first \
             answer of its kind decides."
        ),
        parts: vec![Part::Table {
            caption: "Limens in mm".into(),
            heads: texts(&["standard", "paper", "ours", "95 %", "mean", "clean"]),
            rows,
        }],
        csvs: Vec::new(),
        shared: &["table-2.csv"],
    }
}

fn cell(pair: &Pair) -> String {
    let interval = span(Some(wilson(pair.correct, pair.trials)));
    format!("{:.2} ({interval})", pair.share())
}

pub(super) fn table_3(study: &Study) -> Exhibit {
    let mut heads = texts(&["pair, mm", "paper"]);
    for compared in &study.methods {
        heads.push(compared.method.to_owned());
        heads.push("long run".into());
    }
    let mut rows: Vec<Vec<String>> = Vec::new();
    for (at, paper) in TABLE_3.iter().enumerate() {
        let pair = format!(
            "{} : {}",
            SAMPLES_MM[paper.shorter], SAMPLES_MM[paper.longer]
        );
        let mut row = vec![pair, cell(paper)];
        for compared in &study.methods {
            row.push(cell(&compared.once[at]));
            row.push(number(Some(compared.long_run[at].share()), 4));
        }
        rows.push(row);
    }
    let mut means = vec!["mean".to_owned(), number(Some(mean_share(&TABLE_3)), 3)];
    for compared in &study.methods {
        let once = mean_share(&compared.once);
        means.push(format!("{once:.3} ({})", span(compared.mean_share)));
        means.push(number(Some(mean_share(&compared.long_run)), 4));
    }
    rows.push(means);
    let share = |name: &str| {
        let compared = study.contender(name);
        number(compared.map(|c| 100.0 * mean_share(&c.long_run)), 1)
    };
    let sticking = study.contender("counting-mild").and_then(|c| c.mean_share);
    let glimpses = study
        .methods
        .iter()
        .map(|compared| {
            let shares = compared.by_glimpse.map(|share| number(Some(share), 4));
            std::iter::once(compared.method.to_owned())
                .chain(shares)
                .collect()
        })
        .collect();
    Exhibit {
        id: "table-3",
        title: "Table III: shares of correct answers in paired comparison".into(),
        paper: format!(
            "One subject, ten trials a pair. Ours: {} trials, Wilson's 95 % intervals (for the mean: the middle 95 % \
             of {} such experiments), all with the same rubs of each specimen: another seed, which is another hand, \
             moves the counts' means by some hundredths.",
            study.trials, study.repetitions
        ),
        seen: format!(
            "An observer of Table II's skin would be right in {} % of the trials in the long run with a count over a \
             fingertip that only slides, in {} % if it sticks and slips a little (\"mild\", a guess: ten trials a pair then \
             give {} in 95 % of the experiments), and in {} % with the default estimator, where the skin is the limit; \
             the paper's subject was in {} %. So whole counts alone do not explain his errors, and counts over a fingertip \
             that sticks can, which is what the paper supposes; that they do is not shown here.",
            share("counting"),
            share("counting-mild"),
            span(sticking),
            share("default"),
            number(Some(100.0 * mean_share(&TABLE_3)), 1),
        ),
        parts: vec![
            Part::Table {
                caption: "Shares of correct answers".into(),
                heads,
                rows,
            },
            felt(study),
            Part::Table {
                caption: "Mean share in the long run, by how long a sensation is gathered".into(),
                heads: texts(&["λ from", "one wave", "0.1 s (taken above)", "a stroke"]),
                rows: glimpses,
            },
        ],
        csvs: Vec::new(),
        shared: &["table-3.csv", "felt.csv", "waves.csv"],
    }
}

pub(super) fn table_4(study: &Study) -> Exhibit {
    let recount = &study.recount;
    let row = |name: String, values: &mut dyn Iterator<Item = String>| -> Vec<String> {
        std::iter::once(name).chain(values).collect()
    };
    let scores = |name: &str, scores: &[f64]| {
        row(
            name.to_owned(),
            &mut scores.iter().map(|&s| number(Some(s), 4)),
        )
    };
    let spans = |name: &str, spans: &[Option<Interval>]| {
        row(name.to_owned(), &mut spans.iter().map(|&i| span(i)))
    };
    let mut rows = vec![
        scores("paper, printed", &TABLE_4),
        scores("paper, recounted", &recount.scale.scores),
        spans("its bootstrap, 95 %", &recount.intervals),
    ];
    let tested = |name: &str, test: &Test| {
        vec![
            name.to_owned(),
            number(Some(test.chi_square), 2),
            test.freedom.to_string(),
            number(Some(test.critical), 2),
            number(Some(test.p), 3),
            if test.rejects() {
                "rejected"
            } else {
                "not rejected"
            }
            .to_owned(),
        ]
    };
    let mut tests = vec![
        vec![
            "paper, printed".into(),
            number(Some(CHI_SQUARE), 2),
            FREEDOM.to_string(),
            number(Some(CRITICAL), 2),
            number(None, 3),
            "not rejected".into(),
        ],
        tested("recounted, cell of 1.00 as 0.95", &recount.half_an_answer),
        tested("the same, by simulation", &recount.simulated),
        tested("recounted, cell left out", &recount.left_out),
        tested("recounted, cell as it is", &recount.as_it_is),
    ];
    for compared in &study.methods {
        let method = compared.method;
        let once = format!("{method}, once");
        rows.push(match &compared.scores {
            Some(of) => scores(&once, of),
            None => {
                let none = SAMPLES_MM.iter().map(|_| number(None, 4));
                row(once.clone(), &mut none.into_iter())
            }
        });
        let scaled = 100.0 * compared.scaled;
        let of_those = format!("{method}, 95 % of the {scaled:.1} % with a scale");
        rows.push(spans(&of_those, &compared.score_intervals));
        rows.push(scores(
            &format!("{method}, long run"),
            &compared.long_run_scores,
        ));
        tests.extend(compared.test.map(|test| tested(&once, &test)));
        let long_run = compared.long_run_test;
        tests.extend(long_run.map(|test| tested(&format!("{method}, long run"), &test)));
    }
    Exhibit {
        id: "table-4",
        title: "Table IV: Thurstone's Case V, and Mosteller's test".into(),
        paper: "The paper says that the model fits, since 8.72 is below 14.07, the critical value of 7 degrees of \
                freedom."
            .into(),
        seen: format!(
            "The paper's Table IV follows from its Table III to the last digit if the cell of 1.00 is left out, and its \
             χ² if that cell counts as 0.95; but four samples have 3 degrees of freedom, so Case V is rejected (critical \
             {:.2}, p = {:.3}). Ten trials a pair are few for all of this: the scale's intervals are as wide as the scale, \
             the test rejects a Case V that holds in {:.0} % of the tables instead of in 5 % (by that measure p = {:.3}), and \
             where samples are hardly ever confused there mostly is no scale at all (a dash), but in the long run.",
            recount.half_an_answer.critical,
            recount.half_an_answer.p,
            100.0 * recount.rejected_though_true,
            recount.simulated.p,
        ),
        parts: vec![
            Part::Table {
                caption: "Scores".into(),
                heads: texts(&["", "1 mm", "2 mm", "3 mm", "4 mm"]),
                rows,
            },
            Part::Table {
                caption: "Mosteller's χ²".into(),
                heads: texts(&["", "χ²", "freedom", "critical, 5 %", "p", "Case V"]),
                rows: tests,
            },
        ],
        csvs: Vec::new(),
        shared: &["table-4.csv", "mosteller.csv"],
    }
}
