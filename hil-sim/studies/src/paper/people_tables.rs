//! Tables II to IV: the experiments with people, simulated.

use crate::paper::exhibit::{Exhibit, Part, number};
use crate::psychophysics::{
    Study, TABLE_3, felt, glimpses, limens, mean_share, mosteller_tests, scores, shares, span,
};

pub(super) fn table_2(study: &Study) -> Exhibit {
    let added_mm = study
        .limens
        .iter()
        .map(|column| (column.mean.limen_mm - column.clean.limen_mm).abs())
        .fold(0.0, f64::max);
    Exhibit {
        id: "table-2",
        title: "Table II: limens by the method of limits",
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
        parts: vec![Part::Table(limens(study))],
        shared: &["table-2.csv"],
        ..Exhibit::default()
    }
}

pub(super) fn table_3(study: &Study) -> Exhibit {
    let share = |name: &str| {
        let compared = study.contender(name);
        number(compared.map(|c| 100.0 * mean_share(&c.long_run)), 1)
    };
    let sticking = study.contender("counting-mild").and_then(|c| c.mean_share);
    Exhibit {
        id: "table-3",
        title: "Table III: shares of correct answers in paired comparison",
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
            number(100.0 * mean_share(&TABLE_3), 1),
        ),
        parts: [shares(study), felt(study), glimpses(study)]
            .map(Part::Table)
            .into(),
        shared: &["table-3.csv", "felt.csv", "waves.csv"],
        ..Exhibit::default()
    }
}

pub(super) fn table_4(study: &Study) -> Exhibit {
    let recount = &study.recount;
    Exhibit {
        id: "table-4",
        title: "Table IV: Thurstone's Case V, and Mosteller's test",
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
        parts: [scores(study), mosteller_tests(study)].map(Part::Table).into(),
        shared: &["table-4.csv", "mosteller.csv"],
        ..Exhibit::default()
    }
}
