//! What is known of each board besides what it measures or does.

use protocol::{ArmState, Role, RoleCounters, Status};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::text;
use crate::monitor::board::Board;
use crate::monitor::dashboard::Dashboard;
use crate::monitor::theme::Theme;
use crate::state::{State, version};

/// Width of a board's name with what stands around it.
const NAME_WIDTH: u16 = 10;

/// A fact about a board.
pub struct Fact {
    name: &'static str,
    value: String,
    style: Style,
    /// Where there is no room for all, those of a lower rank stay.
    rank: u8,
}

impl Fact {
    /// Width with the gap before it.
    fn width(&self) -> usize {
        let name = match self.name.len() {
            0 => 0,
            length => length + 1,
        };
        2 + name + self.value.chars().count()
    }

    /// The fact in words, after a gap.
    pub fn spans(self, theme: Theme) -> [Span<'static>; 2] {
        let name = match self.name {
            "" => "  ".to_owned(),
            name => format!("  {name} "),
        };
        [
            Span::styled(name, theme.quiet()),
            Span::styled(self.value, self.style),
        ]
    }
}

/// How a board is to be reached, how long it runs, why it started, and its firmware: as far as it is known.
pub fn facts(board: &Board, now_us: u64, theme: Theme) -> Vec<Fact> {
    let mut facts = Vec::new();
    let mut add = |rank, name, value: String, style| {
        facts.push(Fact {
            name,
            value,
            style,
            rank,
        })
    };
    let plain = Style::new();
    if let Some(clocks) = board.clocks {
        let offset_s = clocks.offset_us as f64 / 1e6;
        add(3, "rtt", text::short(clocks.round_trip_us), plain);
        add(6, "clock", format!("{offset_s:+.4} s"), plain);
    }
    if let Some(uptime_us) = board.uptime_us(now_us) {
        add(4, "up", text::duration(uptime_us), plain);
    }
    if let Some(trip) = board.arm_stopped {
        add(0, "arm", ArmState::Stopped(trip).to_string(), theme.bad());
    }
    if let Some((_, status)) = &board.status {
        let style = |count: u32, if_any| if count > 0 { if_any } else { plain };
        let (misses, resets) = (missed(status), status.watchdog_resets);
        add(
            1,
            "misses",
            text::brief(misses),
            style(misses, theme.warning()),
        );
        add(
            2,
            "watchdog",
            text::brief(resets),
            style(resets, theme.bad()),
        );
        add(5, "by", status.reset.name().to_owned(), plain);
    }
    if let Some(State::Known(_, hello)) = &board.state {
        add(7, "", version(hello), theme.quiet());
        add(8, "", hello.chip_name().to_owned(), theme.quiet());
    }
    facts
}

/// What was not done in time: samples, or output ticks.
const fn missed(status: &Status) -> u32 {
    match &status.role {
        RoleCounters::Sensor(counters) => counters.deadline_misses,
        RoleCounters::Display(counters) => counters.deadline_misses,
    }
}

/// The facts for which there is `room`, those of a low rank first; none is cut.
pub fn fitting(facts: Vec<Fact>, mut room: usize) -> Vec<Fact> {
    let mut ranks: Vec<(u8, usize)> = facts.iter().map(|fact| (fact.rank, fact.width())).collect();
    ranks.sort_unstable();
    ranks.retain(|(_, width)| {
        let rest = room.checked_sub(*width);
        room = rest.unwrap_or(room);
        rest.is_some()
    });
    let stays = |fact: &Fact| ranks.iter().any(|(rank, _)| *rank == fact.rank);
    facts.into_iter().filter(stays).collect()
}

/// Draws all facts about both boards, over as many rows as they take.
pub fn draw(frame: &mut Frame<'_>, area: Rect, shown: &Dashboard, theme: Theme) {
    let about = "how they are reached, how long they run, and by what they started";
    let area = text::panel(frame, area, theme, text::title(theme, "boards", about));
    let mut lines = Vec::new();
    for role in [Role::Sensor, Role::Display] {
        let mut line = vec![Span::styled(format!(" {:<8}", role.name()), theme.of(role))];
        let room = usize::from(area.width.saturating_sub(NAME_WIDTH));
        let mut used = 0;
        for fact in facts(shown.board(role), shown.now_us, theme) {
            if used > 0 && used + fact.width() > room {
                lines.push(std::mem::replace(&mut line, vec![Span::raw(" ".repeat(9))]));
                used = 0;
            }
            used += fact.width();
            line.extend(fact.spans(theme));
        }
        lines.push(line);
    }
    for (row, line) in (0..).zip(lines) {
        text::put(frame, area, row, Line::from(line));
    }
}
