//! The boards, the supervisor, and the keys; or the most needful lines, where there is room for no more.

use protocol::{DisplayState, Role};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Wrap};

use super::text::{cut_left, cut_top};
use super::{boards, surface, text};
use crate::monitor::board::Board;
use crate::monitor::dashboard::{Dashboard, Notice};
use crate::monitor::theme::Theme;
use crate::monitor::view::View;
use crate::state::{Advised, State};

/// Width of a board's name with what stands around it.
const NAME_WIDTH: u16 = 11;
/// Most rows of a board, or of a notice, whatever there is to say.
const MOST_ROWS: u16 = 4;

/// Rows that the header takes: what is wrong, and the advice, may need some for a board.
pub fn height(live: &Dashboard, view: &View, width: u16) -> u16 {
    let rows = |role| board_rows(live, role, width);
    rows(Role::Sensor) + rows(Role::Display) + supervisor_rows(live, view, width)
}

/// Rows that the keys take, or the notice in their place.
pub fn keys_height(live: &Dashboard, width: u16) -> u16 {
    live.notice().map_or(1, |notice| {
        rows(&notice.text, width.saturating_sub(1)).min(MOST_ROWS)
    })
}

fn board_rows(live: &Dashboard, role: Role, width: u16) -> u16 {
    let trouble = trouble(live.board(role)).unwrap_or_default();
    rows(&trouble, width.saturating_sub(NAME_WIDTH)).min(MOST_ROWS)
}

/// The marks get a row of their own where they would be cut.
fn supervisor_rows(live: &Dashboard, view: &View, width: u16) -> u16 {
    let marks: usize = marks(live, view).iter().map(Span::width).sum();
    let fits = supervisor(live, view.theme).width() + marks <= usize::from(width);
    if fits || marks == 0 { 1 } else { 2 }
}

/// Rows of so many characters that a text takes.
fn rows(text: &str, width: u16) -> u16 {
    let rows = text::broken(text, width.into()).len();
    u16::try_from(rows).unwrap_or(u16::MAX)
}

/// What is wrong with the way to a board, and what to do about it.
fn trouble(board: &Board) -> Option<String> {
    let state = board.state.as_ref().filter(|state| !state.is_known())?;
    Some(Advised(state).to_string())
}

/// Draws both boards and the supervisor.
pub fn draw(frame: &mut Frame<'_>, area: Rect, live: &Dashboard, view: &View) {
    let mut row = 0;
    for role in [Role::Sensor, Role::Display] {
        let rows = board_rows(live, role, area.width);
        let [place, _] = cut_top(cut_top(area, row)[1], rows);
        draw_board(frame, place, live, role, view.theme);
        row += rows;
    }
    let mut line = supervisor(live, view.theme);
    let marks = marks(live, view);
    if supervisor_rows(live, view, area.width) > 1 {
        text::put(frame, area, row + 1, Line::from(marks));
    } else {
        line.spans.extend(marks);
    }
    text::put(frame, area, row, line);
}

fn draw_board(frame: &mut Frame<'_>, area: Rect, live: &Dashboard, role: Role, theme: Theme) {
    let board = live.board(role);
    let head = Line::from(vec![
        Span::styled(format!(" {:<8}", role.name()), theme.of(role)),
        Span::styled("● ", state_style(board, theme)),
    ]);
    text::put(frame, area, 0, head);
    let [_, rest] = cut_left(area, NAME_WIDTH);
    if let Some(State::Known(port, _)) = &board.state {
        let port = port.display().to_string();
        let room = usize::from(rest.width).saturating_sub(port.chars().count());
        let mut spans = vec![Span::raw(port)];
        for fact in boards::fitting(boards::facts(board, live.now_us, theme), room) {
            spans.extend(fact.spans(theme));
        }
        text::put(frame, rest, 0, Line::from(spans));
    } else {
        let words = trouble(board).unwrap_or_else(|| "not looked for yet".to_owned());
        let text = Paragraph::new(words)
            .style(state_style(board, theme))
            .wrap(Wrap { trim: true });
        frame.render_widget(text, rest);
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
    let words = state.to_string().to_uppercase();
    let since = text::seconds(live.now_us.saturating_sub(since_us));
    let style = match state {
        DisplayState::Boot | DisplayState::Ready => theme.strong(),
        DisplayState::Driving => theme.good(),
        DisplayState::Fading(_) => theme.warning(),
        DisplayState::Stopped(_) => {
            let line = format!(" {words}, 0 V until the display board's reset button or power ");
            return Line::from(Span::styled(line, theme.alarm()));
        }
    };
    Line::from(vec![
        Span::styled(format!(" {words}"), style.patch(theme.strong())),
        Span::styled(format!("  for {since}"), theme.quiet()),
    ])
}

/// What the view itself is up to.
fn marks(live: &Dashboard, view: &View) -> Vec<Span<'static>> {
    let mut spans = Vec::new();
    for (is_so, mark) in [
        (view.is_frozen, " FROZEN "),
        (view.is_over, " END OF RECORDING "),
    ] {
        if is_so {
            spans.extend([Span::raw("  "), Span::styled(mark, view.theme.chosen())]);
        }
    }
    if let Some(kept) = &view.kept {
        let for_us = live.now_us.saturating_sub(kept.since_us);
        spans.push(Span::styled("  ● recording ", view.theme.bad()));
        spans.push(Span::raw(format!(
            "{}, {:.1} MB safe, {}",
            text::duration(for_us),
            kept.safe_bytes as f64 / 1e6,
            kept.name
        )));
    }
    spans
}

/// Draws the keys, or what is to be said instead.
pub fn keys(frame: &mut Frame<'_>, area: Rect, live: &Dashboard, view: &View) {
    let theme = view.theme;
    if let Some(notice) = live.notice() {
        let [_, place] = cut_left(area, 1);
        let words = Paragraph::new(notice.text.as_str()).wrap(Wrap { trim: true });
        frame.render_widget(words.style(notice_style(notice, theme)), place);
        return;
    }
    let keys = [
        ("s", "stop"),
        ("c", "configure"),
        ("r", if view.kept.is_some() { "end" } else { "record" }),
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

/// Draws as many lines as there is room for.
pub fn draw_tiny(frame: &mut Frame<'_>, area: Rect, live: &Dashboard, view: &View) {
    let theme = view.theme;
    let estimate = live.estimate.map(|(_, estimate)| estimate);
    let wavelength = estimate
        .and_then(|estimate| estimate.wavelength_mm)
        .map_or_else(|| "-".to_owned(), surface::millimetres);
    let sure = match estimate {
        Some(estimate) if estimate.valid => "valid",
        Some(_) => "unsure",
        None => "not heard",
    };
    let velocity = |um_s: Option<i32>| {
        let words = um_s.map(|um_s| format!("{:+.1}", um_s as f32 / 1e3));
        words.unwrap_or_else(|| "-".to_owned())
    };
    let hand = velocity(live.motion.map(|(_, motion)| motion.velocity_um_s));
    let arm = velocity(estimate.map(|estimate| estimate.velocity_um_s));
    let board = |role| {
        let board = live.board(role);
        let word = board.state.as_ref().map_or("-", |state| state.word());
        Line::from(vec![
            Span::styled(role.name(), theme.quiet()),
            Span::styled(format!(" {word}"), state_style(board, theme)),
        ])
    };
    let lines = [
        supervisor(live, theme),
        Line::from(vec![
            Span::styled("λ ", theme.quiet()),
            Span::styled(format!("{wavelength} mm"), theme.strong()),
            Span::raw(format!(" {sure}")),
        ]),
        Line::raw(format!("hand {hand} arm {arm} mm/s")),
        board(Role::Sensor),
        board(Role::Display),
        live.notice().map_or_else(
            || Line::styled("s stop  q quit", theme.quiet()),
            |notice| Line::styled(notice.text.clone(), notice_style(notice, theme)),
        ),
    ];
    for (row, line) in (0..).zip(lines) {
        text::put(frame, area, row, line);
    }
}
