//! Days in the air: batteries that sag, rests, lost samples and glitches.

use impromptu_firmware::learning::{AxisSettings, LearningAddOn, Measured, Phase, Probe, Progress};

use super::{HZ, LIMITS, Servo, motion};

/// A cycle: motions of this time, then rest, s.
const MOTION: usize = 18;
const REST: usize = 12;
/// A battery lasts for so many cycles, in which the loop loses a fifth of its gain.
const BATTERY: usize = 16;

struct Day {
    servo: Servo,
    add_on: LearningAddOn<1>,
    tick: i32,
}

impl Day {
    /// Commissioned, in noise and disturbance.
    fn new() -> Self {
        let axis = AxisSettings { response: None, limits: LIMITS, probe: Probe { size: 0.2, seconds: 4.0 } };
        let mut add_on = LearningAddOn::new(&[axis], HZ as f32, 0.0).unwrap();
        add_on.commission();
        let mut day = Self { servo: Servo::new(1), add_on, tick: 0 };
        day.run(&[0.0; 20 * HZ], true);
        let Progress { phase, problem, .. } = day.add_on.progress();
        assert_eq!((phase, problem), (Phase::Learning, None));
        day
    }

    /// RMS error, rad, with one sample in a hundred lost and a glitch of a radian a minute.
    fn run(&mut self, desired: &[f64], corrected: bool) -> f64 {
        let (mut sum, start) = (0.0, self.tick);
        for goal in desired {
            sum += (self.servo.angle - goal).powi(2);
            let (angle, speed) = self.servo.measured();
            let glitch = if self.tick % (60 * HZ as i32) == 777 { 1.0 } else { 0.0 };
            let measured = Measured { value: angle + glitch, rate: Some(speed) };
            let measured = (self.tick % 100 != 50).then_some(measured);
            let around = |tick: i32| [desired[(tick - start).clamp(0, desired.len() as i32 - 1) as usize] as f32];
            let [correction] = self.add_on.step(self.tick, around, &[measured], true);
            self.servo.run(goal + if corrected { f64::from(correction) } else { 0.0 });
            self.tick += 1;
        }
        (sum / desired.len() as f64).sqrt()
    }

    /// Errors of each cycle's motion, with a battery that sags in the course of many.
    fn fly(&mut self, cycles: std::ops::Range<usize>) -> Vec<f64> {
        cycles
            .map(|cycle| {
                self.servo.strength = 1.0 - 0.2 * (cycle % BATTERY) as f64 / BATTERY as f64;
                let motion = motion(cycle as u64, MOTION);
                let error = self.run(&motion, true);
                // Back to where the next one begins, and rest.
                let last = motion.last().copied().unwrap_or(0.0);
                let back = |tick: usize| last * (1.0 - (tick as f64 / (4 * HZ) as f64).min(1.0));
                self.run(&(0..REST * HZ).map(back).collect::<Vec<_>>(), true);
                error
            })
            .collect()
    }
}

/// Cycles of an hour.
const HOUR: usize = 3600 / (MOTION + REST);

/// The error in the middle, of motions some of which ask for more than the servo's torque.
fn median(errors: &[f64]) -> f64 {
    let mut errors = errors.to_vec();
    errors.sort_by(f64::total_cmp);
    errors[errors.len() / 2]
}

/// So many hours: no drift from the second one on, nothing forgotten, tracking as after the first minute.
fn hours(count: usize) {
    let mut day = Day::new();
    let errors = day.fly(0..count * HOUR);
    let first = median(&errors[2..BATTERY]);
    let last = median(&errors[errors.len() - HOUR / 2..]);
    let settled = median(&errors[HOUR.min(errors.len() / 2)..][..HOUR / 2]);
    let lost = errors[BATTERY..].iter().filter(|error| **error > 0.02).count();
    let Progress { phase, forgotten, share, .. } = day.add_on.progress();
    println!(
        "{count} h: {first:.5} rad after the first minute, {settled:.5} settled, {last:.5} in the end; {lost} of {} above 0.02; \
         share {share:.2}",
        errors.len()
    );
    assert_eq!((phase, forgotten), (Phase::Learning, 0));
    assert!(last < 1.2 * first && last < 1.2 * settled && first < 0.02, "{first} {settled} {last}");
    assert!(lost <= errors.len() / 25, "{lost}");
    let learned = day.add_on.learned(0).unwrap();
    assert!(learned.preview.iter().chain(&learned.feedback).all(|weight| weight.abs() < 20.0), "{learned:?}");
}

#[test]
fn an_hour_with_batteries_rests_lost_samples_and_glitches() {
    hours(1);
}

#[test]
#[ignore = "long"]
fn long_a_day_with_batteries_rests_lost_samples_and_glitches() {
    hours(24);
}
