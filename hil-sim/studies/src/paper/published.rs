//! What the paper prints of its Table I.

/// Speeds, in mm/s.
pub const SPEEDS_MM_S: [f64; 3] = [30.0, 50.0, 70.0];
/// Specimens, in mm.
pub const CELLS_MM: [f64; 4] = [1.0, 2.0, 3.0, 4.0];
/// The paper's means in mm, for each speed of each specimen.
pub const PAPER_MM: [[f64; 4]; 3] = [
    [1.006, 2.072, 3.390, 4.321],
    [1.006, 1.844, 3.096, 4.038],
    [1.128, 1.978, 3.023, 4.075],
];
