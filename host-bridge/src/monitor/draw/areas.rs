//! Areas cut into parts.
//!
//! By hand: ratatui's solver takes as long for a picture as all the drawing.

use ratatui::layout::Rect;

/// The uppermost `height` rows, as far as there are so many, and the rest.
pub fn cut_top(area: Rect, height: u16) -> [Rect; 2] {
    let height = height.min(area.height);
    let (y, rest) = (area.y + height, area.height - height);
    [
        Rect { height, ..area },
        Rect {
            y,
            height: rest,
            ..area
        },
    ]
}

/// The leftmost `width` columns, as far as there are so many, and the rest.
pub fn cut_left(area: Rect, width: u16) -> [Rect; 2] {
    let width = width.min(area.width);
    let (x, rest) = (area.x + width, area.width - width);
    [
        Rect { width, ..area },
        Rect {
            x,
            width: rest,
            ..area
        },
    ]
}

/// Columns of one width, a space apart; what is left over stays empty at the right.
pub fn columns<const COUNT: usize>(area: Rect) -> [Rect; COUNT] {
    const GAP: u16 = 1;
    let count = COUNT as u16;
    let width = area.width.saturating_sub(GAP * (count - 1)) / count;
    std::array::from_fn(|index| Rect {
        x: area.x + (width + GAP) * index as u16,
        width,
        ..area
    })
    .map(|column| column.intersection(area))
}
