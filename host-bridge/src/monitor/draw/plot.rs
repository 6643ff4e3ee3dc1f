//! Traces in Braille dots: each column of dots spans what its time held, so that nothing is missed.

use ratatui::Frame;
use ratatui::layout::{Alignment, Rect};
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::canvas::{Canvas, Context, Painter, Shape};

use super::text;
use super::text::cut_left;
use crate::monitor::theme::Theme;
use crate::monitor::trace::{Extent, Trace, column_us};

/// Dots of a character across, and down.
const DOTS: (u16, u16) = (2, 4);
/// Width of the numbers at the left.
const AXIS_WIDTH: u16 = 7;

/// How one of the traces is drawn.
pub struct Series<'a> {
    trace: &'a Trace,
    style: Style,
    is_dotted: bool,
}

impl<'a> Series<'a> {
    pub const fn line(trace: &'a Trace, style: Style) -> Self {
        Self {
            trace,
            style,
            is_dotted: false,
        }
    }

    /// Points that nothing joins, to tell them from a line without colours.
    pub const fn dots(trace: &'a Trace, style: Style) -> Self {
        Self {
            trace,
            style,
            is_dotted: true,
        }
    }
}

/// What the axes show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    pub low: f32,
    pub high: f32,
    /// Digits behind the point that tell the two apart.
    pub digits: usize,
}

impl Range {
    /// Round numbers around what there is, `least` apart at least.
    pub fn around(low: f32, high: f32, least: f32) -> Self {
        let middle = (low + high) / 2.0;
        let half = (high - low).max(least) / 2.0;
        // Four steps or a few more leave little of the height empty. What is within a hundredth of a step
        // of a round number is that number.
        let step = round_step(half / 2.0);
        let low = ((middle - half) / step + 0.01).floor();
        let mut high = ((middle + half) / step - 0.01).ceil();
        // The number in the middle is to be round as well.
        high += (high - low) % 2.0;
        Self {
            low: low * step,
            high: high * step,
            digits: digits(step),
        }
    }
}

/// 1, 2 or 5 times a power of ten: the largest that is no more than `most`.
pub fn round_step(most: f32) -> f32 {
    if !(most.is_finite() && most > 0.0) {
        return 1.0;
    }
    let decade = 10_f32.powi(most.log10().floor() as i32);
    let times = [5.0, 2.0].into_iter().find(|times| decade * times <= most);
    decade * times.unwrap_or(1.0)
}

fn digits(step: f32) -> usize {
    (-step.log10().floor()).clamp(0.0, 4.0) as usize
}

/// Where traces go, with numbers at the left.
pub struct Plot {
    area: Rect,
    /// Time of a column of dots, in µs.
    column_us: u64,
}

impl Plot {
    /// A plot of `span_s` seconds or a little more in an area, of which a part goes to the numbers.
    pub fn new(area: Rect, span_s: f32) -> Self {
        let [_, area] = cut_left(area, AXIS_WIDTH.min(area.width / 3));
        Self::bare(area, span_s)
    }

    pub fn bare(area: Rect, span_s: f32) -> Self {
        Self {
            area,
            column_us: column_us(span_s, dots_across(area)),
        }
    }

    /// The time that it shows, in s.
    pub fn span_s(&self) -> f32 {
        self.column_us as f32 * dots_across(self.area) as f32 / 1e6
    }

    /// What the traces were within it, up to `now_us`.
    pub fn extent(&self, now_us: u64, series: &[Series<'_>]) -> Option<(f32, f32)> {
        let span_us = self.column_us * dots_across(self.area) as u64;
        let extent = |series: &Series<'_>| {
            let extent = series
                .trace
                .extent(now_us.saturating_sub(span_us), now_us + 1)?;
            Some((extent.low, extent.high))
        };
        let extents = series.iter().filter_map(extent);
        extents.reduce(|(low, high), (lower, higher)| (low.min(lower), high.max(higher)))
    }

    pub fn draw_axis(&self, frame: &mut Frame<'_>, range: Range, theme: Theme) {
        let Rect { x, .. } = self.area;
        let width = AXIS_WIDTH.min(x);
        let area = Rect {
            x: x - width,
            width: width.saturating_sub(1),
            ..self.area
        };
        let number = |value: f32| {
            // Without the sign of a zero.
            let value = if value == 0.0 { 0.0 } else { value };
            Line::styled(format!("{value:.*}", range.digits), theme.quiet())
                .alignment(Alignment::Right)
        };
        text::put(frame, area, 0, number(range.high));
        if self.area.height >= 2 {
            text::put(frame, area, self.area.height - 1, number(range.low));
        }
        if self.area.height >= 5 {
            let middle = (range.low + range.high) / 2.0;
            text::put(frame, area, self.area.height / 2, number(middle));
        }
    }

    /// Draws the traces up to `now_us`, the first one on top, over a faint line at `zero` if it is within.
    pub fn draw(
        &self,
        frame: &mut Frame<'_>,
        now_us: u64,
        range: Range,
        series: &[Series<'_>],
        zero: Option<(f32, Style)>,
    ) {
        let paint = |context: &mut Context<'_>| {
            let (width, height) = (
                dots_across(self.area),
                usize::from(self.area.height * DOTS.1),
            );
            let is_within = |(zero, _): &(f32, Style)| (range.low..=range.high).contains(zero);
            if let Some((zero, style)) = zero.filter(is_within) {
                context.draw(&Level {
                    row: row(zero, range, height),
                    width,
                    colour: colour(style),
                });
            }
            for series in series.iter().rev() {
                context.draw(&Stroke {
                    columns: series
                        .trace
                        .columns(now_us, self.column_us, width)
                        .collect(),
                    range,
                    height,
                    colour: colour(series.style),
                    // Which columns are left out moves on with them.
                    skips: series
                        .is_dotted
                        .then_some((now_us / self.column_us % 2) as usize),
                });
            }
        };
        let canvas = Canvas::default()
            .marker(Marker::Braille)
            .x_bounds([0.0, 1.0])
            .y_bounds([0.0, 1.0])
            .paint(paint);
        frame.render_widget(canvas, self.area);
    }
}

const fn dots_across(area: Rect) -> usize {
    (area.width * DOTS.0) as usize
}

fn colour(style: Style) -> Color {
    style.fg.unwrap_or(Color::Reset)
}

/// The row of dots of a value, from the top.
fn row(value: f32, range: Range, height: usize) -> usize {
    let part = ((range.high - value) / (range.high - range.low)).clamp(0.0, 1.0);
    (part * height.saturating_sub(1) as f32).round() as usize
}

struct Level {
    row: usize,
    width: usize,
    colour: Color,
}

impl Shape for Level {
    fn draw(&self, painter: &mut Painter<'_, '_>) {
        for column in (0..self.width).step_by(4) {
            painter.paint(column, self.row, self.colour);
        }
    }
}

struct Stroke {
    columns: Vec<Option<Extent>>,
    range: Range,
    height: usize,
    colour: Color,
    skips: Option<usize>,
}

impl Shape for Stroke {
    fn draw(&self, painter: &mut Painter<'_, '_>) {
        for (column, extent) in self.columns.iter().enumerate() {
            let Some(extent) = extent else { continue };
            let (high, low) = match self.skips {
                Some(odd) if (column + odd) % 2 == 1 => continue,
                Some(_) => (extent.last, extent.last),
                None => (extent.high, extent.low),
            };
            let top = row(high, self.range, self.height);
            for row in top..=row(low, self.range, self.height) {
                painter.paint(column, row, self.colour);
            }
        }
    }
}
