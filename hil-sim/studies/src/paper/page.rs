//! All exhibits on one page that needs nothing else.

use std::fmt::Write;

use crate::output::escape::escape;
use crate::output::plot::palette::style_rules;
use crate::paper::Exhibit;
use crate::psychophysics::{DISCLAIMER, Study};
use hil_sim_core::run::recording::Recording;

/// The page. Its CSVs lie in `folder`, beside it.
pub(super) fn html(
    exhibits: &[Exhibit],
    study: &Study,
    recordings: &[Recording],
    folder: &str,
) -> String {
    let mut page = format!(
        "<!doctype html>\n<html lang=en>\n<meta charset=utf-8>\n\
         <meta name=viewport content=\"width=device-width, initial-scale=1\">\n\
         <title>Ridgelink: the paper, figure by figure</title>\n<style>\n{}{}{}</style>\n\
         <h1>The paper, figure by figure</h1>\n",
        style_rules(),
        include_str!("../output/report/style.css"),
        include_str!("page.css"),
    );
    let on = match study.engine {
        "elf" => "the flashed ELFs on emulated boards (engine elf)",
        _ => "the firmware's libraries on a computer (engine native), not on the ELFs",
    };
    let virtual_s: f64 = recordings.iter().map(|run| run.duration_s).sum();
    let _ = writeln!(
        page,
        "<p>Tables I to IV and Figs 4 to 8 of Okamoto, Konyo, Maeno and Tadokoro, <i>Roughness feeling \
         telepresence system on the basis of real-time estimation of surface wavelengths</i> (2009), beside \
         what Ridgelink makes of them: {} runs, {virtual_s:.0} s of the boards' time, on {on}; seed {}.</p>\n\
         <p>Specimens, gauges, hand and fingertip are simulated: ridges of trapezoid shape under a fingertip \
         that slides (and sticks only where it is called \"mild\"), whose gauges' gains, places and phases are \
         guesses. Nothing here was \
         measured on hardware or on people. Where the paper has its numbers only in a picture, none are read \
         off it.</p>\n<p class=warning>{}</p>",
        recordings.len(),
        study.seed,
        escape(DISCLAIMER),
    );
    page += "<nav><ul>";
    for exhibit in exhibits {
        let name = escape(exhibit.name());
        let _ = write!(page, "<li><a href=\"#{}\">{name}</a></li>", exhibit.id);
    }
    page += "</ul></nav>\n";
    for exhibit in exhibits {
        exhibit.write(&mut page, folder);
    }
    page
}
