//! What outlives a learner.
//!
//! *in* what was learned; *out* what is kept of it, and a learner that goes on with it as if nothing had been between; *never* a
//! covariance that no learner has; *source* ours.

use super::Learner;
use crate::learning::kept::{Covariances, KeptAxis};

/// Share of them that weights have which were kept without a covariance that a learner has.
const RECALLED: f32 = 0.1;

impl Learner {
    /// Goes on with what was learned before, as sure of it as then.
    pub fn recall(&mut self, kept: &KeptAxis) {
        let KeptAxis { learned, covariances, .. } = kept;
        self.preview.recall(&learned.preview, &covariances.preview, RECALLED);
        self.feedback.recall(&learned.feedback, &covariances.feedback, RECALLED);
        (self.learned_s, self.noise) = (kept.learned_s, kept.noise);
        let [all, fed] = kept.shares;
        self.judge.recall(all);
        self.swing.recall(fed);
    }

    /// What is kept of it.
    pub fn kept(&self) -> KeptAxis {
        KeptAxis {
            response: self.response,
            learned_s: self.learned_s,
            noise: self.noise,
            shares: [self.judge.share(), self.swing.share()],
            learned: self.learned(),
            covariances: Covariances { preview: self.preview.factors(), feedback: self.feedback.factors() },
        }
    }
}
