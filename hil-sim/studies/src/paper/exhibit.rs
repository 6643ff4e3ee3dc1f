//! A figure or a table, ours beside the paper's.

use std::fmt::Write;

use crate::output::escape::escape;
use crate::output::plot::palette::Colour;
use crate::output::plot::{Axis, Mark, Panel, WIDTH, chart};
use crate::output::report::legend;
use crate::study::Table;

/// Width of a chart for a phone: text is of one size in it and in one for a page.
const NARROW: f64 = 525.0;

#[derive(Clone, Debug, Default)]
pub struct Exhibit {
    /// Its place on the page: "fig-5".
    pub id: &'static str,
    pub title: &'static str,
    /// What the paper says of it, and gives.
    pub paper: String,
    /// Two sentences: what is seen, and where ours differs.
    pub seen: String,
    /// What of that a run could also have contradicted.
    pub conclusions: Vec<Conclusion>,
    pub parts: Vec<Part>,
    /// Names and texts.
    pub csvs: Vec<(&'static str, String)>,
    /// CSVs of the experiments with people that belong to it.
    pub shared: &'static [&'static str],
}

/// A conclusion in a sentence, and whether these runs bear it out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Conclusion {
    pub claim: &'static str,
    pub holds: bool,
}

#[derive(Clone, Debug)]
pub enum Part {
    Chart {
        caption: String,
        legend: String,
        /// As wide as a page, and as a phone.
        broad: String,
        narrow: String,
    },
    /// The first cell of each row is its head.
    Table(Table),
}

impl Part {
    pub(super) fn chart(
        caption: impl Into<String>,
        entries: &[(Colour, &str)],
        (height, x, y): (f64, &Axis, &Axis),
        marks: impl IntoIterator<Item = Mark>,
    ) -> Self {
        let panel = Panel::new("", x, y).with(marks);
        Self::Chart {
            caption: caption.into(),
            legend: legend(entries),
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
                let _ = write!(page, "<h3>{caption}</h3>\n{legend}");
                for (class, svg) in [("broad", broad), ("narrow", narrow)] {
                    let named = format!("<svg role=\"img\" aria-label=\"{caption}\" ");
                    let svg = svg.replacen("<svg ", &named, 1);
                    let _ = writeln!(page, "<div class={class}>{svg}</div>");
                }
            }
            Part::Table(table) => {
                let head = |head| format!("<th scope=col>{}</th>", escape(head));
                let row = |cells: Vec<String>| {
                    let head = format!("<th scope=row>{}</th>", cells[0]);
                    let cells = cells[1..].iter().map(|cell| format!("<td>{cell}</td>"));
                    format!("<tr>{head}{}</tr>\n", cells.collect::<String>())
                };
                let rows = table.rows.iter();
                let rows =
                    rows.map(|of| row(of.cells.iter().map(|(_, text)| escape(text)).collect()));
                let _ = writeln!(
                    page,
                    "<div class=wide><table><caption>{}</caption><thead><tr>{}</tr></thead>\n\
                     <tbody>{}</tbody></table></div>",
                    escape(table.caption),
                    table.heads().map(head).collect::<String>(),
                    rows.collect::<String>(),
                );
            }
        }
    }
}

impl Exhibit {
    /// What it is called: "Fig. 5".
    pub(super) fn name(&self) -> &'static str {
        self.title.split(':').next().unwrap_or_default()
    }

    /// What these runs do not bear out, with the exhibit's name before it.
    pub fn contradicted(&self) -> impl Iterator<Item = String> {
        let lost = self.conclusions.iter().filter(|one| !one.holds);
        lost.map(|one| format!("{}: {}", self.name(), one.claim))
    }

    /// Writes it on a page whose CSVs lie in `folder`.
    pub(super) fn write(&self, page: &mut String, folder: &str) {
        let (title, paper, seen) = (escape(self.title), escape(&self.paper), escape(&self.seen));
        let _ = writeln!(
            page,
            "<section class=exhibit id={}>\n<h2>{title}</h2>\n<p class=soft>{paper}</p>\n<p>{seen}</p>",
            self.id
        );
        for line in self.contradicted() {
            let line = escape(&line);
            let _ = writeln!(
                page,
                "<p class=warning>Not borne out by these runs: {line}</p>"
            );
        }
        *page += "<div class=card>\n";
        for part in &self.parts {
            part.write(page);
        }
        *page += "</div>\n<p class=soft>Numbers:";
        let own = self.csvs.iter().map(|(name, _)| *name);
        for name in own.chain(self.shared.iter().copied()) {
            let _ = write!(page, " <a href=\"{0}/{name}\">{name}</a>", escape(folder));
        }
        *page += "</p>\n</section>\n";
    }
}

/// A number with so many decimals, or a dash.
pub(super) fn number(value: impl Into<Option<f64>>, decimals: usize) -> String {
    crate::study::number(value, decimals).replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_conclusion_that_the_runs_contradict_stands_on_the_page() {
        let exhibit = |holds| Exhibit {
            id: "fig-6",
            title: "Fig. 6: accuracy",
            conclusions: vec![Conclusion {
                claim: "the count is worse",
                holds,
            }],
            ..Exhibit::default()
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
