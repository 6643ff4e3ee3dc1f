//! What the gauges' complex amplitudes have in common.

use protocol::GAUGES;

use crate::float::{larger, sqrt};

/// A complex amplitude in ADC steps.
pub(super) type Amplitude = [f32; 2];
/// One for each gauge.
pub(super) type Amplitudes = [Amplitude; GAUGES];

/// |Σz|² / (Σ|z|)² from which on gauges have their phase in common: it is 1 for one phase, whatever their
/// gains, and a fifth on average for five random phases.
const ALIGNED: f32 = 0.67;
/// |Σz|² / (n Σ|z|²) from which on they share in it: it is 1 for gauges of one gain, 0.56 if one has five
/// times the others' gain, and a fifth if only one of five has any.
const SHARED: f32 = 0.4;
/// Gauges that must speak before anything can be common to them.
const LEAST_WITNESSES: u32 = 3;

/// Σz over the gauges whose bit in `usable` is set.
pub(super) fn sum(amplitudes: &Amplitudes, usable: u8) -> Amplitude {
    let mut sum = [0.0; 2];
    for (gauge, z) in amplitudes.iter().enumerate() {
        if usable >> gauge & 1 == 1 {
            sum[0] += z[0];
            sum[1] += z[1];
        }
    }
    sum
}

/// Whether what the usable gauges hold may be hum: in one phase, and in more than one gauge.
pub(super) fn is_common(amplitudes: &Amplitudes, usable: u8) -> bool {
    let count = usable.count_ones();
    let together = square(sum(amplitudes, usable));
    if count < LEAST_WITNESSES || together <= SHARED * count as f32 * power(amplitudes, usable) {
        return false;
    }
    // Square roots are dear: only where the rest holds.
    let mut magnitudes = 0.0;
    for (gauge, z) in amplitudes.iter().enumerate() {
        if usable >> gauge & 1 == 1 {
            magnitudes += sqrt(square(*z));
        }
    }
    together >= ALIGNED * magnitudes * magnitudes
}

/// A phase: z / |z|.
pub(super) fn unit(z: Amplitude) -> Amplitude {
    let magnitude = larger(sqrt(square(z)), f32::MIN_POSITIVE);
    z.map(|part| part / magnitude)
}

/// |z|².
pub(super) fn square(z: Amplitude) -> f32 {
    z[0] * z[0] + z[1] * z[1]
}

/// z1 z2*, the real part of which is their likeness.
pub(super) fn conjugate_product(z1: Amplitude, z2: Amplitude) -> Amplitude {
    [z1[0] * z2[0] + z1[1] * z2[1], z1[1] * z2[0] - z1[0] * z2[1]]
}

/// Σ|z|² over the gauges whose bit in `usable` is set.
pub(super) fn power(amplitudes: &Amplitudes, usable: u8) -> f32 {
    let usable = amplitudes
        .iter()
        .enumerate()
        .filter(|(gauge, _)| usable >> gauge & 1 == 1);
    usable.map(|(_, z)| square(*z)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: u8 = 0b11111;

    fn polar(magnitudes: [f32; GAUGES], phases: [f32; GAUGES]) -> Amplitudes {
        core::array::from_fn(|gauge| {
            [libm::cosf, libm::sinf].map(|part| magnitudes[gauge] * part(phases[gauge]))
        })
    }

    #[test]
    fn one_phase_is_common_whatever_the_gains_and_one_gauge_alone_is_not() {
        assert!(is_common(
            &polar([0.3, 1.5, 0.7, 1.2, 0.9], [0.4; GAUGES]),
            ALL
        ));
        assert!(is_common(
            &polar([0.3, 0.3, 0.3, 0.3, 1.5], [0.4; GAUGES]),
            ALL
        ));
        assert!(!is_common(
            &polar([0.0, 0.0, 1.0, 0.0, 0.0], [0.4; GAUGES]),
            ALL
        ));
        // Evenly spread phases have no mean.
        let spread = core::array::from_fn(|gauge| 1.2566 * gauge as f32);
        assert!(!is_common(&polar([1.0; GAUGES], spread), ALL));
        // Two gauges are too few to tell, and none of nothing is NaN.
        assert!(!is_common(&polar([1.0; GAUGES], [0.4; GAUGES]), 0b00011));
        assert!(!is_common(&[[0.0; 2]; GAUGES], ALL));
        assert_eq!(unit([0.0; 2]), [0.0; 2]);
    }
}
