//! Systems of the paper and of the textbook, and what is refused.

use crate::loops::Known;
use impromptu_diagnosis::{
    Diagnosis, DiagnosisError, Gate, Record, Settings, Verdict, add_on::Features, diagnose, properties::Place,
    transfer_function::TransferFunction,
};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const PERIOD: f64 = 0.01;

/// Steps of random height and length through a system, with white noise.
fn step_test(model: &TransferFunction, ticks: usize, noise: f64) -> Record {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut reference = Vec::new();
    while reference.len() < ticks {
        let (height, held) = (random.random_range(-1.0..1.0), random.random_range(5..60));
        reference.extend(std::iter::repeat_n(height, held));
    }
    let mut measured = model.simulate(&reference);
    for value in &mut measured {
        let white: f64 = StandardNormal.sample(&mut random);
        *value += noise * white;
    }
    let time: Vec<f64> = (0..reference.len()).map(|tick| tick as f64 * PERIOD).collect();
    Record::new(&time, &reference, &measured).unwrap()
}

fn diagnosis(record: &Record) -> Diagnosis {
    diagnose(record, &Settings { sub_rate_hz: Some(1.0 / PERIOD), ..Settings::default() }).unwrap()
}

fn paper(numerator: [f64; 2]) -> TransferFunction {
    TransferFunction { dead_time: 1, numerator: numerator.to_vec(), denominator: vec![1.0, -0.8, 0.15], offset: 0.0 }
}

#[test]
fn the_papers_first_system_may_be_inverted_but_not_by_difference_learning() {
    let found = diagnosis(&step_test(&paper([1.0, -0.2]), 3000, 0.02));
    assert_eq!(found.verdict, Verdict::WillHelpWithoutDifferenceLearning, "{found:#?}");
    assert!(found.properties.gain.contains(16.0 / 7.0) && found.properties.strict_degree.value == 1);
    assert_eq!((found.properties.reversal.value, found.prediction.features), (0.0, Features::Absolute));
    // Lemma 1: the bias that difference learning leaves is seen beforehand.
    let difference = found.with_difference_learning.unwrap().reduction_percent;
    assert!(difference.high < found.prediction.reduction_percent.low, "{difference:?}");
}

#[test]
fn the_papers_second_system_is_flagged_by_its_reversal_and_by_its_zero() {
    let found = diagnosis(&step_test(&paper([450.0, -450.9]), 3000, 0.05));
    assert_eq!(found.verdict, Verdict::WillHelpByWindow, "{found:#?}");
    assert!(found.prediction.reduction_percent.low > 70.0, "{:?}", found.prediction);
    let properties = &found.properties;
    assert!(properties.zeros.len() == 1 && properties.zeros[0].place == Place::Outside);
    assert!(properties.zeros[0].magnitude.contains(1.002), "{:?}", properties.zeros);
    assert!(properties.gain.contains(-18.0 / 7.0) && properties.gain.high - properties.gain.low < 0.2, "{:?}", properties.gain);
    // 450 against -2.57, and it takes about ten ticks until the sign is the final one.
    assert!(properties.reversal.low > 100.0 && (6..=12).contains(&properties.reversal_ticks), "{properties:?}");
    assert!(found.verdict_text().contains("1.002") && found.verdict_text().contains("without bound"), "{}", found.verdict_text());
}

#[test]
fn a_log_without_noise_is_diagnosed_too() {
    for numerator in [[0.35, 0.0], [0.5, -0.15]] {
        let found = diagnosis(&step_test(&paper(numerator), 2000, 0.0));
        let gain = found.properties.gain;
        assert!(
            found.verdict == Verdict::WillHelp && gain.high - gain.low < 1e-3 && (gain.value - 1.0).abs() < 1e-6,
            "{found:#?}"
        );
    }
}

#[test]
fn two_unstable_zeros_are_found_although_no_step_response_starts_the_wrong_way() {
    // Real zeros at 1.15 and 1.25: the step response starts with the sign of its end.
    let model = TransferFunction {
        dead_time: 1,
        numerator: vec![1.0 * 0.8, -2.4 * 0.8, 1.4375 * 0.8],
        denominator: vec![1.0, -1.7, 0.73],
        offset: 0.0,
    };
    assert!(model.step_response(5)[1] * model.gain() > 0.0);
    let found = diagnosis(&step_test(&model, 4000, 0.05));
    let outside = found.properties.zeros.iter().filter(|zero| zero.place == Place::Outside);
    let count: usize = outside.map(|zero| if zero.im > 1e-9 { 2 } else { 1 }).sum();
    assert_eq!((found.verdict, count), (Verdict::WillHelpByWindow, 2), "{:?}", found.properties.zeros);
}

#[test]
fn at_a_slower_rate_the_relative_degree_is_smaller() {
    let model = TransferFunction { dead_time: 6, numerator: vec![0.04], denominator: vec![1.0, -1.6, 0.64], offset: 0.0 };
    let record = step_test(&model, 9000, 0.01);
    let fast = diagnosis(&record);
    let slow = diagnose(&record, &Settings { sub_rate_hz: Some(20.0), ..Settings::default() }).unwrap();
    assert_eq!(fast.properties.strict_degree.value, 6);
    assert_eq!((slow.sub_rate_hz, slow.verdict), (20.0, Verdict::WillHelp), "{slow:#?}");
    assert!((1..=2).contains(&slow.properties.practical_degree.value), "{:?}", slow.properties);
    // 10 ms: ten ticks of the numerator's and the poles' lag.
    assert!((fast.properties.lag_s.value - slow.properties.lag_s.value).abs() < 0.02);
}

#[test]
fn the_same_seed_gives_the_same_diagnosis_on_any_number_of_threads() {
    let record = Known::new(4, 5).record(1000, 6);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| diagnose(&record, &Settings::default()).unwrap())
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn what_cannot_be_diagnosed_is_refused_with_what_to_do() {
    let tones = |frequencies: &[f64]| {
        let time: Vec<f64> = (0..1000).map(|tick| f64::from(tick) * PERIOD).collect();
        let reference: Vec<f64> = time.iter().map(|t| frequencies.iter().map(|w| (w * t).sin()).sum()).collect();
        let measured = paper([1.0, -0.2]).simulate(&reference);
        Record::new(&time, &reference, &measured).unwrap()
    };
    let settings = Settings { sub_rate_hz: Some(100.0), ..Settings::default() };
    assert!(matches!(diagnose(&tones(&[2.0]), &settings), Err(DiagnosisError::FewTones { tones: 1, .. })));
    assert_eq!(diagnose(&tones(&[]), &settings), Err(DiagnosisError::NoExcitation));
    let mut still = tones(&[2.0]);
    still.segments[0].measured.fill(0.3);
    assert_eq!(diagnose(&still, &settings), Err(DiagnosisError::NoAnswer));
    let too_fast = Settings { sub_rate_hz: Some(500.0), ..Settings::default() };
    assert!(matches!(diagnose(&tones(&[2.0]), &too_fast), Err(DiagnosisError::SubRate { .. })));
    let message = diagnose(&tones(&[2.0]), &Settings { sub_rate_hz: Some(4.0), ..settings }).unwrap_err().to_string();
    assert!(message.contains("--sub-rate"), "{message}");
    // Columns that have nothing to do with each other.
    let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut unrelated = Known::new(1, 3).record(1500, 4);
    unrelated.segments[0].measured.iter_mut().for_each(|value| *value = StandardNormal.sample(&mut random));
    assert!(matches!(diagnose(&unrelated, &Settings::default()), Err(DiagnosisError::Unexplained { .. })));
}

#[test]
fn every_gate_says_what_it_saw() {
    let found = diagnosis(&step_test(&paper([450.0, -450.9]), 3000, 0.05));
    assert!(matches!(&found.gates.stable_inverse, Gate::Failed(why) if why.contains("1.002")), "{:?}", found.gates);
    assert!(matches!(found.gates.unit_gain, Gate::Failed(_)), "{:?}", found.gates);
    let text: String = found.lines("m").iter().map(|[label, text]| format!("{label}: {text}\n")).collect();
    for part in ["verdict: will help by a window", "initial reversal", "zeros: 1.002", "above 10 % of the step", "seed 1"] {
        assert!(text.contains(part), "`{part}` is missing in\n{text}");
    }
}

/// A loop of 4 rad/s behind a dead time, under steps, sampled at a rate; both columns by an offset away from zero.
fn sampled(rate_hz: f64, dead_time_s: f64, offset: f64) -> Record {
    const H: f64 = 1e-3;
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let (mut inputs, mut height, mut left) = (Vec::new(), 0.0, 0.0);
    let (mut x, mut v) = (0.0f64, 0.0f64);
    let every = (1.0 / (rate_hz * H)).round() as usize;
    let (mut time, mut reference, mut measured) = (Vec::new(), Vec::new(), Vec::new());
    for step in 0..(60.0 / H) as usize {
        if left <= 0.0 {
            (height, left) = (random.random_range(-1.0..1.0), random.random_range(0.3..3.0));
        }
        left -= H;
        inputs.push(height);
        if step % every == 0 {
            let white: f64 = StandardNormal.sample(&mut random);
            time.push(step as f64 * H);
            reference.push(height + offset);
            measured.push(x + 3e-3 * white + offset);
        }
        let late = step.checked_sub((dead_time_s / H) as usize).map_or(0.0, |step| inputs[step]);
        v += H * (16.0 * (late - x) - 2.0 * 0.7 * 4.0 * v);
        x += H * v;
    }
    Record::new(&time, &reference, &measured).unwrap()
}

/// The lag is 2 d / w and the dead time: 0.35 s and that.
#[test]
fn neither_the_rate_of_a_log_nor_a_long_dead_time_nor_an_offset_matters() {
    for (rate_hz, dead_time_s, offset) in
        [(50.0, 0.0, 0.0), (50.0, 0.0, 1e4), (1000.0, 0.0, 0.0), (1000.0, 0.1, -3e5), (50.0, 0.5, 0.0), (50.0, 1.0, 20.0)]
    {
        let found = diagnose(&sampled(rate_hz, dead_time_s, offset), &Settings::default()).unwrap();
        let (lag, wanted) = (found.properties.lag_s.value, 0.35 + dead_time_s);
        // A minute is short for a loop that answers after a second: its gain stays undecided.
        let right = found.verdict == Verdict::WillHelp || dead_time_s == 1.0 && found.verdict != Verdict::WillNot;
        assert!(right, "{rate_hz} Hz, {dead_time_s} s, {offset}: {}", found.verdict_text());
        assert!((lag / wanted - 1.0).abs() < 0.05, "{rate_hz} Hz, {dead_time_s} s, {offset}: lag {lag} of {wanted}");
    }
}
