//! The last seconds of a quantity.
//!
//! Kept in bins of one length, so that memory and the cost of drawing are the same at any rate.

/// Length of a bin in µs: that of the fastest message, [`protocol::Motion`].
const BIN_US: u64 = 2_000;
/// Bins kept: 30 s.
const BINS: usize = 15_000;
/// For so long a value stands until the next one: what comes at 100 Hz and a little late is one line.
const STANDS_US: u64 = 60_000;

/// The longest that can be looked back on, in s.
pub const LONGEST_S: f32 = (BINS as u64 * BIN_US / 1_000_000) as f32;

/// The values of a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// The lowest.
    pub low: f32,
    /// The highest.
    pub high: f32,
    /// The last.
    pub last: f32,
    /// When the last one was, in µs, to a bin.
    at_us: u64,
}

impl Extent {
    const fn of(value: f32, at_us: u64) -> Self {
        Self {
            low: value,
            high: value,
            last: value,
            at_us,
        }
    }

    fn then(self, later: Self) -> Self {
        Self {
            low: self.low.min(later.low),
            high: self.high.max(later.high),
            last: later.last,
            at_us: later.at_us,
        }
    }
}

/// The last 30 s of a quantity.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// A ring, of no length before the first value; bin n of the clock is at n modulo the length.
    bins: Vec<Option<Extent>>,
    newest: u64,
}

impl Trace {
    /// Takes a value of an instant in µs. What is no number, or older than what is kept, is passed over.
    pub fn put(&mut self, at_us: u64, value: f32) {
        if !value.is_finite() {
            return;
        }
        let index = at_us / BIN_US;
        if self.bins.is_empty() {
            self.bins = vec![None; BINS];
            self.newest = index;
        }
        if index > self.newest {
            let passed = (index - self.newest).min(BINS as u64);
            for gone in index + 1 - passed..=index {
                self.bins[place(gone)] = None;
            }
            self.newest = index;
        } else if self.newest - index >= BINS as u64 {
            return;
        }
        let bin = &mut self.bins[place(index)];
        let value = Extent::of(value, at_us);
        *bin = Some(bin.map_or(value, |bin| bin.then(value)));
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.bins.clear();
    }

    /// What was between two instants in µs; none if there was nothing.
    pub fn extent(&self, from_us: u64, to_us: u64) -> Option<Extent> {
        let oldest = self.newest.saturating_sub(BINS as u64 - 1);
        if self.bins.is_empty() {
            return None;
        }
        let from = (from_us / BIN_US).max(oldest);
        let to = (to_us.div_ceil(BIN_US)).min(self.newest + 1);
        (from..to)
            .filter_map(|index| self.bins[place(index)])
            .reduce(Extent::then)
    }

    /// The time that ends at `end_us`, in `count` columns of `column_us` each, the oldest first. A value
    /// stands until the next one, for 60 ms at most, and neighbours touch, so that columns make a line.
    pub fn columns(
        &self,
        end_us: u64,
        column_us: u64,
        count: usize,
    ) -> impl Iterator<Item = Option<Extent>> {
        let first = (end_us / column_us).saturating_sub(count as u64);
        let begin_us = first * column_us;
        let mut before = self.extent(begin_us.saturating_sub(STANDS_US), begin_us);
        (0..count as u64).map(move |column| {
            let from_us = (first + column) * column_us;
            let to_us = from_us + column_us;
            let standing = before
                .filter(|before| from_us.saturating_sub(before.at_us) < STANDS_US)
                .map(|before| Extent::of(before.last, before.at_us));
            match self.extent(from_us, to_us) {
                Some(new) => {
                    before = Some(new);
                    Some(standing.map_or(new, |standing| standing.then(new)))
                }
                // Nothing has come yet where the present is.
                None => standing.filter(|_| to_us / BIN_US <= self.newest),
            }
        })
    }
}

const fn place(index: u64) -> usize {
    (index % BINS as u64) as usize
}

/// A length of a column, in µs, of which `count` are at least `span_s` seconds: whole bins, so that what
/// is drawn moves on without flickering.
pub fn column_us(span_s: f32, count: usize) -> u64 {
    let exact_us = f64::from(span_s) * 1e6 / count.max(1) as f64;
    ((exact_us / BIN_US as f64).ceil() as u64).max(1) * BIN_US
}
