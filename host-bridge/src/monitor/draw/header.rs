//! The boards, the supervisor, and the keys.

use protocol::{DisplayState, Role, RoleCounters, Status};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Wrap};

use super::text;
use crate::monitor::board::Board;
use crate::monitor::dashboard::{Dashboard, Notice};
use crate::monitor::theme::Theme;
use crate::monitor::view::View;
use crate::state::State;

/// Width of a board's name with what stands around it.
const NAME_WIDTH: u16 = 11;
/// Most rows of a board, whatever there is to say.
const MOST_ROWS: u16 = 4;

/// Rows that the header takes: what is wrong, and the advice, may need some for a board.
pub fn height(live: &Dashboard, width: u16) -> u16 {
    let rows = |role| board_rows(live, role, width);
    rows(Role::Sensor) + rows(Role::Display) + 1
}

fn board_rows(live: &Dashboard, role: Role, width: u16) -> u16 {
    let width = usize::from(width.saturating_sub(NAME_WIDTH)).max(1);
    let mut rows = 1;
    let mut used = 0;
    for word in trouble(live.board(role)).unwrap_or_default().split(' ') {
        let length = word.chars().count();
        if used > 0 && used + 1 + length > width {
            rows += 1;
            used = length;
        } else {
            used += usize::from(used > 0) + length;
        }
    }
    rows.min(MOST_ROWS)
}

/// What is wrong with the way to a board, and what to do about it.
fn trouble(board: &Board) -> Option<String> {
    let state = board.state.as_ref().filter(|state| !state.is_known())?;
    Some(match state.advice() {
        Some(advice) => format!("{state}: {advice}"),
        None => state.to_string(),
    })
}

/// Draws both boards and the supervisor.
pub fn draw(frame: &mut Frame<'_>, area: Rect, live: &Dashboard, view: &View) {
    let mut row = 0;
    for role in [Role::Sensor, Role::Display] {
        let rows = board_rows(live, role, area.width);
        let place = Rect {
            y: area.y + row,
            height: rows,
            ..area
        };
        draw_board(frame, place, live, role, view.theme);
        row += rows;
    }
    let mut line = supervisor(live, view.theme);
    line.spans.extend(marks(live, view));
    let style = line.style;
    text::put(frame, area, row, line.style(style));
}

fn draw_board(frame: &mut Frame<'_>, area: Rect, live: &Dashboard, role: Role, theme: Theme) {
    let board = live.board(role);
    let name = match role {
        Role::Sensor => theme.sensor(),
        Role::Display | Role::Host => theme.display(),
    };
    let head = Line::from(vec![
        Span::styled(format!(" {:<8}", role.name()), name),
        Span::styled("● ", state_style(board, theme)),
    ]);
    text::put(frame, area, 0, head);
    let rest = Rect {
        x: area.x + NAME_WIDTH,
        width: area.width.saturating_sub(NAME_WIDTH),
        ..area
    };
    if let Some(State::Known { port, hello }) = &board.state {
        let [major, minor, patch] = hello.version;
        let firmware = format!("{major}.{minor}.{patch} {}", hello.chip_name());
        let mut spans = vec![Span::raw(port.display().to_string())];
        spans.extend(health(board, live.now_us, theme));
        spans.push(Span::styled(format!("  {firmware}"), theme.quiet()));
        text::put(frame, rest, 0, Line::from(spans));
    } else {
        let words = trouble(board).unwrap_or_else(|| "not looked for yet".to_owned());
        let text = Paragraph::new(words)
            .style(state_style(board, theme))
            .wrap(Wrap { trim: true });
        frame.render_widget(text, rest);
    }
}

/// How it is to be reached, how long it runs, and why it started.
fn health(board: &Board, now_us: u64, theme: Theme) -> Vec<Span<'static>> {
    let mut spans = Vec::new();
    let mut add = |name: &'static str, value: String, style: Style| {
        spans.push(Span::styled(format!("  {name} "), theme.quiet()));
        spans.push(Span::styled(value, style));
    };
    if let Some(clocks) = board.clocks {
        let offset_s = clocks.offset_us as f64 / 1e6;
        add("rtt", text::short(clocks.round_trip_us), Style::new());
        add("clock", format!("{offset_s:+.4} s"), Style::new());
    }
    if let Some(uptime_us) = board.uptime_us(now_us) {
        add("up", text::duration(uptime_us), Style::new());
    }
    if let Some((_, status)) = &board.status {
        let count = |count: u32, if_any: Style| {
            let style = if count > 0 { if_any } else { Style::new() };
            (text::brief(count), style)
        };
        let (misses, style) = count(missed(status), theme.warning());
        add("misses", misses, style);
        let (resets, style) = count(status.watchdog_resets, theme.bad());
        add("watchdog", resets, style);
        add("by", status.reset.name().to_owned(), Style::new());
    }
    spans
}

/// What was not done in time: samples, or output ticks.
const fn missed(status: &Status) -> u32 {
    match &status.role {
        RoleCounters::Sensor(counters) => counters.deadline_misses,
        RoleCounters::Display(counters) => counters.deadline_misses,
    }
}

/// The colour of a board's state.
pub fn state_style(board: &Board, theme: Theme) -> Style {
    match &board.state {
        Some(State::Known { .. }) => theme.good(),
        Some(State::Opened { .. }) => theme.warning(),
        Some(_) => theme.bad(),
        None => theme.quiet(),
    }
}

/// The colour of a notice.
pub const fn notice_style(notice: &Notice, theme: Theme) -> Style {
    if notice.is_bad {
        theme.alarm()
    } else {
        theme.strong()
    }
}

/// The supervisor's state, with its reason.
pub fn supervisor(live: &Dashboard, theme: Theme) -> Line<'static> {
    let Some((since_us, state)) = live.safety else {
        return Line::styled(" supervisor not heard", theme.quiet());
    };
    let words = state.to_string();
    let since = text::seconds(live.now_us.saturating_sub(since_us));
    let style = match state {
        DisplayState::Boot | DisplayState::Ready => theme.strong(),
        DisplayState::Driving => theme.good(),
        DisplayState::Fading(_) => theme.warning(),
        DisplayState::Stopped(_) => {
            let line = format!(
                " {}, 0 V until the display board's reset button or power ",
                words.to_uppercase()
            );
            return Line::from(Span::styled(line, theme.alarm()));
        }
    };
    Line::from(vec![
        Span::styled(
            format!(" {}", words.to_uppercase()),
            style.patch(theme.strong()),
        ),
        Span::styled(format!("  for {since}"), theme.quiet()),
    ])
}

/// What the view itself is up to.
fn marks(live: &Dashboard, view: &View) -> Vec<Span<'static>> {
    let mut spans = Vec::new();
    if view.is_frozen {
        spans.push(Span::raw("  "));
        spans.push(Span::styled(" FROZEN ", view.theme.chosen()));
    }
    if view.is_over {
        spans.push(Span::raw("  "));
        spans.push(Span::styled(" END OF RECORDING ", view.theme.chosen()));
    }
    if let Some(kept) = &view.kept {
        let for_us = live.now_us.saturating_sub(kept.since_us);
        spans.push(Span::styled("  ● recording ", view.theme.bad()));
        spans.push(Span::raw(format!(
            "{}, {}, {:.1} MB safe",
            kept.name,
            text::duration(for_us),
            kept.safe_bytes as f64 / 1e6
        )));
    }
    spans
}

/// Draws the keys, or what is to be said instead.
pub fn keys(frame: &mut Frame<'_>, area: Rect, live: &Dashboard, view: &View) {
    let theme = view.theme;
    if let Some(notice) = live.notice() {
        let line = Line::styled(format!(" {}", notice.text), notice_style(notice, theme));
        frame.render_widget(line, area);
        return;
    }
    let keys = [
        ("s", "stop"),
        ("c", "configure"),
        (
            "r",
            if view.kept.is_some() {
                "end recording"
            } else {
                "record"
            },
        ),
        ("g", "gauges"),
        ("f", if view.is_frozen { "go on" } else { "freeze" }),
        ("+-", "time"),
        ("m", "map"),
        ("Tab", "next"),
        ("?", "help"),
        ("q", "quit"),
    ];
    let needed = |(key, meaning): &(&str, &str)| key.len() + meaning.len() + 3;
    let is_narrow = keys.iter().map(needed).sum::<usize>() > area.width.into();
    // The keys that matter least are in the help.
    let keys = keys
        .into_iter()
        .filter(|(key, _)| !is_narrow || !["+-", "m"].contains(key));
    let spans: Vec<Span<'_>> = keys
        .flat_map(|(key, meaning)| {
            [
                Span::styled(format!(" {key}"), theme.strong()),
                Span::styled(format!(" {meaning} "), theme.quiet()),
            ]
        })
        .collect();
    frame.render_widget(Line::from(spans), area);
}
