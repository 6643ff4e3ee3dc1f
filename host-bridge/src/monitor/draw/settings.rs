//! What is drawn over the middle: the form for settings, or what the keys do and what is seen.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Borders, Clear, Paragraph, Wrap};

use crate::monitor::dashboard::Dashboard;
use crate::monitor::orders::{Outcome, taken};
use crate::monitor::settings::{self, Kind};
use crate::monitor::theme::Theme;
use crate::monitor::view::{Form, View};

const WIDTH: u16 = 74;
/// Width of a value: the longest word that there is.
const VALUE: usize = 16;
/// Rows for what came of a change: a refusal may take two.
const OUTCOME_HEIGHT: u16 = 2;

/// Draws the form over the middle of an area.
pub fn draw(frame: &mut Frame<'_>, area: Rect, live: &Dashboard, view: &View, form: &Form) {
    let theme = view.theme;
    let configuration = live.board(form.role).configuration;
    let chosen = form.setting();
    let mut lines: Vec<Line<'_>> = settings::of(form.role)
        .iter()
        .map(|setting| {
            let is_chosen = chosen.is_some_and(|chosen| std::ptr::eq(chosen, setting));
            let draft = form.draft.as_deref().filter(|_| is_chosen);
            let value = configuration
                .as_ref()
                .and_then(|configuration| setting.value(configuration));
            let (shown, style) = match draft {
                Some(draft) => (format!("{draft}_"), theme.warning()),
                None => (value.unwrap_or_else(|| "?".to_owned()), Style::new()),
            };
            let name = if is_chosen {
                theme.chosen()
            } else {
                theme.quiet()
            };
            let wanted = configuration
                .as_ref()
                .filter(|_| is_chosen && !matches!(setting.kind, Kind::Choice(_)))
                .map(|configuration| setting.wanted(configuration))
                .unwrap_or_default();
            Line::from(vec![
                Span::styled(format!(" {:<20}", setting.name), name),
                Span::styled(format!(" {shown:>VALUE$} "), style),
                Span::styled(format!("{:<6} ", setting.unit), theme.quiet()),
                Span::styled(wanted, theme.quiet()),
            ])
        })
        .collect();
    let choice = chosen
        .filter(|setting| matches!(setting.kind, Kind::Choice(_)))
        .zip(configuration.as_ref())
        .map(|(setting, configuration)| format!(" {}", setting.wanted(configuration)));
    lines.push(Line::styled(choice.unwrap_or_default(), theme.quiet()));
    let (words, style) = match &live.outcome {
        Some(Outcome::Taken(values)) => (taken(values), theme.good()),
        Some(Outcome::Refused(refusal)) => (format!("refused: {refusal}"), theme.bad()),
        Some(Outcome::Misread(misread)) => (misread.to_string(), theme.bad()),
        Some(Outcome::Unanswered) => ("no answer".to_owned(), theme.bad()),
        None if configuration.is_none() => (
            "its configuration is not known yet".to_owned(),
            theme.quiet(),
        ),
        None => (String::new(), Style::new()),
    };
    lines.push(Line::styled(format!(" {words}"), style));
    let place = middle(area, WIDTH, lines.len() as u16 + 1 + OUTCOME_HEIGHT);
    frame.render_widget(Clear, place);
    let block = Block::new()
        .borders(Borders::ALL)
        .border_style(theme.quiet())
        .title(format!(" {} board ", form.role.name()))
        .title_bottom(" ↑↓ setting  0-9 ←→ value  Enter send  Tab other board  Esc close ");
    frame.render_widget(
        Paragraph::new(lines)
            .wrap(Wrap { trim: false })
            .block(block),
        place,
    );
}

/// Each key, or word, and what it means.
const HELP: &str = include_str!("help.txt");
const HELP_WIDTH: u16 = 78;

/// Draws the help over the middle of an area.
pub fn draw_help(frame: &mut Frame<'_>, area: Rect, theme: Theme) {
    let line = |(word, meaning): (&str, &'static str)| {
        let word = Span::styled(format!(" {word:<14}"), theme.strong());
        Line::from(vec![word, Span::raw(meaning)])
    };
    let lines: Vec<Line<'_>> = HELP
        .lines()
        .filter_map(|row| row.split_once(": "))
        .map(line)
        .collect();
    let place = middle(area, HELP_WIDTH, lines.len() as u16 + 2);
    frame.render_widget(Clear, place);
    let block = Block::new()
        .borders(Borders::ALL)
        .border_style(theme.quiet())
        .title(" any key closes this ");
    frame.render_widget(Paragraph::new(lines).block(block), place);
}

/// A place of this size in the middle of an area, or as much of it as there is.
pub fn middle(area: Rect, width: u16, height: u16) -> Rect {
    let (width, height) = (width.min(area.width), height.min(area.height));
    Rect {
        x: area.x + (area.width - width) / 2,
        y: area.y + (area.height - height) / 2,
        width,
        height,
    }
}
