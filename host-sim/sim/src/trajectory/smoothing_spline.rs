//! Cubic smoothing spline through points at arbitrary times.
//!
//! - in: strictly growing times and values;
//! - out: the function that minimises ∫ (f - y)² dt + τ⁴ ∫ f''² dt (the first integral by the trapezoidal rule over the
//!   points): a natural cubic spline, twice continuously differentiable;
//! - never: more than linear work;
//! - source: Reinsch, Numerische Mathematik 10 (1967), with a band LDLᵀ factorisation.
//!
//! Where points lie closer together than τ it acts as a zero-phase low-pass of gain 1 / (1 + (ωτ)⁴): rounding and noise of a
//! recording do not reach the acceleration. Where they lie farther apart it runs through them.

/// Values and second derivatives of the spline at the times. At least three points, times strictly growing.
pub(super) fn smoothed(times: &[f64], values: &[f64], time_constant: f64) -> (Vec<f64>, Vec<f64>) {
    let (count, inner) = (times.len(), times.len() - 2);
    let gaps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let gap = |index: usize| gaps.get(index).copied().unwrap_or(0.0);
    // What each point stands for in the first integral, and the penalty over it.
    let penalty: Vec<f64> = (0..count)
        .map(|i| {
            let before = if i == 0 { 0.0 } else { gap(i - 1) };
            time_constant.powi(4) / (0.5 * (before + gap(i)))
        })
        .collect();
    // Column j of Q: second difference round the inner point j + 1.
    let column = |j: usize| {
        let (before, after) = (1.0 / gaps[j], 1.0 / gaps[j + 1]);
        [before, -before - after, after]
    };
    // Lower band of R + τ⁴ Qᵀ W⁻¹ Q, factorised row by row.
    let mut diagonal = vec![0.0; inner];
    let mut first = vec![0.0; inner];
    let mut second = vec![0.0; inner];
    let mut solution = vec![0.0; inner];
    for j in 0..inner {
        let q = column(j);
        let own: f64 = (0..3).map(|k| q[k] * q[k] * penalty[j + k]).sum();
        diagonal[j] = (gaps[j] + gaps[j + 1]) / 3.0 + own;
        if j + 1 < inner {
            let next = column(j + 1);
            first[j] = gaps[j + 1] / 6.0 + q[1] * next[0] * penalty[j + 1] + q[2] * next[1] * penalty[j + 2];
        }
        if j + 2 < inner {
            second[j] = q[2] * column(j + 2)[0] * penalty[j + 2];
        }
        solution[j] = q[0] * values[j] + q[1] * values[j + 1] + q[2] * values[j + 2];
    }
    for j in 0..inner {
        if j >= 2 {
            diagonal[j] -= second[j - 2] * second[j - 2] * diagonal[j - 2];
            solution[j] -= second[j - 2] * solution[j - 2];
        }
        if j >= 1 {
            diagonal[j] -= first[j - 1] * first[j - 1] * diagonal[j - 1];
            first[j] -= first[j - 1] * diagonal[j - 1] * second[j - 1];
            solution[j] -= first[j - 1] * solution[j - 1];
        }
        first[j] /= diagonal[j];
        second[j] /= diagonal[j];
    }
    for j in (0..inner).rev() {
        solution[j] /= diagonal[j];
        if j + 1 < inner {
            solution[j] -= first[j] * solution[j + 1];
        }
        if j + 2 < inner {
            solution[j] -= second[j] * solution[j + 2];
        }
    }
    let mut fitted = values.to_vec();
    for (j, curvature) in solution.iter().enumerate() {
        for (k, weight) in column(j).into_iter().enumerate() {
            fitted[j + k] -= penalty[j + k] * weight * curvature;
        }
    }
    let mut curvature = vec![0.0; count];
    curvature[1..=inner].copy_from_slice(&solution);
    (fitted, curvature)
}

/// Coefficients of 1, t, t², t³ on each interval, from values and second derivatives at the times.
pub(super) fn cubics(times: &[f64], values: &[f64], curvature: &[f64]) -> Vec<[f64; 4]> {
    (0..times.len() - 1)
        .map(|i| {
            let gap = times[i + 1] - times[i];
            let slope = (values[i + 1] - values[i]) / gap;
            [
                values[i],
                slope - gap * (2.0 * curvature[i] + curvature[i + 1]) / 6.0,
                curvature[i] / 2.0,
                (curvature[i + 1] - curvature[i]) / (6.0 * gap),
            ]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_stays() {
        let times = [0.0, 0.01, 0.5, 0.7, 3.0, 3.2];
        let values = times.map(|t| 2.0 - 3.0 * t);
        let (fitted, curvature) = smoothed(&times, &values, 0.03);
        assert!(fitted.iter().zip(values).all(|(a, b)| (a - b).abs() < 1e-12));
        assert!(curvature.iter().all(|c| c.abs() < 1e-9));
    }

    #[test]
    fn sparse_points_are_met_and_pieces_join() {
        let times = [0.0, 1.0, 1.5, 3.0, 4.0];
        let values = [0.0, 1.0, -1.0, 2.0, 0.0];
        let (fitted, curvature) = smoothed(&times, &values, 0.03);
        assert!(fitted.iter().zip(values).all(|(a, b)| (a - b).abs() < 1e-4));
        let cubics = cubics(&times, &fitted, &curvature);
        for (i, pair) in cubics.windows(2).enumerate() {
            let h = times[i + 1] - times[i];
            let [a, b, c, d] = pair[0];
            assert!((a + h * (b + h * (c + h * d)) - pair[1][0]).abs() < 1e-12);
            assert!((b + h * (2.0 * c + 3.0 * h * d) - pair[1][1]).abs() < 1e-9);
        }
    }

    #[test]
    fn rounding_to_millimetres_does_not_reach_the_acceleration() {
        let times: Vec<f64> = (0..500).map(|i| f64::from(i) * 0.01).collect();
        let exact = |t: f64| (3.0 * t).sin();
        let values: Vec<f64> = times.iter().map(|&t| (exact(t) * 1000.0).round() / 1000.0).collect();
        let (fitted, curvature) = smoothed(&times, &values, 0.03);
        for i in 20..480 {
            assert!((fitted[i] - exact(times[i])).abs() < 6e-4);
            assert!((curvature[i] + 9.0 * exact(times[i])).abs() < 0.4, "{}", curvature[i]);
        }
    }
}
