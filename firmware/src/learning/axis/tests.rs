use super::*;
use proptest::prelude::*;

const LIMITS: Limits = Limits { scale: 0.5, correction: 0.5, feedback: 0.3, rate: 20.0 };

fn learner() -> Learner {
    let response = Response::second_order(1.0, 8.0, 0.7, 0.02, 100.0).unwrap();
    Learner::new(response, 100.0, 0.0, LIMITS).unwrap()
}

#[test]
fn limits_are_positive_numbers() {
    let response = Response::second_order(1.0, 8.0, 0.7, 0.02, 100.0).unwrap();
    for odd in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(Learner::new(response, 100.0, 0.0, Limits { scale: odd, ..LIMITS }).is_none());
        assert!(Learner::new(response, 100.0, 0.0, Limits { correction: odd, ..LIMITS }).is_none());
        assert!(Learner::new(response, 100.0, 0.0, Limits { feedback: odd, ..LIMITS }).is_none());
        assert!(Learner::new(response, 100.0, 0.0, Limits { rate: odd, ..LIMITS }).is_none());
    }
}

/// Three axes and what belongs to them are in 10 KB.
#[test]
fn three_axes_are_small() {
    assert!(3 * size_of::<Learner>() <= 9 * 1024, "{}", size_of::<Learner>());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn a_correction_is_within_its_limits_whatever_comes_in(
        signals in prop::collection::vec((
            prop_oneof![4 => any::<[f32; 3]>(), 6 => prop::array::uniform3(-2f32..2.0)], prop::bool::weighted(0.9)
        ), 1..60)
    ) {
        let mut learner = learner();
        learner.start(0.0);
        let mut before = 0.0;
        for tick in 0..600 {
            let at = |tick: i32| signals[tick.rem_euclid(signals.len() as i32) as usize];
            let ([_, value, rate], known) = at(tick);
            let measured = known.then_some(Measured { value, rate: Some(rate) });
            let correction = learner.step(|offset| at(tick + offset).0[0], measured, Parts::BOTH, Parts::BOTH);
            prop_assert!(correction.abs() <= LIMITS.correction, "{correction} at {tick}");
            prop_assert!((correction - before).abs() <= 1.001 * LIMITS.rate / 100.0, "{before}, {correction} at {tick}");
            before = correction;
        }
        let Learned { preview, feedback } = learner.learned();
        prop_assert!(preview.iter().chain(&feedback).all(|value| value.is_finite()));
    }
}
