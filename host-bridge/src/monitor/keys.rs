//! What the keys do.

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::dashboard::Dashboard;
use super::view::Form;
use super::view::{SPANS_S, View};

/// What a key asks of whoever runs the dashboard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    Nothing,
    Keep,
    /// The view stands still, or goes on.
    Freeze,
    Quit,
}

/// Whether a key says Stop, whatever is open.
pub fn is_stop(key: KeyEvent) -> bool {
    let with_control = key.modifiers.contains(KeyModifiers::CONTROL);
    !with_control && matches!(key.code, KeyCode::Char('s' | 'S' | ' '))
}

/// A key was pressed. One that says Stop has said so to the boards already.
pub fn press(key: KeyEvent, dashboard: &mut Dashboard, view: &mut View) -> Asked {
    let with_control = key.modifiers.contains(KeyModifiers::CONTROL);
    if with_control && key.code == KeyCode::Char('c') {
        return Asked::Quit;
    }
    if is_stop(key) {
        dashboard.stop();
        return Asked::Nothing;
    }
    if view.form.is_some() {
        press_in_form(key.code, dashboard, view);
        return Asked::Nothing;
    }
    if view.shows_help {
        view.shows_help = false;
        return Asked::Nothing;
    }
    match key.code {
        KeyCode::Char('q') => return Asked::Quit,
        KeyCode::Char('f') => return Asked::Freeze,
        KeyCode::Char('r') => return Asked::Keep,
        KeyCode::Char('g') => dashboard.toggle_gauges(),
        KeyCode::Char('c') => {
            dashboard.read_configurations();
            dashboard.outcome = None;
            view.form = Some(Form::new(protocol::Role::Display));
        }
        KeyCode::Char('m') => view.shows_moment = !view.shows_moment,
        KeyCode::Char('+' | '=') => view.span = view.span.saturating_sub(1),
        KeyCode::Char('-') => view.span = (view.span + 1).min(SPANS_S.len() - 1),
        KeyCode::Tab => view.panel = view.panel.next(),
        KeyCode::Char('?' | 'h') => view.shows_help = true,
        _ => {}
    }
    Asked::Nothing
}

fn press_in_form(code: KeyCode, dashboard: &mut Dashboard, view: &mut View) {
    let Some(form) = &mut view.form else {
        return;
    };
    let configuration = dashboard.board(form.role).configuration;
    match code {
        KeyCode::Esc | KeyCode::Char('q' | 'c') => view.form = None,
        KeyCode::Down | KeyCode::Char('j') => form.step(true),
        KeyCode::Up | KeyCode::Char('k') => form.step(false),
        KeyCode::Right | KeyCode::Char('l') => form.roll(true, configuration.as_ref()),
        KeyCode::Left | KeyCode::Char('h') => form.roll(false, configuration.as_ref()),
        KeyCode::Tab => {
            form.turn();
            dashboard.outcome = None;
        }
        KeyCode::Backspace => form.erase(configuration.as_ref()),
        KeyCode::Char(digit) => form.type_digit(digit),
        KeyCode::Enter => {
            if let (Some(setting), Some(draft)) = (form.setting(), form.draft.take()) {
                let role = form.role;
                dashboard.change(role, setting, &draft);
            }
        }
        _ => {}
    }
}
