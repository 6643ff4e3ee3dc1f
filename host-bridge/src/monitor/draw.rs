//! The dashboard on a terminal of any size.
//!
//! ```text
//! boards, their ports and clocks; the supervisor
//! surface: λ, how sure     │ λ over the last seconds
//! fingertip: fifty places  │ v of arm and hand
//! gauges, ports, log: one below the other, or one of them where there is less room
//! keys
//! ```

mod boards;
mod fingertip;
mod gauges;
mod header;
mod log;
mod plot;
mod settings;
mod surface;
mod text;

use ratatui::Frame;
use ratatui::layout::Rect;

use super::dashboard::Dashboard;
use super::view::{Panel, View};
use text::{cut_left, cut_top};

/// Below this size only the most needful lines are shown.
const LEAST_WIDTH: u16 = 60;
const LEAST_HEIGHT: u16 = 16;
/// Width of what stands at the left of the traces.
const LEFT_WIDTH: u16 = 35;
/// Heights with the line of the title.
const SURFACE_HEIGHT: u16 = 7;
const FINGERTIP_HEIGHT: u16 = 7;
const GAUGES_HEIGHT: u16 = 7;
const LOG_HEIGHT: u16 = 3;

/// Draws what is `shown`. What must not be late, the supervisor's state and the last notice, is taken
/// from `live`, which is another while the view is frozen.
pub fn draw(frame: &mut Frame<'_>, live: &Dashboard, shown: &Dashboard, view: &View) {
    let area = frame.area();
    if area.width < LEAST_WIDTH || area.height < LEAST_HEIGHT {
        header::draw_tiny(frame, area, live, view);
        return;
    }
    let [header, rest] = cut_top(area, header::height(live, view, area.width));
    let keys_height = header::keys_height(live, area.width);
    let [body, keys] = cut_top(rest, rest.height.saturating_sub(keys_height));
    header::draw(frame, header, live, view);
    header::keys(frame, keys, live, view);
    draw_body(frame, body, shown, view);
    if let Some(form) = &view.form {
        settings::draw(frame, body, live, view, form);
    } else if view.shows_help {
        settings::draw_help(frame, body, view.theme);
    }
}

fn draw_body(frame: &mut Frame<'_>, body: Rect, shown: &Dashboard, view: &View) {
    let lower = [GAUGES_HEIGHT, boards::PORTS_HEIGHT, LOG_HEIGHT];
    let all: u16 = lower.iter().sum();
    let upper = SURFACE_HEIGHT + FINGERTIP_HEIGHT;
    let has_room = body.height >= upper + all;
    let upper = if has_room {
        // Half of what is left goes to the traces.
        upper + (body.height - upper - all) / 2
    } else {
        let table = match view.panel {
            Panel::Ports => boards::PORTS_HEIGHT,
            Panel::Gauges | Panel::Boards | Panel::Log => 0,
        };
        upper.min(body.height.saturating_sub(table))
    };
    let [top, bottom] = cut_top(body, upper);
    let [left, right] = cut_left(top, LEFT_WIDTH);
    let [surface, fingertip] = cut_top(left, left.height / 2);
    let [wavelength, velocity] = cut_top(right, right.height / 2);
    surface::draw(frame, surface, shown, view.theme);
    surface::draw_trace(frame, wavelength, shown, view);
    fingertip::draw(frame, fingertip, shown, view);
    surface::draw_velocity(frame, velocity, shown, view);
    if has_room {
        let [gauges, rest] = cut_top(bottom, lower[0]);
        let [ports, log] = cut_top(rest, lower[1]);
        gauges::draw(frame, gauges, shown, view);
        boards::draw_ports(frame, ports, shown, view.theme);
        log::draw(frame, log, shown, view.theme);
    } else if bottom.height >= 2 {
        match view.panel {
            Panel::Gauges => gauges::draw(frame, bottom, shown, view),
            Panel::Ports => boards::draw_ports(frame, bottom, shown, view.theme),
            Panel::Boards => boards::draw(frame, bottom, shown, view.theme),
            Panel::Log => log::draw(frame, bottom, shown, view.theme),
        }
    }
}
