//! The fifty actuators by their places.

use protocol::ACTUATORS;
use protocol::actuators::Actuator;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::text;
use crate::monitor::dashboard::Dashboard;
use crate::monitor::settings;
use crate::monitor::theme::Theme;
use crate::monitor::view::View;

/// Places along the scan, and across it.
const COLUMNS: usize = 10;
const ROWS: usize = 5;
/// Characters of a place, with the gap to the next one.
const WIDTH: usize = 3;
/// Half of a place: less than a whole block, so that rows stay apart.
const PLACE: &str = "▇";
/// The colours' end, in V.
const FULL_V: f32 = 5.0;

/// Draws the map, and the scale of its colours.
pub fn draw(frame: &mut Frame<'_>, area: Rect, shown: &Dashboard, view: &View) {
    let theme = view.theme;
    let (about, volts) = if view.shows_moment {
        ("V now, computed", shown.volts())
    } else {
        ("peak V, computed", shown.peaks_v())
    };
    let area = text::panel(frame, area, theme, text::title(theme, "fingertip", about));
    let (Some(volts), Some(actuators)) = (volts, shown.fingertip.actuators()) else {
        let why = if shown.fingertip.is_known() {
            [" the display is not heard", ""]
        } else {
            [
                " the display's array is none that",
                " this program knows by its hash",
            ]
        };
        for (row, line) in (0..).zip(why) {
            text::put(frame, area, row, Line::styled(line, theme.quiet()));
        }
        return;
    };
    for (row, places) in (0..).zip(by_place(actuators, &volts)) {
        let mut spans = vec![Span::raw(" ")];
        let cells = places
            .into_iter()
            .flat_map(|place| cell(place, view.shows_moment, theme));
        spans.extend(cells);
        text::put(frame, area, row, Line::from(spans));
    }
    text::put(frame, area, ROWS as u16, scale(shown, view));
}

/// The voltage furthest from 0 at each place, the highest y first.
fn by_place(
    actuators: &[Actuator; ACTUATORS],
    volts: &[f32; ACTUATORS],
) -> [[Option<f32>; COLUMNS]; ROWS] {
    let mut places = [[None; COLUMNS]; ROWS];
    let column = rank(actuators.map(|actuator| actuator.x_um), COLUMNS);
    let row = rank(actuators.map(|actuator| actuator.y_um), ROWS);
    for (index, volt) in volts.iter().enumerate() {
        let place: &mut Option<f32> = &mut places[ROWS - 1 - row[index]][column[index]];
        if place.is_none_or(|before| before.abs() < volt.abs()) {
            *place = Some(*volt);
        }
    }
    places
}

/// Which of `count` equal parts of the way from the lowest to the highest each one is in.
fn rank(values: [i16; ACTUATORS], count: usize) -> [usize; ACTUATORS] {
    let low = values.iter().copied().min().unwrap_or(0);
    let high = values.iter().copied().max().unwrap_or(0);
    let whole = (f32::from(high) - f32::from(low)).max(1.0);
    values.map(|value| {
        let part = (f32::from(value) - f32::from(low)) / whole;
        (part * (count - 1) as f32).round() as usize
    })
}

fn cell(place: Option<f32>, is_signed: bool, theme: Theme) -> [Span<'static>; 2] {
    let Some(volt) = place else {
        return [Span::raw(" ".repeat(WIDTH)), Span::raw("")];
    };
    let text = match (theme.has_colour(), is_signed) {
        (true, _) => PLACE.repeat(WIDTH - 1),
        (false, true) => format!("{volt:+width$.0}", width = WIDTH - 1),
        (false, false) => format!("{volt:width$.0}", width = WIDTH - 1),
    };
    [
        Span::styled(text, colour(volt, is_signed, theme)),
        Span::raw(" "),
    ]
}

fn colour(volt: f32, is_signed: bool, theme: Theme) -> Style {
    if is_signed {
        theme.signed(volt / FULL_V)
    } else {
        theme.rising(volt / FULL_V)
    }
}

/// The colours from end to end, and how the actuators share the stimulus.
fn scale(shown: &Dashboard, view: &View) -> Line<'static> {
    const STEPS: usize = 9;
    let theme = view.theme;
    let low_v = if view.shows_moment { -FULL_V } else { 0.0 };
    let mut spans = vec![Span::styled(format!(" {low_v:.0} "), theme.quiet())];
    if theme.has_colour() {
        spans.extend((0..STEPS).map(|step| {
            let part = step as f32 / (STEPS - 1) as f32;
            let volt = low_v + part * (FULL_V - low_v);
            Span::styled(PLACE, colour(volt, view.shows_moment, theme))
        }));
    } else {
        spans.push(Span::styled("to", theme.quiet()));
    }
    spans.push(Span::styled(format!(" {FULL_V:.0} V"), theme.quiet()));
    let configuration = shown.display.configuration.as_ref();
    if let Some(mode) = configuration.and_then(|known| settings::DISPLAY[0].value(known)) {
        spans.push(Span::styled(format!("   {mode}"), theme.quiet()));
    }
    Line::from(spans)
}
