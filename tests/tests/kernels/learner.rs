//! A learner beside a loop gives the same bits on every core, and costs little.

use impromptu_firmware::learning::AHEAD;
use impromptu_tests::{
    mcu::counter,
    twins::{cases::Cases, cores::Core},
};

/// 12 s of a motion from rest, and a loop that is behind and disturbed.
const TICKS: usize = 1_200;

pub(crate) fn add(cases: &mut Cases) {
    let motion = |tick: f32| {
        let t = 0.01 * (tick - 100.0).max(0.0);
        0.6 * (1.0 - libm::cosf(1.7 * t)) + 0.2 * libm::sinf(0.9 * t)
    };
    let desired: Vec<f32> = (0..TICKS + AHEAD as usize).map(|tick| motion(tick as f32)).collect();
    let behind = |tick: usize| motion(tick as f32 - 22.0) + 0.01 * libm::sinf(0.37 * tick as f32);
    let rate = |tick: usize| 50.0 * (motion(tick as f32 - 21.0) - motion(tick as f32 - 23.0));
    let measured: Vec<[f32; 2]> = (0..TICKS).map(|tick| [behind(tick), rate(tick)]).collect();
    cases.learner("behind", &desired, &measured).unwrap();
}

/// The most that a tick of three axes executes on a Cortex-M4F, all in the control task, and what three of them hold.
#[test]
fn three_learners_take_at_most_15000_instructions_in_a_tick_and_10_kilobytes() {
    let plugin = counter::build().unwrap();
    let mut cases = Cases::default();
    add(&mut cases);
    let counts = tempfile::NamedTempFile::new().unwrap();
    let arguments = format!("{},out={}", plugin.display(), counts.path().display());
    Core::named("M4F").run(&cases, &["-plugin", &arguments]).unwrap();
    let (entries, _) = counter::read(counts.path()).unwrap();
    assert_eq!(entries.len(), TICKS);
    let most = entries.iter().map(|entry| entry.instructions).max().unwrap();
    let mean = entries.iter().map(|entry| entry.instructions).sum::<u64>() / TICKS as u64;
    let bytes = 3 * size_of::<impromptu_firmware::learning::Learner>();
    println!("three axes: {} instructions at most, {} in the mean, {bytes} bytes", 3 * most, 3 * mean);
    let told = format!("{} instructions at most in a tick", 3 * most);
    let readme = include_str!("../../../README.md").replace('\n', " ");
    assert!(readme.contains(&told) && readme.contains(&format!("{bytes} bytes")), "the README tells: {told}, {bytes} bytes");
    assert!(3 * most <= 15_000 && bytes <= 10 * 1024, "{most} an axis, {bytes} bytes");
}
