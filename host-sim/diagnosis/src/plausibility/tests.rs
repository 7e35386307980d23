use super::*;
use proptest::prelude::*;

/// A loop that follows two tones, 50 rows a second.
fn columns(rows: usize) -> Columns {
    let tones = |t: f64| (1.3 * t).sin() + 0.5 * (4.1 * t).sin();
    let time: Vec<f64> = (0..rows).map(|row| row as f64 * 0.02).collect();
    Columns {
        lines: (2..rows as u64 + 2).collect(),
        reference: time.iter().map(|t| tones(*t)).collect(),
        measured: time.iter().map(|t| tones(*t - 0.3)).collect(),
        time,
        rate: None,
        desired: None,
        others: Vec::new(),
        decimal: true,
    }
}

fn read(columns: Columns) -> Result<(Columns, Vec<String>), Implausible> {
    plausible(columns, "time_s", &Reading::default())
}

#[test]
fn a_good_log_stays_as_it_is() {
    assert_eq!(read(columns(500)).unwrap(), (columns(500), Vec::new()));
}

#[test]
fn whole_numbers_of_time_are_asked_about_unless_only_one_unit_is_possible() {
    let counted = |step: f64, decimal: bool| {
        let good = columns(400);
        Columns { time: (0..400).map(|row| 1e6 + step * f64::from(row)).collect(), decimal, ..good }
    };
    for step in [1.0, 20.0, 2e4, 2e7] {
        let refusal = read(counted(step, false)).expect_err("ambiguous");
        assert!(refusal.leaves_open() && refusal.to_string().contains("--time-unit"), "{refusal}");
        // With a decimal point it is s.
        assert_eq!(read(counted(step, true)).unwrap().0.time[1], 1e6 + step);
    }
    let stated = Reading { time_unit: Some(TimeUnit::Milliseconds), ..Reading::default() };
    assert!((plausible(counted(20.0, false), "t", &stated).unwrap().0.time[1] - 0.02).abs() < 1e-12);
    let (found, notes) = plausible(counted(2e4, false), "timestamp", &Reading::default()).unwrap();
    assert!((found.time[1] - 0.02).abs() < 1e-12 && notes[0].contains("microseconds"), "{notes:?}");
}

#[test]
fn rows_that_repeat_are_left_out_and_two_values_at_one_time_refused() {
    let mut twice = columns(300);
    for values in [&mut twice.time, &mut twice.reference, &mut twice.measured] {
        values.insert(10, values[10]);
    }
    twice.lines.push(302);
    let (found, notes) = read(twice.clone()).unwrap();
    assert_eq!((found.time, found.measured), (columns(300).time, columns(300).measured));
    assert!(notes[0].contains("1 row(s)") && notes[0].contains("line 13"), "{notes:?}");
    twice.measured[11] += 0.1;
    assert!(read(twice).expect_err("two values").to_string().starts_with("line 13: the same time"));
}

#[test]
fn what_goes_against_the_reference_and_what_is_the_reference_are_asked_about() {
    let good = columns(600);
    let flipped = Columns { measured: good.measured.iter().map(|y| -y).collect(), ..good.clone() };
    let refusal = read(flipped.clone()).expect_err("flipped");
    assert!(refusal.leaves_open() && refusal.to_string().contains("--negate-measured"), "{refusal}");
    let stated = Reading { negated: true, ..Reading::default() };
    assert_eq!(plausible(flipped, "time_s", &stated).unwrap().0, good);
    let same = Columns { measured: good.reference.clone(), ..good };
    assert_eq!(read(same), Err(Implausible::Same));
}

#[test]
fn many_wild_samples_are_refused() {
    let mut wild = columns(500);
    wild.measured[100..110].fill(500.0);
    assert!(read(wild).expect_err("ten in a row").to_string().starts_with("line 102 and 9 more"));
}

proptest! {
    /// Single wild samples anywhere, of any size: the log is the one without them but for a line between neighbours.
    #[test]
    fn single_wild_samples_are_replaced(rows in prop::collection::btree_set(1usize..250, 1..5), size in 30f64..1e6) {
        let mut wild = columns(1000);
        for row in &rows {
            wild.measured[4 * row] = if row % 2 == 0 { size } else { -size };
        }
        let (found, notes) = read(wild).unwrap();
        for (found, good) in found.measured.iter().zip(columns(1000).measured) {
            prop_assert!((found - good).abs() < 0.01, "{found} {good}");
        }
        prop_assert!(notes.len() == 1 && notes[0].contains(&format!("{} sample(s)", rows.len())), "{notes:?}");
    }

    /// An angle in degrees or rad, from -half a turn or from 0 on: unwrapped it is what it was but for whole turns.
    #[test]
    fn an_angle_is_unwrapped(
        degrees in any::<bool>(), signed in any::<bool>(), start in 0f64..1.0, size in 0.3f64..1.0, late in 0f64..0.4
    ) {
        let turn = if degrees { 360.0 } else { TAU };
        let wrapped = |angle: f64| {
            let angle = angle.rem_euclid(turn);
            if signed && angle > 0.5 * turn { angle - turn } else { angle }
        };
        let angle = |t: f64| turn * (start + size * (0.7 * t).sin());
        let good = columns(2000);
        let of = |late: f64| good.time.iter().map(|t| wrapped(angle(t - late))).collect::<Vec<_>>();
        let (reference, measured) = (of(0.0), of(late + 0.01));
        let wraps = measured.windows(2).any(|pair| (pair[1] - pair[0]).abs() > 0.5 * turn);
        prop_assume!(wraps);
        let (found, _) = read(Columns { reference, measured, ..good.clone() }).unwrap();
        for (row, t) in good.time.iter().enumerate() {
            let error = angle(*t) - angle(t - late - 0.01);
            prop_assert!((found.reference[row] - found.measured[row] - error).abs() < 1e-6 * turn);
        }
    }

    /// Whatever the numbers are: columns of one length, or a refusal.
    #[test]
    fn any_numbers_are_read_or_refused(
        rows in prop::collection::vec((-1e30f64..1e30, -1e30f64..1e30, -1e30f64..1e30), 0..80), decimal in any::<bool>()
    ) {
        let pick = |of: fn(&(f64, f64, f64)) -> f64| rows.iter().map(of).collect::<Vec<_>>();
        let columns = Columns {
            lines: (0..rows.len() as u64).collect(),
            time: pick(|row| row.0),
            reference: pick(|row| row.1),
            measured: pick(|row| row.2),
            rate: None,
            desired: None,
            others: Vec::new(),
            decimal,
        };
        if let Ok((found, _)) = read(columns) {
            prop_assert!(found.reference.len() == found.time.len() && found.measured.len() == found.time.len());
        }
    }
}

/// A flight with time on the ground before and after it: the set-points are 0 there, the vehicle stands where it stands.
fn with_ground(before: usize, after: usize) -> Columns {
    let mut all = columns(1500);
    all.reference.iter_mut().chain(&mut all.measured).for_each(|value| *value += 4.0);
    let [first, last] = [0.01, *all.measured.last().unwrap()];
    let padded = |values: &[f64], before_at: f64, after_at: f64| -> Vec<f64> {
        let ends = |at: f64, count: usize| std::iter::repeat_n(at, count);
        ends(before_at, before).chain(values.iter().copied()).chain(ends(after_at, after)).collect()
    };
    let rows = before + all.time.len() + after;
    Columns {
        lines: (2..rows as u64 + 2).collect(),
        time: (0..rows).map(|row| row as f64 * 0.02).collect(),
        reference: padded(&all.reference, 0.0, 0.0),
        measured: padded(&all.measured, first, last),
        rate: None,
        desired: None,
        others: Vec::new(),
        decimal: true,
    }
}

#[test]
fn time_on_the_ground_is_left_out_with_its_lines() {
    let (found, notes) = read(with_ground(300, 250)).unwrap();
    assert_eq!((found.measured.len(), found.lines[0], *found.lines.last().unwrap()), (1500, 302, 1801));
    assert!(notes[0].contains("300 rows up to line 301") && notes[1].contains("250 rows from line 1802 on"), "{notes:?}");
    // A loop at rest where it was told to be is no ground, whatever its gain.
    for gain in [1.0, 0.4] {
        let mut rest = columns(1500);
        let [u, y] = [rest.reference[1200], gain * rest.reference[1200]];
        rest.measured.iter_mut().for_each(|value| *value *= gain);
        rest.reference[1200..].fill(u);
        rest.measured[1220..].fill(y);
        let (found, notes) = read(rest).unwrap();
        assert!(found.measured.len() == 1500 && notes.is_empty(), "{gain}: {notes:?}");
    }
}

#[test]
fn another_unit_is_asked_about_unless_it_is_stated() {
    for (factor, named) in [(1000.0, "millimetres"), (0.001, "millimetres"), (57.2958, "degrees"), (0.01, "centimetres")] {
        let mut other = columns(600);
        other.measured.iter_mut().for_each(|value| *value *= factor);
        let refusal = read(other.clone()).expect_err("another unit");
        let said = refusal.to_string();
        assert!(refusal.leaves_open() && said.contains(named) && said.contains("--measured-scale"), "{said}");
        let stated = Reading { scale: Some(1.0 / factor), ..Reading::default() };
        let (found, _) = plausible(other.clone(), "t", &stated).unwrap();
        assert!(found.measured.iter().zip(columns(600).measured).all(|(a, b)| (a - b).abs() < 1e-9));
        let meant = Reading { scale: Some(1.0), ..Reading::default() };
        assert_eq!(plausible(other.clone(), "t", &meant).unwrap().0.measured, other.measured);
    }
}

proptest! {
    /// Jitter of a third of a row and a fifth of the rows lost: one rate, and the values of that time.
    #[test]
    fn uneven_rows_are_brought_to_one_rate(seed in 1u64..1000, lost in 0u64..20, late in 0.0f64..0.35) {
        let mut state = seed;
        let mut draw = |below: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % below
        };
        let tones = |t: f64| (1.3 * t).sin() + 0.5 * (4.1 * t).sin();
        let mut time = vec![0.0];
        time.extend((1..1500).filter_map(|row| {
            let jitter = late * (draw(1000) as f64 / 500.0 - 1.0);
            (draw(100) >= lost).then_some((f64::from(row) + jitter) * 0.02)
        }));
        let columns = Columns {
            lines: (2..time.len() as u64 + 2).collect(),
            reference: time.iter().map(|t| tones(*t)).collect(),
            measured: time.iter().map(|t| tones(*t - 0.3)).collect(),
            time,
            rate: None,
            desired: None,
            others: Vec::new(),
            decimal: true,
        };
        let (found, notes) = read(columns).unwrap();
        let steps: Vec<f64> = found.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if !notes.is_empty() {
            prop_assert!(notes[0].contains("brought to"), "{notes:?}");
            prop_assert!(steps.iter().all(|step| (step / 0.02 - 1.0).abs() < 0.12), "{:?}", steps[0]);
            for (time, value) in found.time.iter().zip(&found.measured) {
                prop_assert!((value - tones(time - 0.3)).abs() < 0.1, "{time} {value}");
            }
        }
    }
}
