//! The picture: how the edges are spread about their median, and hand to output over the link's delay.

use super::{GOAL_MS, Row};
use crate::output::plot::palette::{BLUE, INK, VERMILION};
use crate::output::plot::{Axis, Key, Mark, Panel, Shape, Stroke, Symbol, in_threes};

const BARS: usize = 80;
/// Jitters that may be shown on either side, and the distance of ticks, in µs.
const SIDES_US: [(f64, f64); 6] = [
    (0.5, 0.25),
    (1.0, 0.5),
    (2.0, 1.0),
    (5.0, 2.5),
    (10.0, 5.0),
    (50.0, 25.0),
];
/// The least share of edges that is shown, in percent.
const LEAST_PERCENT: f64 = 0.01;

fn look(rate_hz: u32) -> Symbol {
    if rate_hz == 2_000 {
        Symbol::new(BLUE, Shape::Circle).faded(0.85)
    } else {
        Symbol::new(VERMILION, Shape::Square).faded(0.85)
    }
}

pub fn draw(rows: &[Row]) -> String {
    let note = "From the LDAC edges of the display’s ELF, fifty distinct channels, the hand at up to 70 mm/s.";
    let hollow = Symbol::new(INK, Shape::Circle).hollow(true);
    let bad = "hollow: 20 % loss and 50 ms jitter on the link";
    let legend = [
        (Key::Symbol(look(2_000)), "2 kHz"),
        (Key::Symbol(look(4_000)), "4 kHz"),
        (Key::Symbol(hollow), bad),
    ];
    let x = Axis::even(0.0, 500.0, 100.0, "the link’s one-way delay, ms");
    let longest = rows.iter().map(|row| row.reaction.max_ms);
    let highest = longest.fold(1.0, f64::max);
    let step = if highest > 2.0 { 1.0 } else { 0.2 };
    let y = Axis::even(0.0, (highest / step).ceil() * step, step, "");
    let over_delay = |row: &Row, ms: f64| {
        let symbol = look(row.rate_hz).hollow(row.link.loss > 0.0);
        Mark::symbol(symbol, (row.link.delay_ms, ms))
    };
    let p99 = rows.iter().map(|row| over_delay(row, row.reaction.p99_ms));
    let ends = rows
        .iter()
        .flat_map(|row| [row.reaction.max_ms, row.reaction.p50_ms].map(|ms| over_delay(row, ms)));
    let panels = [
        histogram(rows),
        Panel::new("hand to output, p99, ms", &x, &y)
            .with([Mark::Level(GOAL_MS, format!("goal at 2 kHz: {GOAL_MS} ms"))])
            .with(p99),
        Panel::new("hand to output, p50 and longest, ms", &x, &y).with(ends),
    ];
    in_threes(note, &legend, &panels)
}

/// Shares of the edges over their distance from the median one, the fair link's of each rate.
fn histogram(rows: &[Row]) -> Panel {
    let of_rate = |rate_hz| {
        let mut of_rate = rows.iter().filter(move |row| row.rate_hz == rate_hz);
        of_rate.find(|row| row.link.delay_ms == 0.0)
    };
    let shown: Vec<&Row> = [2_000, 4_000].into_iter().filter_map(of_rate).collect();
    let jitter = shown.iter().map(|row| row.edges.jitter.max_us);
    let farthest = jitter.fold(SIDES_US[0].0, f64::max);
    let wide_enough = SIDES_US.into_iter().find(|(side, _)| *side >= farthest);
    let (side, step) = wide_enough.unwrap_or((farthest.ceil(), farthest.ceil() / 2.0));
    let x = Axis::even(-side, side, step, "LDAC edge, µs from the median one");
    let y = Axis::decades(LEAST_PERCENT, 100.0, "");
    let lines = shown.into_iter().map(|row| {
        let edges = &row.edges;
        let mut bars = [0usize; BARS];
        for after_us in &edges.after_us {
            let place = (after_us - edges.after.p50_us + side) / (2.0 * side);
            bars[((place * BARS as f64) as usize).min(BARS - 1)] += 1;
        }
        let steps = bars.into_iter().enumerate().flat_map(|(bar, count)| {
            let share = 100.0 * count as f64 / edges.after_us.len() as f64;
            [bar, bar + 1].map(|end| {
                let from_median = 2.0 * side * end as f64 / BARS as f64 - side;
                (from_median, share.max(LEAST_PERCENT))
            })
        });
        Mark::Line(Stroke::new(look(row.rate_hz).colour, 1.3), steps.collect())
    });
    Panel::new("share of edges, %", &x, &y).with(lines)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim_core::judge::edges::{Edges, Spread};
    use hil_sim_core::judge::reaction::Reaction;
    use hil_sim_core::scene::Link;

    #[test]
    fn the_texts_stay_within_the_picture() {
        let row = |rate_hz, delay_ms, max_ms| Row {
            rate_hz,
            link: Link {
                delay_ms,
                ..Link::default()
            },
            edges: Edges {
                after_us: vec![40.0, 40.5, 41.0],
                after: Spread::of(vec![40.0, 40.5, 41.0]).unwrap(),
                jitter: Spread::of(vec![0.0, 0.5, 0.5]).unwrap(),
                skew_us: 0.0,
            },
            reaction: Reaction {
                p50_ms: 0.3,
                p99_ms: 0.6,
                max_ms,
            },
            estimates: (100, 80),
            deadline_misses: 0,
        };
        for max_ms in [0.9, 12.0] {
            let rows = [row(2_000, 0.0, max_ms), row(4_000, 500.0, max_ms)];
            crate::output::plot::tests::assert_fits("timing", &draw(&rows));
        }
    }
}
