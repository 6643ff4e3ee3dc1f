//! The paper, figure by figure: `hil-sim paper`.
//!
//! Tables I to IV and Figs 4 to 8 of Okamoto et al. 2009, each from runs of the boards' firmware and beside
//! what the paper prints, as one HTML page with a CSV for each. (Figs 1 to 3 and 9 to 11 are drawings and
//! photographs.) Where the numbers of a figure stand only in its picture, ours stand alone: none is read off
//! a picture.
//!
//! | file | what |
//! | --- | --- |
//! | [`plan`] | what is run |
//! | [`theory`] | the paper's equations (8) to (11) |
//! | [`table_1`], [`fig_4`] to [`fig_8`], [`equation_11`] | from a run to an exhibit |
//! | [`people_tables`] | Tables II to IV |
//! | [`exhibit`], [`page`] | as HTML |

pub mod equation_11;
pub mod exhibit;
pub mod fig_4;
pub mod fig_5;
pub mod fig_6;
pub mod fig_7;
pub mod fig_8;
pub mod page;
pub mod people_tables;
pub mod plan;
pub mod published;
pub mod table_1;
pub mod theory;

use thiserror::Error;

use crate::psychophysics::study::{Plan, Silent, Study};
use hil_sim_core::run::recording::Recording;

pub use exhibit::Exhibit;

/// The report could not be made.
#[derive(Debug, Error)]
pub enum PaperError {
    /// There was nothing to be felt.
    #[error(transparent)]
    Silent(#[from] Silent),
    /// A run left too little behind.
    #[error("{exhibit}: the run left no {missing}")]
    Empty {
        /// What was to be drawn from it.
        exhibit: &'static str,
        /// What is not there.
        missing: &'static str,
    },
    /// A CSV could not be written.
    #[error("a CSV could not be made: {0}")]
    Csv(#[from] csv::Error),
}

/// The report.
#[derive(Clone, Debug)]
pub struct Report {
    /// The page.
    pub html: String,
    /// The CSVs: names and texts.
    pub files: Vec<(String, String)>,
    /// Conclusions that these runs do not bear out.
    pub contradicted: Vec<String>,
}

/// Makes the report of what [`plan::jobs`] left, in its order. The page links its CSVs in `folder`, which lies
/// beside it.
///
/// # Errors
/// If a run is too empty, or something cannot be drawn or written.
pub fn report(
    study_plan: Plan,
    recordings: &[Recording],
    folder: &str,
) -> Result<Report, PaperError> {
    let runs = plan::Runs::new(&study_plan, recordings);
    let study = Study::new(study_plan, runs.people)?;
    let exhibits = vec![
        fig_4::exhibit(&runs)?,
        fig_5::exhibit(&runs)?,
        equation_11::exhibit()?,
        table_1::exhibit(&runs)?,
        fig_6::exhibit(&runs)?,
        fig_7::exhibit(&runs)?,
        fig_8::exhibit(&runs)?,
        people_tables::table_2(&study),
        people_tables::table_3(&study),
        people_tables::table_4(&study),
    ];
    let html = page::html(&exhibits, &study, recordings, folder);
    let contradicted = exhibits.iter().flat_map(Exhibit::contradicted).collect();
    let own = exhibits.into_iter().flat_map(|exhibit| exhibit.csvs);
    let of_people = crate::psychophysics::record::csvs(&study)?;
    let of_people = of_people
        .into_iter()
        .map(|(name, text)| (name.to_owned(), text));
    Ok(Report {
        html,
        files: own.chain(of_people).collect(),
        contradicted,
    })
}
