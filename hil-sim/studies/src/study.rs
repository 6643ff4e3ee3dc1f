//! What a study leaves behind: a table to read, its rows as CSV, a picture, and whether its goals are met.

use std::borrow::Cow;
use std::fmt;

use crate::output::rounded;
use hil_sim_core::run::batch::on_all_cores;

/// A finished study.
pub trait Study {
    /// What its files are called.
    const NAME: &'static str;

    /// The table to read; none if the picture says it all.
    fn table(&self) -> Option<Table> {
        None
    }

    /// What there is to read: that table, as a rule.
    fn text(&self) -> Option<String> {
        self.table().map(|table| table.to_string())
    }

    /// Its CSVs: what follows the name in each file's, and the text.
    fn csvs(&self) -> Vec<(&'static str, String)>;

    /// The picture, as SVG text.
    fn picture(&self) -> String;

    /// Whether it meets its goals, if it has any.
    fn is_met(&self) -> bool {
        true
    }
}

/// Who is told how far a study is.
pub trait Progress: Sync {
    /// There are so many runs.
    fn begin(&self, runs: usize);

    /// One of them is done.
    fn step(&self);

    /// Does `work` on each input, on all cores, and tells of each.
    fn each<I: Sync, O: Send, E: Send>(
        &self,
        inputs: &[I],
        work: impl Fn(&I) -> Result<O, E> + Sync,
    ) -> Result<Vec<O>, E> {
        on_all_cores(inputs, |input| {
            let output = work(input);
            self.step();
            output
        })
    }
}

/// Nobody.
impl Progress for () {
    fn begin(&self, _runs: usize) {}
    fn step(&self) {}
}

/// What stands in a field of a CSV.
pub struct Cell(String);

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self(text)
    }
}

/// Every digit, and a decimal at least.
impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self(serde_json::Number::from_f64(value).map_or("NaN".to_owned(), |n| n.to_string()))
    }
}

/// An empty field if there is nothing.
impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self(String::new()), T::into)
    }
}

/// A number with so many decimals; an empty field if there is none.
pub fn fixed(value: impl Into<Option<f64>>, decimals: usize) -> Cell {
    value
        .into()
        .map(|value| format!("{value:.decimals$}"))
        .into()
}

/// A number, or a truth, in as few characters as it takes: whole ones without a decimal.
pub fn short(value: impl fmt::Display) -> Cell {
    Cell(value.to_string())
}

/// A number with so many decimals, or a dash: for tables. What rounds to 0 has no sign.
pub fn number(value: impl Into<Option<f64>>, decimals: usize) -> String {
    value
        .into()
        .map_or("–".to_owned(), |value| rounded(value, decimals))
}

/// A row of a CSV or of a table: what each column is called, and what stands in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// Name and text of each column. In a table, the name of a column of numbers ends with ":".
    pub cells: Vec<(Cow<'static, str>, String)>,
    remark: &'static str,
}

impl Record {
    /// These cells under these names.
    pub fn of(names: &[&'static str], cells: impl IntoIterator<Item = String>) -> Self {
        Self {
            cells: names.iter().map(|name| (*name).into()).zip(cells).collect(),
            remark: "",
        }
    }

    /// The same with a further column.
    pub fn with(mut self, name: impl Into<Cow<'static, str>>, cell: impl Into<Cell>) -> Self {
        self.cells.push((name.into(), cell.into().0));
        self
    }

    /// The same, with a remark beside it if it misses a goal.
    pub fn judged(self, is_met: bool) -> Self {
        let remark = if is_met { "" } else { "goal missed" };
        Self { remark, ..self }
    }
}

/// A CSV's text. Its header is from the first row.
pub fn csv(rows: impl IntoIterator<Item = Record>) -> String {
    let mut out = csv::Writer::from_writer(Vec::new());
    let mut is_begun = false;
    let written = rows.into_iter().try_for_each(|row| {
        if !std::mem::replace(&mut is_begun, true) {
            out.write_record(row.cells.iter().map(|cell| &*cell.0))?;
        }
        out.write_record(row.cells.iter().map(|cell| &cell.1))
    });
    written.expect("all rows have the same columns");
    let bytes = out.into_inner().expect("memory takes what is written");
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A table to read; `Display` gives it as Markdown.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// What it is of; empty if that is said elsewhere.
    pub caption: &'static str,
    /// Its rows.
    pub rows: Vec<Record>,
}

impl FromIterator<Record> for Table {
    fn from_iter<I: IntoIterator<Item = Record>>(rows: I) -> Self {
        Self {
            caption: "",
            rows: rows.into_iter().collect(),
        }
    }
}

impl Table {
    /// The same with a caption.
    pub fn called(self, caption: &'static str) -> Self {
        Self { caption, ..self }
    }

    /// The names of its columns, as the first row has them.
    pub fn heads(&self) -> impl Iterator<Item = &str> {
        let first = self.rows.iter().take(1);
        first.flat_map(|row| row.cells.iter().map(|cell| &*cell.0))
    }

    /// In columns for a terminal: the first to the left, the others to the right.
    pub fn text(&self) -> String {
        let heads: Vec<&str> = self.heads().collect();
        let rows = self.rows.iter();
        let rows = rows.map(|row| row.cells.iter().map(|cell| cell.1.as_str()).collect());
        let lines: Vec<Vec<&str>> = std::iter::once(heads).chain(rows).collect();
        let width = |column: usize| {
            let cells = lines.iter().filter_map(|line| line.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let line = |cells: &Vec<&str>| {
            let padded = cells.iter().enumerate().map(|(column, cell)| {
                let width = width(column);
                match column {
                    0 => format!("{cell:<width$}"),
                    _ => format!("{cell:>width$}"),
                }
            });
            padded.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
        };
        lines.iter().map(line).collect()
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self
            .heads()
            .map(|head| head.trim_end_matches(':'))
            .collect();
        let rule = self
            .heads()
            .map(|head| if head.ends_with(':') { "---:" } else { "---" });
        let rule: Vec<&str> = rule.collect();
        write!(f, "| {} |\n| {} |", names.join(" | "), rule.join(" | "))?;
        for Record { cells, remark } in &self.rows {
            let cells: Vec<&str> = cells.iter().map(|cell| cell.1.as_str()).collect();
            write!(f, "\n| {} |", cells.join(" | "))?;
            if !remark.is_empty() {
                write!(f, " {remark}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_rounds_to_zero_has_no_sign() {
        for (value, decimals, text) in [
            (-0.0004, 3, "0.000"),
            (-0.0006, 3, "-0.001"),
            (-0.4, 0, "0"),
            (0.0, 1, "0.0"),
            (12.3, 1, "12.3"),
        ] {
            assert_eq!(rounded(value, decimals), text);
            assert_eq!(number(value, decimals), text);
        }
        assert_eq!(number(None, 2), "–");
    }

    #[test]
    fn numbers_keep_their_decimals_and_nothing_is_an_empty_field() {
        let rows = [(50.0, Some(1.0)), (0.5, None)].map(|(speed_mm_s, error)| {
            Record::default()
                .with("speed_mm_s", short(speed_mm_s))
                .with("error_percent", fixed(error, 2))
        });
        assert_eq!(csv(rows), "speed_mm_s,error_percent\n50,1.00\n0.5,\n");
    }

    #[test]
    fn a_table_is_markdown_with_its_numbers_to_the_right() {
        let row = |hand: &str, late_ms: Option<f64>| {
            Record::default()
                .with("hand", hand)
                .with("late, ms:", number(late_ms, 1))
        };
        let table = Table::from_iter([row("whole", Some(1.25)).judged(false), row("none", None)]);
        assert_eq!(
            table.to_string(),
            "| hand | late, ms |\n| --- | ---: |\n| whole | 1.2 | goal missed\n| none | – |"
        );
    }
}
