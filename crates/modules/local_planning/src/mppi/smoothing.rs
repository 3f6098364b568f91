//! Smoothing of controls.

/// Savitzky-Golay weights: quadratic fit over nine values, for the middle one.
/// Savitzky and Golay, 1964, *Smoothing and differentiation of data by simplified least squares procedures*, table I.
const WEIGHTS: [f32; 9] = [-21.0, 14.0, 39.0, 54.0, 59.0, 54.0, 39.0, 14.0, -21.0];
const SUM: f32 = 231.0;
const HALF: usize = 4;

/// Smooths a sequence that follows four earlier values.
/// The last value counts for those beyond the end.
pub(crate) fn smooth(values: &mut [f32], earlier: &[f32; HALF]) {
    // Values that are already smoothed count as they were.
    let mut before = *earlier;
    for at in 0..values.len() {
        let mut sum = 0.0;
        for (weight, k) in WEIGHTS.iter().zip(0..) {
            let value = match k {
                0..HALF => before[k],
                _ => values[(at + k - HALF).min(values.len() - 1)],
            };
            sum += weight * value;
        }
        before.rotate_left(1);
        before[HALF - 1] = values[at];
        values[at] = sum / SUM;
    }
}
