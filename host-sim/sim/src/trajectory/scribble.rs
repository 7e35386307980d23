//! Four ways to scribble: what a pen leaves on a page, in any size, before it is fitted, hung up and timed.

use super::pen;
use super::{Curve, PiecewisePolynomial};
use libm::{cos, sin};
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::{PI, TAU};

/// A path on the page, in any size, of one of four ways to scribble.
pub(super) fn page(random: &mut Xoshiro256PlusPlus) -> Vec<[f64; 2]> {
    match random.random_range(0..4) {
        0 => loops(random),
        1 => wander(random),
        2 => zigzag(random),
        _ => curl(random),
    }
}

/// A row of loops such as a handwritten "elele": a turning hand that moves along, with changing height.
fn loops(random: &mut Xoshiro256PlusPlus) -> Vec<[f64; 2]> {
    let turns: f64 = random.random_range(2.5..4.5);
    let width: f64 = random.random_range(0.35..0.75) * 4.0 / turns;
    let lean = random.random_range(-0.3..0.6);
    let side = if random.random_bool(0.5) { 1.0 } else { -1.0 };
    let start = random.random_range(0.0..TAU);
    let swell: [f64; 4] = std::array::from_fn(|_| random.random_range(0.0..TAU));
    (0..=4000)
        .map(|i| {
            let part = f64::from(i) / 4000.0;
            let angle = start + TAU * turns * part + 0.5 * sin(TAU * part * 1.3 + swell[0]);
            let height = 1.0 + 0.35 * sin(TAU * part * 1.7 + swell[1]) + 0.2 * sin(TAU * part * 3.1 + swell[2]);
            let line = 0.35 * sin(TAU * part * 0.8 + swell[3]);
            let up = line + 0.7 * height * sin(angle);
            [4.0 * part + width * height * cos(angle) * side + lean * up, up]
        })
        .collect()
}

/// A quintic spline through the neighbourhood of random points, each well away from the one before.
fn wander(random: &mut Xoshiro256PlusPlus) -> Vec<[f64; 2]> {
    let corners = apart(random.random_range(8..12), 1.2, random);
    let mut controls = vec![corners[0]; 5];
    controls.extend(&corners[1..]);
    controls.extend([corners[corners.len() - 1]; 4]);
    let curve = PiecewisePolynomial::b_spline(&controls, 1.0).expect("more than six control points");
    (0..=6000)
        .map(|i| {
            let [x, y, _] = curve.at(curve.duration() * f64::from(i) / 6000.0).position;
            [x, y]
        })
        .collect()
}

/// Bowed dashes to and fro with rounded corners, some of them sharp.
fn zigzag(random: &mut Xoshiro256PlusPlus) -> Vec<[f64; 2]> {
    let corners = apart(random.random_range(5..8), 1.4, random);
    let sigma = random.random_range(0.08..0.2);
    let mut bowed = vec![corners[0]];
    for pair in corners.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let bow = random.random_range(-0.25..0.25);
        bowed.extend((1..=20).map(|i| {
            let part = f64::from(i) / 20.0;
            let aside = 4.0 * bow * part * (1.0 - part);
            let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
            [from[0] + part * dx - aside * dy, from[1] + part * dy + aside * dx, 0.0]
        }));
    }
    let flat = |p: [f64; 3]| [p[0], p[1]];
    pen::rounded(&bowed, sigma).into_iter().map(flat).collect()
}

/// A pen whose curvature wanders: arcs, hooks, spirals and loops.
fn curl(random: &mut Xoshiro256PlusPlus) -> Vec<[f64; 2]> {
    loop {
        let tones: [(f64, f64, f64); 5] = std::array::from_fn(|k| {
            let waves = k as f64 + random.random_range(0.5..1.5);
            (random.random_range(0.3..1.0), waves, random.random_range(0.0..TAU))
        });
        let bias = random.random_range(-4.0..4.0);
        let strength = random.random_range(6.0..13.0);
        let (mut heading, mut pen) = (0.0, [0.0; 2]);
        let path: Vec<[f64; 2]> = (0..=6000)
            .map(|i| {
                let s = f64::from(i) / 6000.0;
                let wave: f64 = tones.iter().map(|&(a, n, phase)| a * sin(TAU * n * s + phase)).sum();
                heading += (bias + strength * wave) / 6000.0;
                pen = [pen[0] + cos(heading) / 6000.0, pen[1] + sin(heading) / 6000.0];
                pen
            })
            .collect();
        // A page of the wrong format would be squeezed into ellipses.
        let path = turned(&path);
        let [width, height] = extent(&path).map(|[low, high]| high - low);
        if (1.3..3.0).contains(&(width / height)) {
            return path;
        }
    }
}

/// Random points on a page of 4 x 2, each at least `gap` from the one before.
fn apart(count: usize, gap: f64, random: &mut Xoshiro256PlusPlus) -> Vec<[f64; 3]> {
    let mut points: Vec<[f64; 3]> = Vec::with_capacity(count);
    while points.len() < count {
        let point = [random.random_range(0.0..4.0), random.random_range(0.0..2.0), 0.0];
        if points.last().is_none_or(|&last| super::sample::distance(last, point) >= gap) {
            points.push(point);
        }
    }
    points
}

/// The page turned such that it is as wide as possible (found in steps of 5 degrees).
fn turned(path: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let turn = |step: u32| {
        let (s, c) = (sin(PI * f64::from(step) / 36.0), cos(PI * f64::from(step) / 36.0));
        path.iter().map(|[x, y]| [c * x - s * y, s * x + c * y]).collect::<Vec<_>>()
    };
    let width = |path: &[[f64; 2]]| extent(path)[0][1] - extent(path)[0][0];
    (1..36).map(turn).fold(turn(0), |widest, other| if width(&other) > width(&widest) { other } else { widest })
}

/// Lowest and highest value of both coordinates.
pub(super) fn extent(path: &[[f64; 2]]) -> [[f64; 2]; 2] {
    std::array::from_fn(|k| path.iter().fold([f64::MAX, f64::MIN], |[low, high], p| [low.min(p[k]), high.max(p[k])]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn every_page_is_one_unbroken_line_with_width_and_height() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        for draw in [loops, wander, zigzag, curl] {
            for _ in 0..10 {
                let path = draw(&mut random);
                let [width, height] = extent(&path).map(|[low, high]| high - low);
                assert!(width > 0.1 && height > 0.02);
                let step = |p: &[[f64; 2]]| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]);
                assert!(path.windows(2).all(|p| step(p) < 0.01 * (width + height)));
            }
        }
    }
}
