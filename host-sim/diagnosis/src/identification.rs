//! From a record to transfer functions that could be the true one.
//!
//! *in* a record at the sub-rate; *out* [`Identified`]; *never* an unstable model; *source* Zhu and Hjalmarsson, "The Box-Jenkins
//! Steiglitz-McBride algorithm", Automatica 65 (2016): whiten with the high-order [`Arx`], then Steiglitz-McBride; here polished
//! by Levenberg-Marquardt on the same whitened output error. Consistent for noise of any colour, because the reference does not
//! depend on it. Order, length of the numerator and dead time: Schwarz's criterion (BIC), whose weights also say how sure the
//! dead time is. What else could be true is told by all forms together, each with its weight by Akaike's criterion (Burnham and
//! Anderson, "Model selection and multimodel inference", 2002): a form that the log does not rule out may have the zero, or the
//! lag, that the best one lacks.

use nalgebra::{DMatrix, DVector};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use crate::{
    arx::Arx,
    excitation::{alike, increments, most_alike},
    output_error::{Candidate, Whitened, coefficients},
    polynomial::is_stable,
    record::{Record, Segment},
    transfer_function::TransferFunction,
};

/// A form of model that the log does not rule out.
#[derive(Clone, Debug)]
pub struct Member {
    /// Its weight; those of all members sum to 1.
    pub weight: f64,
    /// The best model of this form.
    pub model: TransferFunction,
    /// Covariance of numerator, denominator without its first 1, whitened offset, in this order; larger than white errors explain
    /// where the model is not the whole truth.
    pub covariance: DMatrix<f64>,
}

/// A model with its uncertainty.
#[derive(Clone, Debug)]
pub struct Identified {
    /// The model.
    pub model: TransferFunction,
    /// Forms that could be the true one, the likeliest first.
    pub members: Vec<Member>,
    /// The best models of all forms that explain the log nearly as well as the best of all, with a few coefficients more.
    pub rivals: Vec<TransferFunction>,
    /// Weight of each dead time, in ticks, after the data; they sum to 1.
    pub dead_times: Vec<(usize, f64)>,
    /// Noise at the output, segment by segment: measured minus simulated, in the output's unit.
    pub noise: Vec<Vec<f64>>,
    /// Order of the whitening filter.
    pub whitening_order: usize,
}

/// Highest order of the denominator.
const HIGHEST_ORDER: usize = 4;
/// A draw that leaves more than this times what the model leaves of the log, in mean square, could not be the true one: where
/// poles nearly cancel zeros, a normal distribution of coefficients reaches far out of the data's valley.
const WORSE: f64 = 1.5;
/// A form is a rival if its likelihood is within this of the best one's, twice in logarithms: chi-squared for two at 95 %.
const RIVAL: f64 = 6.0;
/// Coefficients that a rival may have more than the best model: others find zeros beside poles in any noise.
const RIVAL_SIZE: f64 = 2.0;
/// How often a draw that could not be the true one is halved in its distance from the middle.
const HALVINGS: usize = 12;
/// Longest dead time tried, ticks.
const LONGEST_DEAD_TIME: usize = 12;
/// The same of a loop that is seen to answer later.
const LATEST: usize = 400;
/// Dead times of a late loop that are tried first.
const TRIED: usize = 60;
/// Forms of less weight than this share of the best one's are not drawn from, nor more of them than this.
const LEAST_WEIGHT: f64 = 0.02;
const MOST_MEMBERS: usize = 12;

/// Dead times that are tried, ticks: [`LONGEST_DEAD_TIME`], or up to the lag at which the two columns move most alike, if that is
/// twice as late and more: a loop answers before that.
fn longest_dead_time(record: &Record) -> usize {
    let most = (record.shortest() / 6).min(LATEST);
    let moved = |Segment { reference, measured }: &Segment| [increments(reference), increments(measured)];
    let moved: Vec<[Vec<f64>; 2]> = record.segments.iter().map(moved).collect();
    let lag = most_alike(most, |lag| alike(&moved, lag));
    if lag >= 2 * LONGEST_DEAD_TIME { lag } else { LONGEST_DEAD_TIME }
}

/// Identifies the channel; `None` if no stable model explains anything.
pub fn identify(record: &Record) -> Option<Identified> {
    let arx = Arx::fit(record)?;
    let longest = longest_dead_time(record);
    let whitened = Whitened::new(record, &arx, longest);
    if whitened.rows < 40 {
        return None;
    }
    let schwarz = |candidate: &Candidate| candidate.deviance + candidate.size() * (whitened.rows as f64).ln();
    let best = |candidates: &[Candidate]| -> Option<usize> {
        (0..candidates.len()).min_by(|&a, &b| schwarz(&candidates[a]).total_cmp(&schwarz(&candidates[b])))
    };
    let fits = |forms: Vec<[usize; 3]>| -> Vec<Candidate> {
        forms.into_par_iter().filter_map(|[order, terms, dead_time]| whitened.fit(order, terms, dead_time)).collect()
    };
    // Where the dead time lies is seen with few coefficients; the rest is tried round it.
    let step = (longest / TRIED).max(2);
    let dead_times = (0..=LONGEST_DEAD_TIME).chain((LONGEST_DEAD_TIME + step..=longest).step_by(step));
    let first = [[2, 1], [2, 2], [3, 3]];
    let mut candidates = fits(dead_times.flat_map(|dead_time| first.map(|[order, terms]| [order, terms, dead_time])).collect());
    let near = candidates[best(&candidates)?].model.dead_time;
    let near = near.saturating_sub(step)..=near + step;
    let tried = |candidates: &[Candidate], form: &[usize; 3]| candidates.iter().any(|candidate| candidate.form() == *form);
    let orders = || (1..=HIGHEST_ORDER).flat_map(|order| (1..=order + 1).map(move |terms| [order, terms]));
    let others = orders().flat_map(|[order, terms]| near.clone().map(move |dead_time| [order, terms, dead_time]));
    candidates.extend(fits(others.filter(|form| !tried(&candidates, form)).collect()));
    // A model of few poles takes dead time for the poles that it lacks: each form goes its own way to the best one from there.
    for _ in 0..longest {
        let next = orders().flat_map(|[order, terms]| {
            let same = candidates.iter().filter(|candidate| candidate.form()[..2] == [order, terms]);
            let best = same.min_by(|a, b| a.deviance.total_cmp(&b.deviance)).map(|best| best.model.dead_time);
            let around = best.map(|dead_time| [dead_time.saturating_sub(1), dead_time + 1]);
            around.into_iter().flatten().map(move |dead_time| [order, terms, dead_time])
        });
        let next: Vec<[usize; 3]> = next.filter(|form| !tried(&candidates, form)).collect();
        let found = fits(next);
        if found.is_empty() {
            break;
        }
        candidates.extend(found);
    }
    let chosen = best(&candidates)?;
    let least = |dead_time: usize| {
        let of = candidates.iter().filter(|candidate| candidate.model.dead_time == dead_time);
        of.map(&schwarz).fold(f64::INFINITY, f64::min)
    };
    let of_chosen = schwarz(&candidates[chosen]);
    let weights: Vec<(usize, f64)> = (0..=longest + step).map(|d| (d, (0.5 * (of_chosen - least(d))).exp())).collect();
    let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
    let mut model = candidates[chosen].model.clone();
    level(&mut model, record);
    let noise = record
        .segments
        .iter()
        .map(|segment| segment.measured.iter().zip(model.simulate(&segment.reference)).map(|(y, model)| y - model).collect());
    let (members, rivals) = members(&whitened, &candidates, chosen);
    Some(Identified {
        noise: noise.collect(),
        dead_times: weights.into_iter().map(|(d, weight)| (d, weight / total)).filter(|(_, weight)| *weight > 1e-4).collect(),
        model,
        members,
        rivals,
        whitening_order: arx.order,
    })
}

/// The forms that the log does not rule out, and the rivals. Errors that are not white make every difference of likelihoods
/// larger than it is, by as much as they make the covariance larger.
fn members(whitened: &Whitened, candidates: &[Candidate], chosen: usize) -> (Vec<Member>, Vec<TransferFunction>) {
    let of_chosen = &candidates[chosen];
    let robust = whitened.robust(of_chosen);
    let spread =
        of_chosen.covariance.clone().cholesky().map_or(1.0, |white| (white.inverse() * &robust).trace() / of_chosen.size());
    let deviance = |candidate: &Candidate| candidate.deviance / spread.max(1.0);
    let smallest = candidates.iter().map(deviance).fold(f64::INFINITY, f64::min);
    let rivals = candidates
        .iter()
        .filter(|candidate| deviance(candidate) <= smallest + RIVAL && candidate.size() <= of_chosen.size() + RIVAL_SIZE);
    let rivals = rivals.map(|candidate| candidate.model.clone()).collect();
    let akaike = |candidate: &Candidate| deviance(candidate) + 2.0 * candidate.size();
    let least = candidates.iter().map(akaike).fold(f64::INFINITY, f64::min);
    let mut weighted: Vec<(f64, usize)> =
        candidates.iter().enumerate().map(|(index, candidate)| ((0.5 * (least - akaike(candidate))).exp(), index)).collect();
    weighted.retain(|(weight, index)| *weight > LEAST_WEIGHT || *index == chosen);
    weighted.sort_by(|a, b| b.0.total_cmp(&a.0));
    weighted.truncate(MOST_MEMBERS);
    let total: f64 = weighted.iter().map(|(weight, _)| weight).sum();
    let members = weighted
        .into_par_iter()
        .map(|(weight, index)| Member {
            weight: weight / total,
            model: candidates[index].model.clone(),
            covariance: if index == chosen { robust.clone() } else { whitened.robust(&candidates[index]) },
        })
        .collect();
    (members, rivals)
}

/// The offset that leaves no mean. Whitening takes slow noise away and the constant with it, so that the whitened one is
/// uncertain. Gives the mean square of what is then left.
fn level(model: &mut TransferFunction, record: &Record) -> f64 {
    let (mut sum, mut squares, mut count) = (0.0, 0.0, 0);
    for segment in &record.segments {
        for (y, simulated) in segment.measured.iter().zip(model.simulate(&segment.reference)) {
            sum += y - simulated;
            squares += (y - simulated).powi(2);
        }
        count += segment.measured.len();
    }
    let mean = sum / count.max(1) as f64;
    model.offset += mean;
    squares / count.max(1) as f64 - mean * mean
}

/// Models that could as well be the true one.
#[derive(Clone, Debug)]
pub struct Draws {
    /// Stable models of the members' forms, each with the offset that suits the record.
    pub models: Vec<TransferFunction>,
    /// Share of draws for which none was found, however near to the middle: the intervals know nothing of these.
    pub lost: f64,
}

impl Identified {
    /// Draws from each member's distribution, in the number that its weight asks for. One that could not be the true one, because
    /// it is unstable or leaves much more of the record, is drawn half as far from the middle, and again.
    pub fn draws(&self, record: &Record, count: usize, random: &mut impl Rng) -> Draws {
        let bound = WORSE * level(&mut self.model.clone(), record);
        let (mut models, mut lost, mut weight) = (Vec::with_capacity(count), 0usize, 0.0);
        for member in &self.members {
            weight += member.weight;
            let wanted = ((weight * count as f64).round() as usize).min(count) - models.len();
            let (root, centre) = (root(&member.covariance), coefficients(&member.model));
            for _ in 0..wanted {
                let normal = DVector::from_fn(centre.len(), |_, _| StandardNormal.sample(random));
                let mut away = &root * normal;
                let found = (0..HALVINGS).find_map(|_| {
                    let mut model = member.model.with(&(&centre + &away));
                    away *= 0.5;
                    (is_stable(&model.denominator) && level(&mut model, record) <= bound).then_some(model)
                });
                lost += usize::from(found.is_none());
                models.push(found.unwrap_or_else(|| self.model.clone()));
            }
        }
        Draws { lost: lost as f64 / count.max(1) as f64, models }
    }
}

/// A root of a covariance, which rounding may have made indefinite.
fn root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    // In units of each coefficient's own deviation: they differ by many orders.
    let scale = covariance.diagonal().map(|variance| variance.max(0.0).sqrt());
    let unit = DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
        let product = scale[i] * scale[j];
        if product > 0.0 { covariance[(i, j)] / product } else { 0.0 }
    });
    let eigen = unit.symmetric_eigen();
    let widths = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
    DMatrix::from_diagonal(&scale) * eigen.eigenvectors * DMatrix::from_diagonal(&widths)
}
