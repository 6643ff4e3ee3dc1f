//! A figure or a table, ours beside the paper's.

use std::fmt::Write;

use crate::output::escape::escape;
use crate::output::plot::axis::Axis;
use crate::output::plot::mark::Mark;
use crate::output::plot::page::{WIDTH, chart};
use crate::output::plot::palette::Colour;
use crate::output::plot::panel::Panel;
use crate::psychophysics::tables::Table;

/// Width of a chart for a phone: text is of one size in it and in one for a page.
const NARROW: f64 = 525.0;

/// A figure or a table.
#[derive(Clone, Debug)]
pub struct Exhibit {
    /// Its place on the page: "fig-5".
    pub id: &'static str,
    /// Its heading.
    pub title: String,
    /// What the paper says of it, and gives.
    pub paper: String,
    /// Two sentences: what is seen, and where ours differs.
    pub seen: String,
    /// What of that a run could also have contradicted.
    pub conclusions: Vec<Conclusion>,
    /// What is shown.
    pub parts: Vec<Part>,
    /// Its CSVs: names and texts.
    pub csvs: Vec<(String, String)>,
    /// CSVs of the experiments with people that belong to it.
    pub shared: &'static [&'static str],
}

/// A conclusion, and whether these runs bear it out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Conclusion {
    /// In a sentence.
    pub claim: &'static str,
    /// Whether it holds.
    pub holds: bool,
}

impl Exhibit {
    /// What these runs do not bear out, with the exhibit's name before it.
    pub fn contradicted(&self) -> impl Iterator<Item = String> {
        let name = self.title.split(':').next().unwrap_or_default();
        let lost = self
            .conclusions
            .iter()
            .filter(|conclusion| !conclusion.holds);
        lost.map(move |conclusion| format!("{name}: {}", conclusion.claim))
    }
}

/// Something shown.
#[derive(Clone, Debug)]
pub enum Part {
    /// A chart.
    Chart {
        /// What it is of.
        caption: String,
        /// What each colour means.
        legend: Vec<(Colour, String)>,
        /// As wide as a page.
        broad: String,
        /// As wide as a phone.
        narrow: String,
    },
    /// A table.
    Table {
        /// What it is of.
        caption: String,
        /// Its heads.
        heads: Vec<String>,
        /// Its rows, the first cell of each its head.
        rows: Vec<Vec<String>>,
    },
}

impl From<Table> for Part {
    fn from(table: Table) -> Self {
        Self::Table {
            caption: table.caption.to_owned(),
            heads: table.heads,
            rows: table.rows,
        }
    }
}

impl Part {
    /// Draws a chart.
    pub(super) fn chart(
        caption: impl Into<String>,
        legend: &[(Colour, &str)],
        (height, x, y): (f64, &Axis, &Axis),
        marks: impl IntoIterator<Item = Mark>,
    ) -> Self {
        let panel = Panel::new("", x, y).with(marks);
        Self::Chart {
            caption: caption.into(),
            legend: legend
                .iter()
                .map(|&(colour, text)| (colour, text.to_owned()))
                .collect(),
            broad: chart(WIDTH, height, &panel),
            narrow: chart(NARROW, height, &panel),
        }
    }

    fn write(&self, page: &mut String) {
        match self {
            Part::Chart {
                caption,
                legend,
                broad,
                narrow,
            } => {
                let caption = escape(caption);
                let _ = writeln!(page, "<h3>{caption}</h3>");
                if !legend.is_empty() {
                    *page += "<ul class=legend>";
                    for (colour, text) in legend {
                        let (name, text) = (colour.name, escape(text));
                        let _ = write!(
                            page,
                            "<li><i style=\"background:var(--{name})\"></i>{text}</li>"
                        );
                    }
                    *page += "</ul>\n";
                }
                for (class, svg) in [("broad", broad), ("narrow", narrow)] {
                    let named = format!("<svg role=\"img\" aria-label=\"{caption}\" ");
                    let svg = svg.replacen("<svg ", &named, 1);
                    let _ = writeln!(page, "<div class={class}>{svg}</div>");
                }
            }
            Part::Table {
                caption,
                heads,
                rows,
            } => {
                let _ = write!(
                    page,
                    "<div class=wide><table><caption>{}</caption><thead><tr>",
                    escape(caption)
                );
                for head in heads {
                    let _ = write!(page, "<th scope=col>{}</th>", escape(head));
                }
                *page += "</tr></thead>\n<tbody>";
                for row in rows {
                    *page += "<tr>";
                    for (at, cell) in row.iter().enumerate() {
                        let cell = escape(cell);
                        let _ = match at {
                            0 => write!(page, "<th scope=row>{cell}</th>"),
                            _ => write!(page, "<td>{cell}</td>"),
                        };
                    }
                    *page += "</tr>\n";
                }
                *page += "</tbody></table></div>\n";
            }
        }
    }
}

impl Exhibit {
    /// Writes it on a page whose CSVs lie in `folder`.
    pub(super) fn write(&self, page: &mut String, folder: &str) {
        let Self {
            id,
            title,
            paper,
            seen,
            ..
        } = self;
        let _ = writeln!(
            page,
            "<section class=exhibit id={id}>\n<h2>{}</h2>\n<p class=soft>{}</p>\n<p>{}</p>",
            escape(title),
            escape(paper),
            escape(seen),
        );
        for line in self.contradicted() {
            let _ = writeln!(
                page,
                "<p class=warning>Not borne out by these runs: {}</p>",
                escape(&line)
            );
        }
        *page += "<div class=card>\n";
        for part in &self.parts {
            part.write(page);
        }
        *page += "</div>\n<p class=soft>Numbers:";
        let own = self.csvs.iter().map(|(name, _)| name.as_str());
        for name in own.chain(self.shared.iter().copied()) {
            let _ = write!(page, " <a href=\"{0}/{name}\">{name}</a>", escape(folder));
        }
        *page += "</p>\n</section>\n";
    }
}

/// A number with so many decimals, or a dash.
pub(super) fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or("–".into(), |value| {
        format!("{value:.decimals$}").replace('-', "−")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_conclusion_that_the_runs_contradict_stands_on_the_page() {
        let exhibit = |holds| Exhibit {
            id: "fig-6",
            title: "Fig. 6: accuracy".into(),
            paper: String::new(),
            seen: String::new(),
            conclusions: vec![Conclusion {
                claim: "the count is worse",
                holds,
            }],
            parts: Vec::new(),
            csvs: Vec::new(),
            shared: &[],
        };
        let written = |holds| {
            let mut page = String::new();
            exhibit(holds).write(&mut page, "paper");
            page
        };
        assert!(!written(true).contains("borne out"));
        assert!(written(false).contains("Not borne out by these runs: Fig. 6: the count is worse"));
        assert_eq!(exhibit(false).contradicted().count(), 1);
    }
}
