//! cos and sin of a phase, by a table and a small rotation.

/// Steps of the table in a cycle.
const STEPS: usize = 1 << STEPS_LOG2;
const STEPS_LOG2: u32 = 8;
const FRACTION_BITS: u32 = 32 - STEPS_LOG2;
/// Radians in one unit of a 32-bit phase.
const RADIANS: f32 = (2.0 * core::f64::consts::PI / 4_294_967_296.0) as f32;

/// cos and sin of each step.
static TABLE: [[f32; 2]; STEPS] = table();

/// cos and sin of `phase`, in 2⁻³² cycles, to within 1e-4: between two steps the nearer one is turned by
/// the angle δ that is left, to first order, which leaves δ²/2 ≤ (π/256)²/2 = 7.5e-5.
#[inline(always)]
pub fn phasor(phase: u32) -> [f32; 2] {
    let nearest = phase.wrapping_add(1 << (FRACTION_BITS - 1)) >> FRACTION_BITS;
    let rest = phase.wrapping_sub(nearest << FRACTION_BITS).cast_signed();
    let delta = rest as f32 * RADIANS;
    let [cos, sin] = TABLE[nearest as usize % STEPS];
    [cos - sin * delta, sin + cos * delta]
}

const fn table() -> [[f32; 2]; STEPS] {
    let mut table = [[0.0; 2]; STEPS];
    let mut step = 0;
    while step < STEPS {
        // Within ±π the series has converged to f64 after fifteen pairs of terms.
        let turns = step as f64 / STEPS as f64;
        let angle = 2.0 * core::f64::consts::PI * if turns > 0.5 { turns - 1.0 } else { turns };
        let (mut cos, mut sin, mut term, mut n) = (0.0, 0.0, 1.0, 0.0);
        while n < 30.0 {
            cos += term;
            term *= angle / (n + 1.0);
            sin += term;
            term *= -angle / (n + 2.0);
            n += 2.0;
        }
        table[step] = [cos as f32, sin as f32];
        step += 1;
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stays_within_its_bound_of_the_true_cosine_and_sine() {
        // δ²/2, and a few roundings of f32.
        let bound = (core::f64::consts::PI / STEPS as f64).powi(2) / 2.0 + 4.0 * 2f64.powi(-24);
        for step in 0..1_000_000_u32 {
            let phase = step.wrapping_mul(2_654_435_761);
            let angle = f64::from(phase) * 2.0 * core::f64::consts::PI / 4_294_967_296.0;
            let [cos, sin] = phasor(phase).map(f64::from);
            let error = libm::hypot(cos - libm::cos(angle), sin - libm::sin(angle));
            assert!(error <= bound, "{error} at {phase}");
        }
    }
}
