//! The five gauges: what they say, and how they are.

use protocol::{GAUGES, GaugeHealth};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::plot::{Plot, Range, Series, round_step};
use super::text::{self, cut_top};
use crate::monitor::dashboard::Dashboard;
use crate::monitor::view::View;

/// The gauges show a part of the time that the other traces show: their waves are many times as fast.
const PART: f32 = 0.03;
/// The least that is drawn as high as the area, in LSB.
const LEAST_LSB: f32 = 20.0;
/// Without a block for so long, in µs, nothing is streaming.
const SILENT_US: u64 = 500_000;

/// Draws the gauges side by side, all to one scale.
pub fn draw(frame: &mut Frame<'_>, area: Rect, shown: &Dashboard, view: &View) {
    let theme = view.theme;
    let columns: [Rect; GAUGES] = text::columns(cut_top(area, 1)[1]);
    let plots = columns.map(|column| Plot::bare(cut_top(column, 1)[1], view.span_s() * PART));
    let traces = shown.traces.gauges_lsb.each_ref();
    let series = traces.map(|trace| [Series::line(trace, theme.sensor())]);
    let is_fresh = |at_us: u64| shown.now_us.saturating_sub(at_us) < SILENT_US;
    let streams = shown.gauges_us.is_some_and(is_fresh);
    let extents: [_; GAUGES] =
        std::array::from_fn(|gauge| plots[gauge].extent(shown.now_us, &series[gauge]));
    let heights = extents.iter().flatten().map(|(low, high)| high - low);
    let widest = heights.fold(LEAST_LSB, f32::max);
    // A little more than the widest, in round numbers, so that it does not change all the time.
    let step = round_step(widest);
    let height = (widest / step).ceil() * step;
    let about = if streams {
        format!(
            "from lowest to highest in LSB; {height:.0} LSB high, {}",
            text::span(plots[0].span_s())
        )
    } else if shown.sensor.is_known() {
        "not streamed: g streams them".to_owned()
    } else {
        "not streamed".to_owned()
    };
    text::panel(frame, area, theme, text::title(theme, "gauges", &about));
    for gauge in 0..GAUGES {
        let name = name(shown, gauge, extents[gauge], columns[gauge].width, view);
        text::put(frame, columns[gauge], 0, name);
        if let (Some((low, high)), true) = (extents[gauge], streams) {
            let middle = (low + high) / 2.0;
            let range = Range {
                low: middle - height / 2.0,
                high: middle + height / 2.0,
                digits: 0,
            };
            plots[gauge].draw(frame, shown.now_us, range, &series[gauge], None);
        }
    }
}

/// Which gauge it is, how it is, and from its lowest to its highest, in a row of `width`.
fn name(
    shown: &Dashboard,
    gauge: usize,
    extent: Option<(f32, f32)>,
    width: u16,
    view: &View,
) -> Line<'static> {
    let theme = view.theme;
    // What does not fit is left out as a whole: a number that is cut is another number.
    let mut room = usize::from(width).saturating_sub(2);
    let mut fits = |words: &str| {
        let rest = room.checked_sub(words.len());
        room = rest.unwrap_or(room);
        rest.is_some()
    };
    let mut spans = vec![Span::styled(format!("{gauge} "), theme.strong())];
    if let Some((_, estimate)) = shown.estimate {
        let health = estimate.health[gauge];
        let is_good = health == GaugeHealth::Good;
        let style = if is_good { theme.good() } else { theme.bad() };
        fits(health.name());
        spans.push(Span::styled(health.name(), style));
        if estimate.gauges_used & (1 << gauge) == 0 && fits(" unused") {
            spans.push(Span::styled(" unused", theme.quiet()));
        }
    }
    if let Some((low, high)) = extent {
        let height = format!(" {:.0}", high - low);
        if fits(&height) {
            spans.push(Span::styled(height, theme.quiet()));
        }
    }
    Line::from(spans)
}
