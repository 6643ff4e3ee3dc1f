//! What is known of each board besides what it measures or does, and the counters of every port: both of each board, and
//! this program's ends of their consoles.

use protocol::{ArmState, PortCounters, Role, RoleCounters, Status};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::text;
use super::text::cut_left;
use crate::monitor::board::Board;
use crate::monitor::dashboard::Dashboard;
use crate::monitor::theme::Theme;
use crate::state::{State, version};

/// Width of a board's name with what stands around it.
const NAME_WIDTH: u16 = 10;

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

/// Width of a port's name, and of a number.
const NAME: usize = 16;
const NUMBER: usize = 8;

struct Column {
    name: &'static str,
    /// Whether it counts what should not be.
    is_bad: bool,
    count: fn(&PortCounters) -> u32,
}

const fn column(name: &'static str, is_bad: bool, count: fn(&PortCounters) -> u32) -> Column {
    Column {
        name,
        is_bad,
        count,
    }
}

/// The counters, those first that tell most: what there is no room for is left out at the end.
const COLUMNS: [Column; 13] = [
    column("sent", false, |port| port.sent),
    column("heard", false, |port| port.received),
    column("lost", true, |port| port.lost),
    column("corrupt", true, |port| port.corrupt),
    column("dropped", true, |port| port.dropped),
    column("overrun", true, |port| port.overruns),
    column("noise", true, |port| port.line_errors),
    column("late", true, |port| port.late),
    column("twice", true, |port| port.duplicated),
    column("stray", false, |port| port.unheralded),
    column("foreign", true, |port| port.foreign),
    column("unread", true, |port| port.malformed),
    column("long", true, |port| port.overlong),
];

/// Rows of the table with its heading.
pub const PORTS_HEIGHT: u16 = 7;

/// Draws the table. Where there is no room for all counters, the last column adds up what is left of those
/// that count what should not be.
pub fn draw_ports(frame: &mut Frame<'_>, area: Rect, shown: &Dashboard, theme: Theme) {
    let fitting = usize::from(area.width).saturating_sub(NAME) / NUMBER;
    let is_narrow = fitting < COLUMNS.len();
    let shown_columns = if is_narrow {
        fitting.saturating_sub(1)
    } else {
        COLUMNS.len()
    };
    let (columns, rest) = COLUMNS.split_at(shown_columns);
    let others = |port: &PortCounters| {
        let bad = rest.iter().filter(|column| column.is_bad);
        bad.map(|column| (column.count)(port))
            .fold(0, u32::saturating_add)
    };
    // The names stand in the panel's own line, which takes a row less.
    let inner = text::panel(frame, area, theme, text::title(theme, "ports", ""));
    let names: Vec<Span<'_>> = columns
        .iter()
        .map(|column| column.name)
        .chain((!rest.is_empty()).then_some("others"))
        .map(|name| Span::styled(format!("{name:>NUMBER$}"), theme.quiet()))
        .collect();
    let [_, heading] = cut_left(area, NAME as u16);
    text::put(frame, heading, 0, Line::from(names));
    for (row, (name, counters)) in (0..).zip(shown.ports()) {
        let name = format!(" {name:<width$}", width = NAME - 1);
        let mut spans = vec![Span::styled(name, theme.quiet())];
        let count =
            |column: &Column| number(column.is_bad, counters.as_ref().map(column.count), theme);
        spans.extend(columns.iter().map(count));
        if !rest.is_empty() {
            spans.push(number(true, counters.as_ref().map(others), theme));
        }
        text::put(frame, inner, row, Line::from(spans));
    }
}

fn number(is_bad: bool, count: Option<u32>, theme: Theme) -> Span<'static> {
    let Some(count) = count else {
        return Span::styled(format!("{:>NUMBER$}", "-"), theme.quiet());
    };
    let style = match (is_bad, count) {
        (_, 0) => theme.quiet(),
        (true, _) => theme.warning(),
        (false, _) => Style::new(),
    };
    Span::styled(format!("{:>NUMBER$}", text::brief(count)), style)
}
