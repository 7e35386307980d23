//! Recursive least squares that stays sound in f32 for days.
//!
//! *in* rows `row . x = target` with noise; *out* x; *never* a covariance that is not positive, or that grows: what is
//! forgotten makes it shrink less; *source* Bierman 1977 (measurement update of P = U D U'), Kulhavý 1987 and Cao and
//! Schwartz 2000 (what is forgotten is what is known in the direction of the row). What differs: never more is forgotten than
//! is learned.

use crate::math::{clamp, finite_or_zero, sqrt};

/// A row surprises by at most this many standard deviations: what is more is an outlier, and counts as that.
const GATE: f32 = 4.0;

/// No row makes what it is about more certain than by this factor in the variance: one that would is of numbers that no axis has,
/// and rounding would be all that is left of the covariance.
const SUREST: f32 = 1e10;

/// How sure unknowns are: their covariance U D U'.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factors<const N: usize, const ABOVE: usize> {
    /// D.
    pub diagonal: [f32; N],
    /// What of U is above its diagonal, column after column; the diagonal is 1.
    pub upper: [f32; ABOVE],
}

impl<const N: usize, const ABOVE: usize> Factors<N, ABOVE> {
    /// Variance of each unknown.
    fn variances(&self) -> [f32; N] {
        let mut variances = self.diagonal;
        let mut upper = self.upper.as_slice();
        for (j, diagonal) in self.diagonal.iter().enumerate() {
            let (column, rest) = upper.split_at_checked(j).unwrap_or_default();
            upper = rest;
            for (variance, upper) in variances.iter_mut().zip(column) {
                *variance += upper * upper * diagonal;
            }
        }
        variances
    }
}

/// A covariance is within its prior but for rounding.
const WITHIN: f32 = 1.001;

/// `N` unknowns; `ABOVE` is the number of entries above the diagonal of an N by N matrix, [`above`]`(N)`.
#[derive(Clone, Debug)]
pub struct LeastSquares<const N: usize, const ABOVE: usize> {
    x: [f32; N],
    /// What of U is above its diagonal, column after column; the diagonal is 1.
    upper: [f32; ABOVE],
    diagonal: [f32; N],
    /// Variances before anything was seen.
    prior: [f32; N],
}

/// Entries above the diagonal of a square matrix with so many columns.
pub const fn above(columns: usize) -> usize {
    columns * columns.saturating_sub(1) / 2
}

impl<const N: usize, const ABOVE: usize> LeastSquares<N, ABOVE> {
    const FITS: () = assert!(ABOVE == above(N), "ABOVE is not above(N)");

    /// Unknowns around 0, with these standard deviations.
    pub fn new(prior: &[f32; N]) -> Self {
        let () = Self::FITS;
        let prior = prior.map(|sigma| sigma * sigma);
        Self { x: [0.0; N], upper: [0.0; ABOVE], diagonal: prior, prior }
    }

    /// The unknowns.
    pub fn values(&self) -> &[f32; N] {
        &self.x
    }

    /// `row . x`.
    pub fn dot(&self, row: &[f32; N]) -> f32 {
        dot(row, &self.x)
    }

    /// Variance of `row . x`.
    pub fn variance(&self, row: &[f32; N]) -> f32 {
        self.diagonal.iter().zip(self.rotated(row)).fold(0.0, |sum, (d, f)| sum + d * f * f)
    }

    /// U' row.
    fn rotated(&self, row: &[f32; N]) -> [f32; N] {
        let mut rotated = *row;
        let mut upper = self.upper.as_slice();
        for (j, value) in rotated.iter_mut().enumerate() {
            let (column, rest) = upper.split_at_checked(j).unwrap_or_default();
            upper = rest;
            for (upper, row) in column.iter().zip(row) {
                *value += upper * row;
            }
        }
        rotated
    }

    /// Learns from a row whose target has this noise, a standard deviation, after a share, 0..1, of what is known in the row's
    /// direction was forgotten. A row or target that is not finite, or out of all proportion
    /// to the noise, teaches nothing.
    pub fn learn(&mut self, row: &[f32; N], target: f32, sigma: f32, share: f32) {
        let noise = sigma * sigma;
        let f = self.rotated(row);
        let variance = self.diagonal.iter().zip(&f).fold(0.0, |sum, (d, f)| sum + d * f * f);
        let surprise = target - self.dot(row);
        // Variance of the row after forgetting, and of the target.
        let growth = 1.0 / (1.0 - clamp(share, 0.0, 0.5));
        let total = noise + growth * variance;
        // Written so that NaN teaches nothing.
        if !(surprise.abs() < f32::MAX && total < SUREST * noise && noise > 0.0 && variance > f32::MIN_POSITIVE) {
            return;
        }
        let most = GATE * sqrt(total);
        let step = growth * clamp(surprise, -most, most) / total;
        // What is learned less what was forgotten, as the noise of a row that teaches so much. Nothing is left of it where as
        // much is forgotten as learned: then the covariance stays. So it never grows.
        let left = growth * variance - (growth - 1.0) * noise;
        let noise = if left > 0.0 { growth * variance * noise / left } else { f32::MAX };
        let mut gain = [0.0; N];
        let mut before = noise;
        let mut upper = self.upper.as_mut_slice();
        for (j, (diagonal, f)) in self.diagonal.iter_mut().zip(&f).enumerate() {
            let g = *diagonal * f;
            let after = before + f * g;
            let (ratio, lambda) = (before / after, -f / before);
            *diagonal *= ratio;
            let (column, columns) = core::mem::take(&mut upper).split_at_mut_checked(j).unwrap_or_default();
            upper = columns;
            let (sums, rest) = gain.split_at_mut(j);
            for (upper, sum) in column.iter_mut().zip(sums) {
                let old = *upper;
                *upper = finite_or_zero(old + *sum * lambda);
                *sum += old * g;
            }
            if let Some(own) = rest.first_mut() {
                *own = g;
            }
            before = after;
        }
        for (x, gain) in self.x.iter_mut().zip(gain) {
            *x = finite_or_zero(*x + gain * step);
        }
    }

    /// How sure the unknowns are.
    pub fn factors(&self) -> Factors<N, ABOVE> {
        Factors { diagonal: self.diagonal, upper: self.upper }
    }

    /// These unknowns, as sure as they were; as sure as a share of the prior's standard deviations, if nothing that was learned
    /// with this prior can be so unsure.
    pub fn recall(&mut self, x: &[f32; N], factors: &Factors<N, ABOVE>, share: f32) {
        self.x = *x;
        let mut pairs = factors.variances().into_iter().zip(self.prior);
        // Written so that NaN is none.
        let sound = pairs.all(|(variance, prior)| variance <= WITHIN * prior) && factors.diagonal.iter().all(|d| *d >= 0.0);
        (self.upper, self.diagonal) = if sound {
            (factors.upper, factors.diagonal)
        } else {
            ([0.0; ABOVE], self.prior.map(|variance| share * share * variance))
        };
    }

    /// Back to the prior.
    pub fn reset(&mut self) {
        (self.x, self.upper, self.diagonal) = ([0.0; N], [0.0; ABOVE], self.prior);
    }
}

fn dot<const N: usize>(a: &[f32; N], b: &[f32; N]) -> f32 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

#[cfg(test)]
mod tests {
    use std::cmp::Ordering;

    use super::*;
    use crate::learning::draw::draw;
    use proptest::prelude::*;

    const N: usize = 4;

    type Four = LeastSquares<N, { above(N) }>;

    /// P = U D U'.
    fn covariance(found: &Four) -> [[f32; N]; N] {
        let upper = |i: usize, j: usize| match i.cmp(&j) {
            Ordering::Less => found.upper[above(j) + i],
            Ordering::Equal => 1.0,
            Ordering::Greater => 0.0,
        };
        core::array::from_fn(|a| core::array::from_fn(|b| (0..N).map(|j| upper(a, j) * found.diagonal[j] * upper(b, j)).sum()))
    }

    #[test]
    fn it_finds_what_made_the_targets() {
        let (mut found, mut seed, truth) = (Four::new(&[1.0; N]), 1, [0.3, -0.7, 0.1, 0.9]);
        for _ in 0..2000 {
            let row = [(); N].map(|()| draw(&mut seed));
            found.learn(&row, dot(&row, &truth) + 0.01 * draw(&mut seed), 0.01, 0.0);
        }
        for (x, truth) in found.values().iter().zip(truth) {
            assert!((x - truth).abs() < 1e-3, "{found:?}");
        }
    }

    #[test]
    fn an_outlier_moves_little_and_a_minute_without_excitation_nothing() {
        let (mut found, mut seed, truth) = (Four::new(&[1.0; N]), 1, [0.3, -0.7, 0.1, 0.9]);
        for _ in 0..2000 {
            let row = [(); N].map(|()| draw(&mut seed));
            found.learn(&row, dot(&row, &truth), 0.01, 1e-3);
        }
        let before = found.clone();
        found.learn(&[1.0, 0.0, 0.0, 0.0], 1e6, 0.01, 1e-3);
        assert!((found.values()[0] - before.values()[0]).abs() < 0.05, "{found:?}");
        found = before.clone();
        for _ in 0..60_000 {
            found.learn(&[0.0; N], 0.01 * draw(&mut seed), 0.01, 1e-3);
        }
        assert_eq!(found.values(), before.values());
        assert_eq!(covariance(&found), covariance(&before));
    }

    #[test]
    fn what_is_excited_is_followed_and_the_rest_kept() {
        let (mut found, mut seed) = (Four::new(&[1.0; N]), 1);
        let mut teach = |found: &mut Four, truth: [f32; N], excited: usize, rows: usize| {
            for _ in 0..rows {
                let row = core::array::from_fn(|i| if i < excited { draw(&mut seed) } else { 0.0 });
                found.learn(&row, dot(&row, &truth), 0.01, 5e-3);
            }
        };
        teach(&mut found, [0.3, -0.7, 0.1, 0.9], N, 4000);
        // For long only the first two move, and one changes.
        teach(&mut found, [0.5, -0.7, 0.0, 0.0], 2, 40_000);
        for (x, truth) in found.values().iter().zip([0.5, -0.7, 0.1, 0.9]) {
            assert!((x - truth).abs() < 2e-2, "{found:?}");
        }
    }

    proptest! {
        /// A covariance that was learned comes back to the bit, and none that could not have been learned.
        #[test]
        fn what_is_recalled_is_as_sure_as_it_was_and_never_less_sure_than_at_first(
            seed in any::<u32>(), rows in 0usize..300, odd in any::<([f32; N], [f32; above(N)])>()
        ) {
            let (mut found, mut seed) = (Four::new(&[1.0; N]), seed);
            for _ in 0..rows {
                found.learn(&[(); N].map(|()| draw(&mut seed)), draw(&mut seed), 0.1, 1e-2);
            }
            let mut next = Four::new(&[1.0; N]);
            next.recall(found.values(), &found.factors(), 0.1);
            prop_assert_eq!(next.factors(), found.factors());
            prop_assert_eq!(next.values(), found.values());
            next.recall(found.values(), &Factors { diagonal: odd.0, upper: odd.1 }, 0.1);
            prop_assert!(next.factors().variances().iter().all(|variance| (0.0..=WITHIN).contains(variance)), "{next:?}");
        }

        /// Rows of any size, some of them not finite, for long: the covariance stays positive and within the prior.
        #[test]
        fn the_covariance_is_sound_whatever_comes_in(
            seed in any::<u32>(), scale in -6f32..3.0, sigma in 1e-4f32..1.0, share in 0f32..0.1,
            odd in prop::collection::vec(any::<[f32; 5]>(), 0..8)
        ) {
            let (mut found, mut seed, scale) = (Four::new(&[1.0; N]), seed, libm::powf(10.0, scale));
            for step in 0..3000usize {
                let (row, target) = match odd.get(step / 40) {
                    Some([a, b, c, d, target]) if step % 40 == 0 => ([*a, *b, *c, *d], *target),
                    _ => ([(); N].map(|()| scale * draw(&mut seed)), draw(&mut seed)),
                };
                found.learn(&row, target, sigma, share);
            }
            let p = covariance(&found);
            for (i, row) in p.iter().enumerate() {
                prop_assert!(row[i] >= 0.0 && row[i] <= 1.0 + 1e-3, "{p:?}");
                prop_assert!(found.diagonal[i] >= 0.0 && found.values()[i].is_finite(), "{found:?}");
            }
        }
    }
}
