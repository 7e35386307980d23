use super::*;

const HZ: f64 = 50.0;
const LOOP: SecondOrder = SecondOrder { gain: 1.0, frequency: 2.8, damping: 0.6, delay_s: 0.1 };

fn known(response: SecondOrder) -> Known {
    let SecondOrder { gain, frequency, damping, delay_s } = response;
    Known { gain: Some(gain), frequency: Some(frequency), damping: Some(damping), delay_s: Some(delay_s) }
}

/// Three tones that start from rest, m.
fn motion(seed: u32, seconds: usize) -> Vec<f64> {
    let tone = |number: u32| {
        let drawn = |salt: u32| f64::from((seed * 7 + number * 3 + salt).wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24);
        [0.1 + 0.25 * drawn(1), 0.2 + 0.3 * drawn(2), std::f64::consts::TAU * drawn(3)]
    };
    let tones = [0, 1, 2].map(tone);
    let at = |t: f64| tones.iter().map(|[hz, size, phase]| size * (std::f64::consts::TAU * hz * t + phase).sin()).sum::<f64>();
    let ramp = |t: f64| t.min(1.0).powi(2) * (3.0 - 2.0 * t.min(1.0));
    (0..seconds * HZ as usize).map(|tick| tick as f64 / HZ).map(|t| (at(t) - at(0.0)) * ramp(t)).collect()
}

/// What disturbs the loop at a tick of a flight, and its rate, m and m/s.
fn disturbance(seed: u32, tick: usize) -> [f64; 2] {
    let (turn, t) = (0.9 + 0.1 * f64::from(seed), tick as f64 / HZ);
    [0.02 * (turn * t).sin(), 0.02 * turn * (turn * t).cos()]
}

/// A flight of the linear loop with these corrections as they come: measured values and their rates.
fn flown(seed: u32, desired: &[f64], mut correct: impl FnMut(usize, f64, f64) -> f64) -> (Vec<f64>, Vec<f64>) {
    let response = LOOP.response(HZ).unwrap();
    let mut filter = Filter::default();
    let (mut inputs, mut measured, mut rates) = (Vec::new(), Vec::new(), Vec::new());
    for (tick, desired) in desired.iter().enumerate() {
        let input = tick.checked_sub(1 + response.delay()).map_or(0.0, |at| inputs[at]);
        let value = f64::from(filter.step(&response, input as f32));
        let [push, push_rate] = disturbance(seed, tick);
        measured.push(value + push);
        rates.push(f64::from(filter.change()) * HZ + push_rate);
        inputs.push(desired + correct(tick, measured[tick], rates[tick]));
    }
    (measured, rates)
}

fn flight(seed: u32, seconds: usize) -> Flight {
    let reference = motion(seed, seconds);
    let (measured, rate) = flown(seed, &reference, |_, _, _| 0.0);
    let track =
        Track { name: "x".into(), unit: "m", period_s: 1.0 / HZ, reference, measured, rate: Some(rate), notes: Vec::new() };
    Flight { name: format!("flight {seed}"), tracks: vec![track] }
}

#[test]
fn the_prediction_is_what_a_linear_loop_then_flies() {
    let flights: Vec<Flight> = (1..=4).map(|seed| flight(seed, 20)).collect();
    let replay = Replay::of(&flights, &known(LOOP)).unwrap();
    assert_eq!((replay.rate_hz, replay.misfit), (HZ, None));
    let bound = flights.iter().map(|flight| extent(&flight.tracks[0].reference)).fold(0.0, f64::max);
    let mut learner = Learner::new(LOOP.response(HZ).unwrap(), HZ as f32, 0.0, limits(bound)).unwrap();
    for (seed, (flight, predicted)) in (1..).zip(flights.iter().zip(&replay.flights)) {
        let desired = &flight.tracks[0].reference;
        let ticks = desired.len() - UNKNOWN;
        // The same flight with the corrections in force: by what came before, and learning on.
        let left = |mut learner: Learner, learn: Parts| {
            let at = |tick: i64| desired[tick.clamp(0, desired.len() as i64 - 1) as usize] as f32;
            learner.start(flight.tracks[0].measured[0] as f32);
            let (measured, _) = flown(seed, &desired[..ticks], |tick, value, rate| {
                let around = |offset: i32| match tick as i64 + i64::from(offset) {
                    before if before < 0 => flight.tracks[0].measured[0] as f32,
                    tick => at(tick),
                };
                let learn = if tick < UNKNOWN { Parts::NONE } else { learn };
                f64::from(learner.step(
                    around,
                    Some(Measured { value: value as f32, rate: Some(rate as f32) }),
                    learn,
                    Parts::BOTH,
                ))
            });
            let errors = measured.iter().zip(desired).skip(UNKNOWN).map(|(measured, desired)| (measured - desired).powi(2));
            (mean(errors).sqrt(), learner)
        };
        let (frozen, _) = left(learner.clone(), Parts::NONE);
        let (learning_on, taught) = left(learner, Parts::BOTH);
        learner = taught;
        for (flown, said) in [(frozen, predicted.predicted), (learning_on, predicted.learning_on)] {
            assert!((flown - said).abs() < 0.02 * said + 1e-5, "flight {seed}: flown {flown}, predicted {said}");
        }
    }
    let last = replay.flights.last().unwrap();
    assert!(last.reduction_percent > 80.0 && (replay.flights[0].reduction_percent).abs() < 1e-9, "{replay:#?}");
    assert!((last.learned_before_min - 3.0 * last.seconds / 60.0).abs() < 1e-9);
}

#[test]
fn what_is_predicted_for_a_flight_holds_nothing_of_it_or_of_later_ones() {
    let flights: Vec<Flight> = (1..=4).map(|seed| flight(seed, 20)).collect();
    let all = Replay::of(&flights, &known(LOOP)).unwrap();
    let some = Replay::of(&flights[..2], &known(LOOP)).unwrap();
    assert_eq!(all.flights[..2], some.flights);
    // The same errors at another place teach and leave the same.
    let mut moved = flights.clone();
    for track in moved.iter_mut().flat_map(|flight| &mut flight.tracks) {
        track.reference.iter_mut().chain(&mut track.measured).for_each(|value| *value += 2.0);
    }
    let moved = Replay::of(&moved, &known(LOOP)).unwrap();
    for (here, there) in all.flights.iter().zip(&moved.flights) {
        assert!((here.predicted - there.predicted).abs() < 0.03 * here.predicted, "{here:?} {there:?}");
    }
}

#[test]
fn the_response_is_found_from_the_first_logs_at_any_rate() {
    let flights: Vec<Flight> = (1..=3).map(|seed| flight(seed, 25)).collect();
    let slower = flights.iter().map(|flight| {
        let every = |values: &[f64]| values.iter().step_by(2).copied().collect::<Vec<_>>();
        let track = &flight.tracks[0];
        let track = Track {
            period_s: 2.0 / HZ,
            reference: every(&track.reference),
            measured: every(&track.measured),
            rate: None,
            ..track.clone()
        };
        Flight { name: flight.name.clone(), tracks: vec![track] }
    });
    for flights in [flights.clone(), slower.collect()] {
        let replay = Replay::of(&flights, &Known::default()).unwrap();
        let lag = replay.response.lag_s() / LOOP.lag_s();
        assert!((0.9..1.1).contains(&lag), "{:?}", replay.response);
        assert!(replay.misfit.unwrap() < 0.1 * replay.flights[1].recorded, "{replay:#?}");
        assert_eq!((replay.rate_hz.round(), replay.identified_from.len()), (HZ, 2));
        assert!(replay.flights[2].reduction_percent > 75.0, "{replay:#?}");
        // What is given stays.
        let given = Replay::of(&flights, &Known { damping: Some(1.0), ..Known::default() }).unwrap();
        assert_eq!(given.response.damping, 1.0);
    }
}

#[test]
fn what_cannot_be_replayed_is_named() {
    let good = flight(1, 20);
    let refused = |flights: &[Flight], known: Known| Replay::of(flights, &known).unwrap_err().to_string();
    assert!(refused(std::slice::from_ref(&good), known(LOOP)).contains("two sound flights"));
    let mut short = flight(2, 4);
    short.name = "short".into();
    assert!(refused(&[good.clone(), short], known(LOOP)).starts_with("short: 4.0 s are too short"));
    let mut still = good.clone();
    still.tracks[0].reference.iter_mut().for_each(|value| *value = 0.0);
    assert!(refused(&[still, good.clone()], Known::default()).contains("the reference does not move"));
    let mut other = good.clone();
    other.tracks[0].name = "y".into();
    assert!(refused(&[good.clone(), other], known(LOOP)).contains("its axes are y, those of the first log x"));
    let fast = known(SecondOrder { frequency: 200.0, delay_s: 0.0, ..LOOP });
    assert!(refused(&[good.clone(), good.clone()], fast).contains("cannot be followed in a log of 50.0 rows"));
    let faster = Known { frequency: Some(200.0), ..Known::default() };
    assert!(refused(&[good.clone(), good.clone()], faster).contains("no response can be found"));
    // A short log does not bend the response so that it is long enough.
    assert!(refused(&[good, flight(2, 2)], Known::default()).starts_with("flight 2: 2.0 s are too short"));
}
