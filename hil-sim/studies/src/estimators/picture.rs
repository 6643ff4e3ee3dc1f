//! The picture of a contest: a panel for each family, error over instructions, both axes logarithmic.

use super::bank;
use super::family::Family;
use super::result::{BenchmarkResult, Entry, WINDOWS, Window};
use crate::output::plot::palette::{
    BLACK, BLUE, Colour, GREEN, GREY, INK, OCHRE, PURPLE, SOFT, VERMILION,
};
use crate::output::plot::{
    Anchor, Axis, Font, Key, Mark, Panel, Point, Shape, Stroke, Symbol, in_threes,
};
use crate::study::Study;

/// What methods look like: no two share shape and colour.
const LOOKS: [(&str, Symbol); 13] = [
    ("spectrum", Symbol::new(BLUE, Shape::Circle)),
    ("crossings", Symbol::new(VERMILION, Shape::Square)),
    ("counting", Symbol::new(BLACK, Shape::Up)),
    (bank::METHOD, Symbol::new(GREY, Shape::Circle)),
    ("adapted count", Symbol::new(BLACK, Shape::Down)),
    ("Goertzel", Symbol::new(GREEN, Shape::Diamond)),
    ("FFT", Symbol::new(GREEN, Shape::Square)),
    ("harmonic NLS", Symbol::new(GREEN, Shape::Up)),
    ("AR(2)", Symbol::new(PURPLE, Shape::Up)),
    ("PLL", Symbol::new(PURPLE, Shape::Down)),
    ("Pei–Tseng notch", Symbol::new(PURPLE, Shape::Diamond)),
    ("YIN", Symbol::new(OCHRE, Shape::Circle)),
    ("McLeod", Symbol::new(OCHRE, Shape::Diamond)),
];
/// The most that the default estimator may cost, in instructions a ms: 5 % of 168 MHz, one each cycle.
const BUDGET: f64 = 8_400.0;
const BUDGET_LINE: Stroke = Stroke::new(SOFT, 1.2).dashed("1 3");
const BOUND: Stroke = Stroke::new(INK, 1.2).dashed("6 4");
/// Words beside marks.
const ASIDE: Font = Font::new(10.0);

fn draw(result: &BenchmarkResult) -> String {
    let note = "Down and to the left is better. Cost: ADC scans to λ, counted in the ELF on an emulated Cortex-M4F. \
         Ring: default; hollow: cost estimated; faint: valid share below ½. Bound: Cramér–Rao’s over 8 λ, 80 ms \
         and 160 ms.";
    let methods = LOOKS.map(|(name, symbol)| (Key::Symbol(symbol.hollow(estimated(name))), name));
    let lines = [
        (knob_line("waves", BLUE), "spectrum: fits of 2–8 λ"),
        (knob_line("gauges", BLUE), "1, 3, 5 gauges"),
        (BOUND, "bound"),
        (BUDGET_LINE, "5 % of the M4F"),
    ];
    let lines = lines.map(|(stroke, words)| (Key::Line(stroke), words));
    let legend = [&methods[..], &lines].concat();
    let families = result.families.iter().enumerate();
    let mut panels: Vec<Panel> = families
        .map(|(index, family)| match family.folder {
            BOUNDARY => settling(result, index, family),
            _ => errors(result, index, family),
        })
        .collect();
    panels.push(against_settling(result));
    in_threes(note, &legend, &panels)
}

/// The family whose settling time counts.
const BOUNDARY: &str = "boundary";

fn cost_axis() -> Axis {
    Axis::decades(700.0, 60_000.0, "instructions a ms")
}

fn error_axis() -> Axis {
    Axis::decades(0.01, 300.0, "")
}

fn budget() -> Mark {
    Mark::Upright(BUDGET_LINE, BUDGET, String::new())
}

fn settling(result: &BenchmarkResult, index: usize, family: &Family) -> Panel {
    let title = format!("{}: settled within 10 %, ms", family.title);
    let goals = family
        .scenes
        .iter()
        .filter_map(|scene| scene.expect.settling_ms);
    let mut goals: Vec<f64> = goals.collect();
    goals.sort_by(f64::total_cmp);
    goals.dedup();
    let goals = goals
        .iter()
        .map(|ms| Mark::Level(*ms, format!("goal {ms} ms")));
    let settling_ms = Axis::even(0.0, 400.0, 100.0, "");
    Panel::new(title, &cost_axis(), &settling_ms)
        .with([budget()])
        .with(goals)
        .with(marks(result, index, &settling_ms, |entry| {
            Some((entry.cost?.mean, entry.scores[index].settling_ms?))
        }))
}

fn errors(result: &BenchmarkResult, index: usize, family: &Family) -> Panel {
    let cost = cost_axis();
    let bounds = WINDOWS.into_iter().filter_map(|window| {
        let percent = window.bound_percent(family)?;
        let words = match window {
            Window::Waves(waves) => format!("bound, {waves} λ"),
            Window::Ms(ms) => format!("bound, {ms} ms"),
        };
        let ends = [(cost.low, percent), (cost.high, percent)];
        let font = ASIDE.at(Anchor::End);
        Some([
            Mark::Line(BOUND, ends.to_vec()),
            Mark::Words(font, ends[1], (-2.0, -3.0), words),
        ])
    });
    let goal = family
        .goal_percent()
        .map(|percent| Mark::Level(percent, format!("goal {percent} %")));
    let title = format!("{}: RMS error, %", family.title);
    Panel::new(title, &cost, &error_axis())
        .with([budget()])
        .with(bounds.flatten())
        .with(goal)
        .with(marks(result, index, &error_axis(), |entry| {
            Some((entry.cost?.mean, entry.scores[index].rms_percent?))
        }))
}

/// The first family's error over the time to settle, the fits' lengths beside their marks.
fn against_settling(result: &BenchmarkResult) -> Panel {
    let time = Axis::even(0.0, 400.0, 100.0, "ms to settle after the boundary");
    let panel = Panel::new("Table I, 20 dB: RMS error, %", &time, &error_axis());
    let mut families = result.families.iter();
    let Some(boundary) = families.position(|family| family.folder == BOUNDARY) else {
        return panel;
    };
    let place = |entry: &Entry| {
        let settling_ms = entry.scores[boundary].settling_ms?;
        // What takes longer than the panel shows is left out.
        (settling_ms <= time.high).then_some((settling_ms, entry.scores[0].rms_percent?))
    };
    let fits = result.entries.iter().filter(|entry| entry.knob == "waves");
    let lengths = fits.filter_map(|entry| {
        let (font, words) = (ASIDE.at(Anchor::Middle), format!("{} λ", entry.value));
        Some(Mark::Words(font, place(entry)?, (0.0, 19.0), words))
    });
    panel
        .with(marks(result, 0, &error_axis(), place))
        .with(lengths)
}

/// Lines along the knobs, then every mark; `family` is whose valid share makes one faint.
fn marks(
    result: &BenchmarkResult,
    family: usize,
    y: &Axis,
    place: impl Fn(&Entry) -> Option<Point>,
) -> Vec<Mark> {
    // A time beyond an even axis is left out; an error beyond its edge stands at it.
    let at = |entry: &Entry| place(entry).filter(|point| y.logarithmic || point.1 <= y.high);
    let mut marks = Vec::new();
    for [from, to] in result.entries.array_windows() {
        let is_sweep = (from.method, from.knob) == (to.method, to.knob);
        if let (true, Some(start), Some(end), Some(look)) =
            (is_sweep, at(from), at(to), look(from.method))
        {
            let stroke = knob_line(from.knob, look.colour);
            marks.push(Mark::Line(stroke, vec![start, end]));
        }
    }
    for entry in &result.entries {
        let (Some(point), Some(look)) = (at(entry), look(entry.method)) else {
            continue;
        };
        if entry.is_default() {
            marks.push(Mark::Ring(Stroke::new(look.colour, 1.5), point));
        }
        let share = entry.scores[family].valid_share;
        let faded = share.filter(|share| *share < 0.5).map_or(1.0, |_| 0.3);
        let hollow = entry.cost.is_some_and(|cost| cost.worst.is_none());
        marks.push(Mark::symbol(look.hollow(hollow).faded(faded), point));
        if entry.method == "counting" && entry.value == 80 {
            // Below if there is no room above.
            let aside = if y.place(point.1) > 0.93 { 14.0 } else { -5.0 };
            let words = "the paper’s count".to_owned();
            marks.push(Mark::Words(ASIDE.italic(), point, (6.0, aside), words));
        }
    }
    marks
}

fn look(method: &str) -> Option<Symbol> {
    let found = LOOKS.iter().find(|look| look.0 == method);
    found.map(|look| look.1)
}

fn estimated(method: &str) -> bool {
    matches!(method, "YIN" | "McLeod")
}

fn knob_line(knob: &str, colour: Colour) -> Stroke {
    Stroke::new(colour, 1.3).dashed(match knob {
        "candidates" => "1.5 2.5",
        "gauges" => "6 3",
        _ => "",
    })
}

impl Study for BenchmarkResult {
    const NAME: &'static str = "estimators";

    fn csvs(&self) -> Vec<(&'static str, String)> {
        vec![("", self.csv())]
    }

    fn picture(&self) -> String {
        draw(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimators::benchmark::contestants;
    use crate::estimators::costs::Cost;
    use crate::estimators::score::Score;

    #[test]
    fn every_method_of_the_contest_has_a_look() {
        for contestant in contestants() {
            assert!(look(contestant.method).is_some(), "{}", contestant.method);
        }
    }

    #[test]
    fn the_texts_stay_within_the_picture() {
        let scenes = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/estimation");
        let families = crate::estimators::family::load(scenes.as_ref()).unwrap();
        let score = Score {
            rms_percent: Some(0.5),
            settling_ms: Some(120.0),
            ..Score::default()
        };
        let entries = contestants().into_iter().map(|contestant| Entry {
            method: contestant.method,
            knob: contestant.knob,
            value: contestant.value,
            setting: contestant.setting,
            cost: Some(Cost {
                mean: 5_000.0,
                worst: None,
            }),
            scores: vec![score.clone(); families.len()],
        });
        let entries = entries.collect();
        crate::output::plot::tests::assert_fits(
            "estimators",
            &draw(&BenchmarkResult { families, entries }),
        );
    }
}
