//! Normal equations of a linear least-squares fit: the same terms for every gauge, each with its own coefficients.

use protocol::GAUGES;

/// Rows that are summed up at a time, so that a sum is fetched and stored once for all of them.
const ROWS: usize = 4;

/// Sums over rows of terms f, and of what each gauge felt, s.
#[derive(Clone, Copy, Debug)]
pub struct NormalEquations<const TERMS: usize> {
    /// Lower triangle of Σ f fᵀ.
    pub products: [[f32; TERMS]; TERMS],
    /// Σ f s of each gauge.
    pub right: [[f32; TERMS]; GAUGES],
    /// Σ s² of each gauge.
    pub square: [f32; GAUGES],
    /// Rows that are not in the sums yet, and how many.
    rows: [Row<TERMS>; ROWS],
    filled: usize,
}

#[derive(Clone, Copy, Debug)]
struct Row<const TERMS: usize> {
    terms: [f32; TERMS],
    felt: [f32; GAUGES],
}

impl<const TERMS: usize> Row<TERMS> {
    const EMPTY: Self = Self {
        terms: [0.0; TERMS],
        felt: [0.0; GAUGES],
    };
}

impl<const TERMS: usize> Default for NormalEquations<TERMS> {
    fn default() -> Self {
        Self {
            products: [[0.0; TERMS]; TERMS],
            right: [[0.0; TERMS]; GAUGES],
            square: [0.0; GAUGES],
            rows: [Row::EMPTY; ROWS],
            filled: 0,
        }
    }
}

impl<const TERMS: usize> NormalEquations<TERMS> {
    /// Takes a row: its terms, of which the first is a constant 1, and what the gauges felt, in ADC steps.
    #[inline(always)]
    pub fn add(&mut self, terms: [f32; TERMS], felt: [f32; GAUGES]) {
        self.rows[self.filled] = Row { terms, felt };
        self.filled = (self.filled + 1) % ROWS;
        if self.filled == 0 {
            self.sum();
        }
    }

    /// Sums up the rows that wait.
    #[inline]
    pub fn take_in(&mut self) {
        if self.filled > 0 {
            self.rows[self.filled..].fill(Row::EMPTY);
            self.filled = 0;
            self.sum();
        }
    }

    #[inline(never)]
    fn sum(&mut self) {
        let [one, two, three, four] = &self.rows;
        // A term times the constant, which costs nothing once the loops are unrolled.
        let by = |i: usize, term: f32, other: f32| if i == 0 { other } else { term * other };
        for i in 0..TERMS {
            for j in 0..=i {
                self.products[i][j] += by(j, one.terms[j], one.terms[i])
                    + by(j, two.terms[j], two.terms[i])
                    + by(j, three.terms[j], three.terms[i])
                    + by(j, four.terms[j], four.terms[i]);
            }
        }
        for gauge in 0..GAUGES {
            let felt = [one, two, three, four].map(|row| row.felt[gauge]);
            for i in 0..TERMS {
                self.right[gauge][i] += by(i, one.terms[i], felt[0])
                    + by(i, two.terms[i], felt[1])
                    + by(i, three.terms[i], felt[2])
                    + by(i, four.terms[i], felt[3]);
            }
            self.square[gauge] += felt.iter().map(|x| x * x).sum::<f32>();
        }
    }
}

/// Eliminates the first `unknowns` from a lower triangle of products: in their columns the factors stay, in the others
/// what is left of the products (the Schur complement). Returns 1 / each pivot; `None` if one is not above its `least`:
/// the rows do not tell the unknowns apart.
#[inline(always)]
pub fn eliminate<const TERMS: usize, const UNKNOWNS: usize>(
    a: &mut [[f32; TERMS]; TERMS],
    least: impl Fn(usize) -> f32,
) -> Option<[f32; UNKNOWNS]> {
    let mut pivots = [0.0_f32; UNKNOWNS];
    for j in 0..UNKNOWNS {
        if a[j][j] <= least(j) {
            return None;
        }
        pivots[j] = 1.0 / a[j][j];
        for i in j + 1..TERMS {
            let factor = a[i][j] * pivots[j];
            #[allow(
                clippy::needless_range_loop,
                reason = "two rows of one matrix; a slice of each is twice the instructions on the board"
            )]
            for k in j + 1..=i {
                a[i][k] -= factor * a[k][j];
            }
        }
        for row in &mut a[j + 1..] {
            row[j] *= pivots[j];
        }
    }
    Some(pivots)
}

/// Eliminates the first `unknowns` from a right side as well, by what [`eliminate`] has left in `a`.
#[inline(always)]
pub fn eliminate_right<const TERMS: usize>(
    a: &[[f32; TERMS]; TERMS],
    y: &mut [f32; TERMS],
    unknowns: usize,
) {
    for j in 0..unknowns {
        for i in j + 1..TERMS {
            y[i] -= a[i][j] * y[j];
        }
    }
}
