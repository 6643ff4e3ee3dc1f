//! Fewer points where nobody could see them all.

pub const LINE_POINTS: usize = 1_500;
pub const DOTS: usize = 800;

/// Every nth of the items, n as small as leaves no more than `most`.
pub fn thin<T: Copy>(items: &[T], most: usize) -> Vec<T> {
    let every = stride(items.len(), most);
    items.iter().copied().step_by(every).collect()
}

pub fn stride(length: usize, most: usize) -> usize {
    length.div_ceil(most).max(1)
}
