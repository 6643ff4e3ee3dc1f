//! v of both sides: the hand that leads, and the arm that follows.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::plot::{Plot, Range, Series};
use super::text;
use super::text::cut_top;
use crate::monitor::dashboard::Dashboard;
use crate::monitor::view::View;

/// Velocities that are drawn as far apart as the area is high, in mm/s: a hand at rest has its noise.
const LEAST_MM_S: f32 = 20.0;
/// What is older than this, in ms, is shown no more.
const OLD_MS: u64 = 300;

/// Draws both velocities over the last seconds.
pub fn draw(frame: &mut Frame<'_>, area: Rect, shown: &Dashboard, view: &View) {
    let theme = view.theme;
    let plot = Plot::new(cut_top(area, 1)[1], view.span_s());
    let traces = &shown.traces;
    let now = |velocity_um_s: Option<i32>, age_ms: Option<u64>| {
        let fresh = velocity_um_s.filter(|_| age_ms.is_some_and(|age_ms| age_ms <= OLD_MS));
        let words = fresh.map(|um_s| format!("{:+6.1}", um_s as f32 / 1e3));
        words.unwrap_or_else(|| "     -".to_owned())
    };
    let hand = shown.motion.map(|(_, motion)| motion.velocity_um_s);
    let arm = shown.estimate.map(|(_, estimate)| estimate.velocity_um_s);
    let title = Line::from(vec![
        Span::styled("v", theme.strong()),
        Span::styled("  mm/s, ", theme.quiet()),
        Span::styled(text::span(plot.span_s()), theme.quiet()),
        Span::styled("   ━ ", theme.display()),
        Span::styled("hand ", theme.quiet()),
        Span::raw(now(hand, shown.motion_age_ms())),
        Span::styled("  ┅ ", theme.sensor()),
        Span::styled("arm ", theme.quiet()),
        Span::raw(now(arm, shown.estimate_age_ms())),
    ]);
    text::panel(frame, area, theme, title);
    let series = [
        Series::dots(&traces.arm_mm_s, theme.sensor()),
        Series::line(&traces.hand_mm_s, theme.display()),
    ];
    if let Some((low, high)) = plot.extent(shown.now_us, &series) {
        let range = Range::around(low, high, LEAST_MM_S);
        plot.draw_axis(frame, range, theme);
        let zero = Some((0.0, theme.quiet()));
        plot.draw(frame, shown.now_us, range, &series, zero);
    }
}
