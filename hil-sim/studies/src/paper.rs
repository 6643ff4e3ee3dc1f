//! The paper, figure by figure: `hil-sim paper`.
//!
//! Tables I to IV and Figs 4 to 8 of Okamoto et al. 2009, each from runs of the boards' firmware and beside
//! what the paper prints, as one HTML page with a CSV for each. (Figs 1 to 3 and 9 to 11 are drawings and
//! photographs.) Where the numbers of a figure stand only in its picture, ours stand alone: none is read off
//! a picture.

mod equation_11;
mod exhibit;
mod fig_4;
mod fig_5;
mod fig_6;
mod fig_7;
mod fig_8;
mod page;
mod people_tables;
mod plan;
mod published;
mod table_1;
mod theory;

use thiserror::Error;

use crate::psychophysics::{Plan, Silent, Study};
use hil_sim_core::run::recording::Recording;

use exhibit::Exhibit;

pub use plan::jobs;
pub use published::{CELLS_MM, PAPER_MM, SPEEDS_MM_S};

/// The report could not be made.
#[derive(Debug, Error)]
pub enum PaperError {
    /// There was nothing to be felt.
    #[error(transparent)]
    Silent(#[from] Silent),
    /// A run left too little behind: what was to be drawn from it, and what is not there.
    #[error("{0}: the run left no {1}")]
    Empty(&'static str, &'static str),
}

/// The report.
#[derive(Clone, Debug)]
pub struct Report {
    /// The page.
    pub html: String,
    /// The CSVs: names and texts.
    pub files: Vec<(&'static str, String)>,
    /// Conclusions that these runs do not bear out.
    pub contradicted: Vec<String>,
}

/// Makes the report of what [`jobs`] left, in its order. The page links its CSVs in `folder`, which lies
/// beside it.
pub fn report(plan: Plan, recordings: &[Recording], folder: &str) -> Result<Report, PaperError> {
    let runs = plan::Runs::new(&plan, recordings);
    let study = Study::new(plan, runs.people)?;
    let exhibits = [
        fig_4::exhibit(&runs)?,
        fig_5::exhibit(&runs)?,
        equation_11::exhibit(),
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
    Ok(Report {
        html,
        files: own.chain(crate::psychophysics::csvs(&study)).collect(),
        contradicted,
    })
}
