//! The dashboard on a terminal of any size.
//!
//! ```text
//! boards, their ports and clocks; the supervisor
//! surface: λ, how sure     │ λ over the last seconds
//! fingertip: fifty places  │ v of arm and hand
//! gauges, ports, log: one below the other, or one of them where there is less room
//! keys
//! ```

mod big;
mod fingertip;
mod gauges;
mod header;
mod help;
mod log;
mod plot;
mod ports;
mod settings;
mod surface;
mod text;
mod tiny;
mod velocity;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};

use super::dashboard::Dashboard;
use super::view::{Panel, View};

/// Below this size only the most needful lines are shown.
const LEAST_WIDTH: u16 = 60;
const LEAST_HEIGHT: u16 = 16;
/// Width of what stands at the left of the traces.
const LEFT_WIDTH: u16 = 35;
/// Heights with the line of the title.
const SURFACE_HEIGHT: u16 = 7;
const FINGERTIP_HEIGHT: u16 = 7;
const GAUGES_HEIGHT: u16 = 7;
const PORTS_HEIGHT: u16 = 8;
const LOG_HEIGHT: u16 = 3;

/// Draws what is `shown`. What must not be late, the supervisor's state and the last notice, is taken
/// from `live`, which is another while the view is frozen.
pub fn draw(frame: &mut Frame<'_>, live: &Dashboard, shown: &Dashboard, view: &View) {
    let area = frame.area();
    if area.width < LEAST_WIDTH || area.height < LEAST_HEIGHT {
        tiny::draw(frame, area, live, view);
        return;
    }
    let head = header::height(live, area.width);
    let [header, body, keys] = Layout::vertical([
        Constraint::Length(head),
        Constraint::Fill(1),
        Constraint::Length(1),
    ])
    .areas(area);
    header::draw(frame, header, live, view);
    header::keys(frame, keys, live, view);
    draw_body(frame, body, shown, view);
    if let Some(form) = &view.form {
        settings::draw(frame, body, live, view, form);
    } else if view.shows_help {
        help::draw(frame, body, view.theme);
    }
}

fn draw_body(frame: &mut Frame<'_>, body: Rect, shown: &Dashboard, view: &View) {
    let lower = [GAUGES_HEIGHT, PORTS_HEIGHT, LOG_HEIGHT];
    let all: u16 = lower.iter().sum();
    let upper = SURFACE_HEIGHT + FINGERTIP_HEIGHT;
    let has_room = body.height >= upper + all;
    let upper = if has_room {
        // Half of what is left goes to the traces.
        upper + (body.height - upper - all) / 2
    } else {
        upper.min(body.height)
    };
    let [top, bottom] =
        Layout::vertical([Constraint::Length(upper), Constraint::Fill(1)]).areas(body);
    let [left, right] =
        Layout::horizontal([Constraint::Length(LEFT_WIDTH), Constraint::Fill(1)]).areas(top);
    let halves = Layout::vertical([Constraint::Fill(1), Constraint::Fill(1)]);
    let [surface, fingertip] = halves.areas(left);
    let [wavelength, velocity] = halves.areas(right);
    surface::draw(frame, surface, shown, view.theme);
    surface::draw_trace(frame, wavelength, shown, view);
    fingertip::draw(frame, fingertip, shown, view);
    velocity::draw(frame, velocity, shown, view);
    if has_room {
        let [gauges, ports, log] = Layout::vertical([
            Constraint::Length(lower[0]),
            Constraint::Length(lower[1]),
            Constraint::Fill(1),
        ])
        .areas(bottom);
        gauges::draw(frame, gauges, shown, view);
        ports::draw(frame, ports, shown, view.theme);
        log::draw(frame, log, shown, view.theme);
    } else if bottom.height >= 2 {
        match view.panel {
            Panel::Gauges => gauges::draw(frame, bottom, shown, view),
            Panel::Ports => ports::draw(frame, bottom, shown, view.theme),
            Panel::Log => log::draw(frame, bottom, shown, view.theme),
        }
    }
}
