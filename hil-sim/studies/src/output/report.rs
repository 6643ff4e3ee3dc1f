//! A run for a person to look at: one HTML file that needs nothing else.

pub(crate) mod crossings;
mod plots;
mod senses;
mod tables;
mod thin;

use std::fmt::Write;

use crate::output::escape::escape;
use crate::output::json::ContactResult;
use crate::output::plot::palette::{Colour, style_rules};
use crate::output::plot::{Axis, Mark, Panel, WIDTH, chart};
use hil_sim_core::judge::Verdict;
use hil_sim_core::judge::fault::Finding;
use hil_sim_core::judge::outcome::Outcome;
use hil_sim_core::judge::truth::Truth;
use hil_sim_core::run::recording::Recording;

/// A chart with what is to be said beside it.
struct Figure {
    title: String,
    /// What each colour means.
    legend: Vec<(Colour, &'static str)>,
    svg: String,
    /// What else the reader must know.
    note: String,
}

fn draw(height: f64, x: &Axis, y: &Axis, marks: Vec<Mark>) -> String {
    chart(WIDTH, height, &Panel::new("", x, y).with(marks))
}

/// One scene's part of the report.
#[derive(Clone)]
pub struct Chapter<'a> {
    /// What the scene knows.
    pub truth: Truth<'a>,
    /// What the run left behind.
    pub recording: &'a Recording,
    /// The recording, judged.
    pub verdict: &'a Verdict,
    /// A line for each expectation of the scene that was not met.
    pub unmet: &'a [String],
    /// What became of the scene's faults, in their order.
    pub findings: &'a [Finding],
    /// The contact model and why it was taken; none with recorded gauges.
    pub contact: Option<String>,
}

impl<'a> Chapter<'a> {
    /// The part of a judged run.
    pub fn of(outcome: &'a Outcome) -> Self {
        Self {
            truth: outcome.truth(),
            recording: &outcome.recording,
            verdict: &outcome.verdict,
            unmet: &outcome.unmet,
            findings: &outcome.findings,
            contact: ContactResult::of(&outcome.scene).map(|contact| contact.sentence()),
        }
    }
}

/// The report on these scenes, as one HTML page with its style and its plots within.
pub fn html(chapters: &[Chapter]) -> String {
    let mut page = format!(
        "<!doctype html>\n<html lang=en>\n<meta charset=utf-8>\n\
         <meta name=viewport content=\"width=device-width, initial-scale=1\">\n\
         <title>Ridgelink: simulated runs</title>\n<style>\n{}{}</style>\n\
         <h1>Ridgelink: simulated runs</h1>\n{}",
        style_rules(),
        include_str!("report/style.css"),
        tables::index(chapters),
    );
    for (at, chapter) in chapters.iter().enumerate() {
        write_chapter(&mut page, at, chapter);
    }
    page
}

fn write_chapter(page: &mut String, at: usize, chapter: &Chapter) {
    let Chapter {
        truth, recording, ..
    } = chapter;
    // Writing to a String cannot fail.
    let _ = writeln!(
        page,
        "<section class=scene id=scene-{at}>\n<h2>{}</h2>\n\
         <p class=soft>engine {}, method {}, {} s, hash {:016x}</p>",
        escape(truth.name),
        recording.engine.name(),
        escape(truth.method),
        recording.duration_s,
        recording.hash,
    );
    if let Some(contact) = &chapter.contact {
        let _ = writeln!(page, "<p class=soft>{}</p>", escape(contact));
    }
    for line in chapter.unmet {
        let _ = writeln!(page, "<p class=unmet>Not as expected: {}</p>", escape(line));
    }
    *page += &tables::summary(chapter);
    for figure in plots::figures(chapter) {
        write_figure(page, &figure);
    }
    *page += &tables::faults(chapter.findings);
    *page += &tables::counters(chapter);
    *page += &tables::log(chapter);
    *page += "</section>\n";
}

/// What each colour means, as HTML; nothing if there is none.
pub(crate) fn legend(entries: &[(Colour, &str)]) -> String {
    if entries.is_empty() {
        return String::new();
    }
    let item = |(colour, text): &(Colour, &str)| {
        let (name, text) = (colour.name, escape(text));
        format!("<li><i style=\"background:var(--{name})\"></i>{text}</li>")
    };
    let items: String = entries.iter().map(item).collect();
    format!("<ul class=legend>{items}</ul>\n")
}

fn write_figure(page: &mut String, figure: &Figure) {
    let (title, note) = (escape(&figure.title), escape(&figure.note));
    let legend = legend(&figure.legend);
    let named = format!("<svg role=img aria-label=\"{title}\" ");
    let svg = figure.svg.replacen("<svg ", &named, 1);
    let _ = writeln!(
        page,
        "<figure><figcaption>{title}</figcaption>\n{legend}<div class=wide>{svg}</div>\n<p>{note}</p></figure>"
    );
}

#[cfg(test)]
mod tests {
    use protocol::Mode;

    use super::*;
    use hil_sim_core::judge::judge;
    use hil_sim_core::judge::synthetic::Run;

    fn page(run: &Run, name: &str, mode: Mode, log: &[&str]) -> String {
        let mut truth = Truth::new(name, "counting", &*run.surface_mm);
        truth.display.mode = mode;
        let mut recording = run.record();
        recording.log = log
            .iter()
            .map(|&line| (1, "sensor", line.to_owned()))
            .collect();
        let verdict = judge(&truth, &recording);
        let unmet = ["rms_percent 3 > 1".to_owned()];
        html(&[Chapter {
            truth,
            recording: &recording,
            verdict: &verdict,
            unmet: &unmet,
            findings: &[],
            contact: None,
        }])
    }

    #[test]
    fn a_scene_has_five_plots_and_its_numbers() {
        let page = page(&Run::steady(50.0, 2.0), "steady", Mode::Uniform, &[]);
        assert_eq!(page.matches("<svg ").count(), 5);
        assert_eq!(page.matches("</svg>").count(), 5);
        assert!(page.contains("href=\"#scene-0\"") && page.contains("id=scene-0"));
        assert!(page.contains("rms_percent 3 &gt; 1"));
        assert!(!page.contains("NaN"));
        for svg in page.split("<svg ").skip(1) {
            let (svg, _) = svg.split_once("</svg>").unwrap();
            let svg = svg.replace("role=img", "");
            crate::output::plot::tests::assert_fits("report", &format!("<svg {svg}</svg>"));
        }
    }

    #[test]
    fn the_page_asks_the_network_for_nothing() {
        let page = page(&Run::steady(50.0, 2.0), "steady", Mode::Travelling, &[]);
        let svg_namespace = "xmlns=\"http://www.w3.org/2000/svg\"";
        let page = page.replace(svg_namespace, "");
        for needle in [
            "http:", "https:", "url(", "@import", "<script", "<link", "<img",
        ] {
            assert!(!page.contains(needle), "{needle}");
        }
    }

    #[test]
    fn names_and_log_lines_cannot_break_the_page() {
        let page = page(
            &Run::steady(50.0, 2.0),
            "<b>&\"",
            Mode::Uniform,
            &["</pre><script>"],
        );
        assert!(page.contains("&lt;b&gt;&amp;&quot;"));
        assert!(page.contains("&lt;/pre&gt;&lt;script&gt;"));
        assert!(!page.contains("<script>"));
    }

    #[test]
    fn a_minutes_scene_stays_below_a_megabyte() {
        let run = Run {
            duration_s: 60.0,
            ..Run::swinging(70.0, 0.83, 2.0)
        };
        let log = ["a line of the log that is about as long as one is"; 5_000];
        let page = page(&run, "long", Mode::Travelling, &log);
        assert!(page.len() < 1_000_000, "{}", page.len());
        assert!(page.contains("200 of 5000 lines"));
    }

    #[test]
    fn an_empty_recording_is_reported_without_a_panic() {
        let run = Run {
            duration_s: 0.0,
            ..Run::steady(50.0, 2.0)
        };
        assert!(!page(&run, "nothing", Mode::Uniform, &[]).contains("NaN"));
    }
}
