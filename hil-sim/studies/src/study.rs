//! What a study leaves behind: a table to read, its rows as CSV, a picture, and whether its goals are met.

use std::fmt;

use serde::{Serialize, Serializer};

/// A finished study.
pub trait Study {
    /// What its files are called.
    const NAME: &'static str;

    /// The table to read; none if the picture says it all.
    fn table(&self) -> Option<Table> {
        None
    }

    /// Its CSVs: what follows the name in each file's, and the text.
    ///
    /// # Errors
    /// None in practice: they are written to memory.
    fn csvs(&self) -> Result<Vec<(&'static str, String)>, csv::Error>;

    /// The picture, as SVG text.
    fn picture(&self) -> String;

    /// Whether it meets its goals, if it has any.
    fn is_met(&self) -> bool {
        true
    }
}

/// A CSV's text from its rows: structures, whose fields name the columns.
///
/// # Errors
/// None in practice: it is written to memory.
pub fn csv_text<R: Serialize>(rows: impl IntoIterator<Item = R>) -> Result<String, csv::Error> {
    written(csv::Writer::from_writer(Vec::new()), rows)
}

/// The same from rows that are tuples, under a header.
///
/// # Errors
/// None in practice: it is written to memory.
pub fn csv_text_under<R: Serialize>(
    header: &[&str],
    rows: impl IntoIterator<Item = R>,
) -> Result<String, csv::Error> {
    let mut table = csv::WriterBuilder::new()
        .has_headers(false)
        .from_writer(Vec::new());
    table.write_record(header)?;
    written(table, rows)
}

fn written<R: Serialize>(
    mut table: csv::Writer<Vec<u8>>,
    rows: impl IntoIterator<Item = R>,
) -> Result<String, csv::Error> {
    for row in rows {
        table.serialize(row)?;
    }
    let bytes = table
        .into_inner()
        .map_err(|error| csv::Error::from(error.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// A CSV's number with so many decimals; an empty field if there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fixed<const DECIMALS: usize>(Option<f64>);

impl<const DECIMALS: usize> From<f64> for Fixed<DECIMALS> {
    fn from(value: f64) -> Self {
        Self(Some(value))
    }
}

impl<const DECIMALS: usize> From<Option<f64>> for Fixed<DECIMALS> {
    fn from(value: Option<f64>) -> Self {
        Self(value)
    }
}

impl<const DECIMALS: usize> Serialize for Fixed<DECIMALS> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Some(value) => serializer.collect_str(&format_args!("{value:.DECIMALS$}")),
            None => serializer.serialize_none(),
        }
    }
}

/// A CSV's number in as few digits as it takes: whole ones without a decimal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Short(pub f64);

impl Serialize for Short {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&self.0)
    }
}

/// A table to read; `Display` gives it as Markdown.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    heads: Vec<&'static str>,
    rows: Vec<(Vec<String>, &'static str)>,
}

impl Table {
    /// A table under these heads. A column of numbers has a head that ends with ":".
    pub fn new(heads: &[&'static str]) -> Self {
        Self {
            heads: heads.to_vec(),
            rows: Vec::new(),
        }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.row_with(cells, "");
    }

    /// Adds a row with a remark beside the table.
    pub fn row_with(&mut self, cells: impl IntoIterator<Item = String>, remark: &'static str) {
        self.rows.push((cells.into_iter().collect(), remark));
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |head: &&'static str| head.trim_end_matches(':').to_owned();
        let dashes = |head: &&str| if head.ends_with(':') { "---:" } else { "---" };
        let heads: Vec<String> = self.heads.iter().map(name).collect();
        let rule: Vec<&str> = self.heads.iter().map(dashes).collect();
        write!(f, "| {} |\n| {} |", heads.join(" | "), rule.join(" | "))?;
        for (cells, remark) in &self.rows {
            write!(f, "\n| {} |", cells.join(" | "))?;
            if !remark.is_empty() {
                write!(f, " {remark}")?;
            }
        }
        Ok(())
    }
}

/// A number with so many decimals, or a dash.
pub fn number(value: impl Into<Option<f64>>, decimals: usize) -> String {
    let text = |value| format!("{value:.decimals$}");
    value.into().map_or("–".to_owned(), text)
}

/// What stands beside a row of a table.
pub const fn remark(is_met: bool) -> &'static str {
    if is_met { "" } else { "goal missed" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_decimals_and_nothing_is_an_empty_field() {
        #[derive(Serialize)]
        struct Row {
            speed_mm_s: Short,
            error_percent: Fixed<2>,
        }
        let rows = [(50.0, Some(1.0)), (0.5, None)].map(|(speed_mm_s, error)| Row {
            speed_mm_s: Short(speed_mm_s),
            error_percent: error.into(),
        });
        assert_eq!(
            csv_text(rows).unwrap(),
            "speed_mm_s,error_percent\n50,1.00\n0.5,\n"
        );
    }

    #[test]
    fn a_table_is_markdown_with_its_numbers_to_the_right() {
        let mut table = Table::new(&["hand", "late, ms:"]);
        table.row_with(["whole".to_owned(), number(1.25, 1)], remark(false));
        table.row(["none".to_owned(), number(None::<f64>, 1)]);
        assert_eq!(
            table.to_string(),
            "| hand | late, ms |\n| --- | ---: |\n| whole | 1.2 | goal missed\n| none | – |"
        );
    }
}
