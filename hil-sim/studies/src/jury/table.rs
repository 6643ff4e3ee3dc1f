//! Shares by class, with intervals.

use serde::Serialize;

use super::counts::Counts;
use crate::psychophysics::interval::{Interval, wilson};

/// What the intervals are, for headings.
pub const INTERVALS: &str = "Wilson's, 95 %, each surface taken as one trial";

/// A share, and where it may really lie.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Share {
    /// Of all time that counted.
    pub share: f64,
    /// [`INTERVALS`]
    pub interval: Interval,
}

/// Surfaces of a kind, taken together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// What they have in common.
    pub name: String,
    /// How many of them had time that counted.
    pub surfaces: usize,
    /// Valid and within 5 % of the truth.
    pub right: Option<Share>,
    /// Valid and more than 10 % off, or valid where there is no period.
    pub wrong: Option<Share>,
    /// Not valid.
    pub silent: Option<Share>,
    /// Driven at a λ within 5 % of the truth.
    pub felt_right: Option<Share>,
    /// Driven at one more than 10 % off, or driven where there is no period.
    pub felt_wrong: Option<Share>,
}

/// The headings of a row's shares.
const COLUMNS: [&str; 5] = ["right", "wrong", "silent", "felt right", "felt wrong"];

/// What came of one surface, and how much it counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weighed {
    /// Against the others.
    pub weight: f64,
    /// Share that is right, 0 to 1.
    pub right: f64,
    /// Share that is wrong.
    pub wrong: f64,
    /// Share that is silent.
    pub silent: f64,
}

impl Weighed {
    /// A surface that counts as much as it has time; none without any.
    pub fn by_time(counts: &Counts) -> Option<Self> {
        let all = f64::from(counts.all);
        (counts.all > 0).then(|| Self {
            weight: all,
            right: f64::from(counts.right) / all,
            wrong: f64::from(counts.wrong) / all,
            silent: f64::from(counts.silent) / all,
        })
    }

    /// A surface that counts as much as any other; none without any time.
    pub fn alike(counts: &Counts) -> Option<Self> {
        Self::by_time(counts).map(|weighed| Self {
            weight: 1.0,
            ..weighed
        })
    }
}

impl Row {
    /// Takes surfaces together: what was said of each, and what was felt.
    pub fn of(name: &str, said: &[Weighed], felt: &[Weighed]) -> Self {
        Self {
            name: name.to_owned(),
            surfaces: said.len(),
            right: share(said, |surface| surface.right),
            wrong: share(said, |surface| surface.wrong),
            silent: share(said, |surface| surface.silent),
            felt_right: share(felt, |surface| surface.right),
            felt_wrong: share(felt, |surface| surface.wrong),
        }
    }

    const fn shares(&self) -> [Option<Share>; COLUMNS.len()] {
        [
            self.right,
            self.wrong,
            self.silent,
            self.felt_right,
            self.felt_wrong,
        ]
    }
}

/// The weighted mean of the surfaces' shares; none without any.
///
/// Estimates of one surface depend on each other, so that their number says little. For the interval each
/// surface is one trial, as if all its estimates were alike: too wide rather than too narrow. Where they
/// weigh differently, there are (Σw)²/Σw² trials (Kish 1965).
pub fn share(surfaces: &[Weighed], which: impl Fn(&Weighed) -> f64) -> Option<Share> {
    let sum = |of: &dyn Fn(&Weighed) -> f64| surfaces.iter().map(of).sum::<f64>();
    let weight = sum(&|surface| surface.weight);
    if weight == 0.0 {
        return None;
    }
    let share = sum(&|surface| surface.weight * which(surface)) / weight;
    let trials = weight * weight / sum(&|surface| surface.weight * surface.weight);
    Some(Share {
        share,
        interval: wilson(share * trials, trials),
    })
}

/// Rows as a table for people: a share and its interval in a column each; none is a dash. A column of dashes is left out.
pub fn text(first_column: &str, things: &str, rows: &[Row]) -> String {
    let width = rows
        .iter()
        .map(|row| row.name.chars().count())
        .chain([first_column.chars().count()])
        .max()
        .unwrap_or(0);
    let shown: Vec<usize> = (0..COLUMNS.len())
        .filter(|&column| rows.iter().any(|row| row.shares()[column].is_some()))
        .collect();
    let line = |name: &str, count: &str, cells: &dyn Fn(usize) -> String| {
        let cells = shown.iter().map(|&column| format!("{:<22}", cells(column)));
        let line = format!("{name:<width$} {count:>10}  {}", cells.collect::<String>());
        line.trim_end().to_owned()
    };
    let mut lines = vec![line(first_column, things, &|column| {
        COLUMNS[column].to_owned()
    })];
    lines.extend(rows.iter().map(|row| {
        line(&row.name, &row.surfaces.to_string(), &|column| {
            row.shares()[column].map_or("–".to_owned(), cell)
        })
    }));
    lines.join("\n")
}

fn cell(share: Share) -> String {
    let Interval { low, high } = share.interval;
    format!("{:.4} ({low:.3}–{high:.3})", share.share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_count_by_their_weight_and_each_is_one_trial_of_the_interval() {
        let right = |surfaces: &[(u32, u32)]| {
            let surfaces: Vec<Weighed> = surfaces
                .iter()
                .filter_map(|&(all, right)| {
                    let counts = Counts {
                        all,
                        right,
                        ..Counts::default()
                    };
                    Weighed::by_time(&counts)
                })
                .collect();
            share(&surfaces, |surface| surface.right)
        };
        let alike = right(&[(100, 100), (100, 50), (100, 0)]).unwrap();
        assert_eq!(alike.share, 0.5);
        // Three trials, whatever the number of estimates in each.
        assert_eq!(alike.interval, wilson(1.5, 3.0));
        let uneven = right(&[(300, 300), (100, 0)]).unwrap();
        assert_eq!(uneven.share, 0.75);
        // (300 + 100)² / (300² + 100²)
        let trials = 1.6;
        assert_eq!(uneven.interval, wilson(0.75 * trials, trials));
        assert_eq!(right(&[(0, 0)]), None);
        assert_eq!(right(&[]), None);
    }

    #[test]
    fn a_row_tells_of_each_kind_and_a_table_has_a_line_for_each_row() {
        let counts = Counts {
            all: 10,
            right: 5,
            wrong: 1,
            silent: 3,
        };
        let said = Weighed::alike(&counts).unwrap();
        assert_eq!(said.weight, 1.0);
        let row = Row::of("sine", &[said], &[]);
        assert_eq!(row.surfaces, 1);
        let shares = [row.right, row.wrong, row.silent].map(|share| share.unwrap().share);
        assert_eq!(shares, [0.5, 0.1, 0.3]);
        assert_eq!((row.felt_right, row.felt_wrong), (None, None));
        let only_said = text("class", "surfaces", &[row.clone(), row.clone()]);
        let lines: Vec<&str> = only_said.lines().collect();
        assert_eq!(lines.len(), 3);
        assert!(lines[0].starts_with("class   surfaces  right") && lines[0].ends_with("silent"));
        assert!(lines[1].starts_with("sine           1  0.5000 (0."));
        let felt = Row::of("sine", &[said], &[said]);
        let both = text("class", "surfaces", &[row, felt]);
        let lines: Vec<&str> = both.lines().collect();
        assert!(
            lines[0].ends_with("felt right            felt wrong"),
            "{both}"
        );
        assert!(
            lines[1].ends_with('–') && !lines[2].ends_with('–'),
            "{both}"
        );
    }
}
