//! λ: how long, how sure, by which count, over which seconds; and v of both sides: the hand that leads, and the arm that
//! follows.

use protocol::Estimate;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use ratatui::text::{Line, Span};

use super::plot::{Plot, Range, Series};
use super::text;
use super::text::cut_top;
use crate::monitor::dashboard::Dashboard;
use crate::monitor::theme::Theme;
use crate::monitor::view::View;

/// What is older than this, in ms, is no more than a memory.
const OLD_MS: u64 = 300;
/// Parts of the bar of confidence.
const BAR: usize = 14;
/// The trace shows λ within so much of it at least: noise is not to look like news.
const LEAST_PART: f32 = 0.1;

pub fn draw(frame: &mut Frame<'_>, area: Rect, shown: &Dashboard, theme: Theme) {
    let age_ms = shown.estimate_age_ms();
    let is_old = age_ms.is_none_or(|age_ms| age_ms > OLD_MS);
    let about = match age_ms {
        Some(age_ms) if is_old => format!("{} old", text::short(age_ms * 1_000)),
        Some(_) => format!("{} Hz", shown.sensor.rate.per_s()),
        None => "nothing heard".to_owned(),
    };
    let area = text::panel(frame, area, theme, text::title(theme, "surface", &about));
    let estimate = shown.estimate.map(|(_, estimate)| estimate);
    let sure = estimate.is_some_and(|estimate| estimate.valid) && !is_old;
    let style = if sure { theme.strong() } else { theme.quiet() };
    let number = estimate
        .and_then(|estimate| estimate.wavelength_mm)
        .map_or_else(|| "-.--".to_owned(), millimetres);
    for (row, mut line) in (0..).zip(text::big_lines(&number, style)) {
        let name = if row == 2 { " λ " } else { "   " };
        line.spans.insert(0, Span::styled(name, theme.quiet()));
        if row == 2 {
            line.spans.push(Span::styled("mm", theme.quiet()));
            if let Some(estimate) = &estimate {
                let amplitude = format!("  {:.0} LSB", estimate.amplitude_lsb);
                let style = faded(Style::new(), is_old, theme);
                line.spans.push(Span::styled(amplitude, style));
            }
        }
        text::put(frame, area, row, line);
    }
    let Some(estimate) = estimate else {
        return;
    };
    let lines = [
        confidence(&estimate, theme, is_old),
        judgement(&estimate, theme, is_old),
        count(&estimate, theme, is_old),
        gauges(&estimate, theme, is_old),
    ];
    for (row, line) in (text::BIG_ROWS as u16..).zip(lines) {
        text::put(frame, area, row, line);
    }
}

/// λ as it is written: to 10 µm, and to 1 µm below 1 mm.
pub fn millimetres(mm: f32) -> String {
    if mm < 0.9995 {
        format!("{mm:.3}")
    } else {
        format!("{mm:.2}")
    }
}

fn faded(style: Style, is_old: bool, theme: Theme) -> Style {
    if is_old { theme.quiet() } else { style }
}

/// Two values, each behind what it is.
fn two(
    one: (&'static str, String, Style),
    other: (&'static str, String, Style),
    theme: Theme,
) -> Line<'static> {
    let spans = [one, other].map(|(name, value, style)| {
        [
            Span::styled(name, theme.quiet()),
            Span::styled(value, style),
        ]
    });
    Line::from(spans.concat())
}

fn confidence(estimate: &Estimate, theme: Theme, is_old: bool) -> Line<'static> {
    let part = estimate.confidence.clamp(0.0, 1.0);
    let full = (part * BAR as f32).round() as usize;
    let style = faded(theme.sensor(), is_old, theme);
    Line::from(vec![
        Span::styled(" confidence ", theme.quiet()),
        Span::styled("━".repeat(full), style),
        Span::styled("─".repeat(BAR - full), theme.quiet()),
        Span::styled(format!(" {part:.2}"), faded(theme.strong(), is_old, theme)),
    ])
}

fn judgement(estimate: &Estimate, theme: Theme, is_old: bool) -> Line<'static> {
    let (word, style) = if estimate.valid {
        ("valid", theme.good())
    } else {
        ("unsure", theme.warning())
    };
    let bold = faded(style.add_modifier(Modifier::BOLD), is_old, theme);
    let contact = estimate.contact.name().to_owned();
    let plain = faded(Style::new(), is_old, theme);
    two(
        (" ", word.to_owned(), bold),
        ("   contact ", contact, plain),
        theme,
    )
}

fn count(estimate: &Estimate, theme: Theme, is_old: bool) -> Line<'static> {
    let counted = estimate.counted_mm.map(|mm| format!("{mm:.2} mm"));
    let counted = counted.unwrap_or_else(|| "  -  ".to_owned());
    let style = faded(Style::new(), is_old, theme);
    let range = estimate.range.name().to_owned();
    two(
        (" paper's count ", counted, style),
        ("   range ", range, style),
        theme,
    )
}

fn gauges(estimate: &Estimate, theme: Theme, is_old: bool) -> Line<'static> {
    let used: String = (0..protocol::GAUGES)
        .filter(|gauge| estimate.gauges_used & (1 << gauge) != 0)
        .map(|gauge| gauge.to_string())
        .collect();
    let used = if used.is_empty() {
        "none".to_owned()
    } else {
        used
    };
    let lag = estimate.lag_um.map(|lag_um| format!("{lag_um} µm"));
    let lag = lag.unwrap_or_else(|| "-".to_owned());
    let style = faded(Style::new(), is_old, theme);
    two(
        (" gauges used ", used, style),
        ("   lag ", lag, style),
        theme,
    )
}

/// Draws λ and the paper's count over the last seconds.
pub fn draw_trace(frame: &mut Frame<'_>, area: Rect, shown: &Dashboard, view: &View) {
    let theme = view.theme;
    let plot = Plot::new(cut_top(area, 1)[1], view.span_s());
    let traces = &shown.traces;
    let series = [
        Series::line(&traces.wavelength_mm, theme.sensor()),
        Series::dots(&traces.unsure_mm, theme.quiet()),
        Series::dots(&traces.counted_mm, theme.warning()),
    ];
    let title = Line::from(vec![
        Span::styled("λ", theme.strong()),
        Span::styled("  mm, ", theme.quiet()),
        Span::styled(text::span(plot.span_s()), theme.quiet()),
        Span::styled("   ━ ", theme.sensor()),
        Span::styled("valid  ┅ unsure", theme.quiet()),
        Span::styled("  ┅ ", theme.warning()),
        Span::styled("paper's", theme.quiet()),
    ]);
    text::panel(frame, area, theme, title);
    if let Some((low, high)) = plot.extent(shown.now_us, &series) {
        let range = Range::around(low, high, LEAST_PART * high);
        plot.draw_axis(frame, range, theme);
        plot.draw(frame, shown.now_us, range, &series, None);
    }
}

/// Velocities that are drawn as far apart as the area is high, in mm/s: a hand at rest has its noise.
const LEAST_MM_S: f32 = 20.0;

/// Draws both velocities over the last seconds.
pub fn draw_velocity(frame: &mut Frame<'_>, area: Rect, shown: &Dashboard, view: &View) {
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
