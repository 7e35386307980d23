//! A servo with friction: a DC motor behind a gear, and the position loop that drives it.
//!
//! *in* the reference of the loop at every tick, rad; *out* the angle that the encoder reads, rad; *never* a voltage above the
//! supply's; *source* a motor of first order in its speed, with Coulomb and static friction (Armstrong-Hélouvry 1991, Stribeck's
//! curve) in volts.

use impromptu_firmware::{
    Cap, Caps,
    math::{abs, clamp, sin_cos},
    model::{Channel, Channels},
    preview::EndRule,
};

/// Ticks of the loop, and of its reference, in a second.
pub(crate) const RATE_HZ: f32 = 500.0;

const ANGLE: Channel<'_> = Channel { name: "angle", unit: "rad", frame: "output shaft", end: EndRule::Hold };

/// What the loop is told, what it measures, and what it tracks.
pub(crate) const SIGNALS: Channels<'_> = Channels { desired: &[ANGLE], measured: &[ANGLE], reference: &[ANGLE] };

/// What corrections may be, whatever a model says: as much as takes the whole supply, across all of it in 25 ms.
pub(crate) const CAPS: Caps<'_> = Caps { channels: &[Cap { limit: SUPPLY / STIFFNESS, rate: 24.0 }], sums: &[] };

/// The loop: volts for a rad of error, and for a rad/s of speed.
const STIFFNESS: f32 = 20.0;
const DAMPING: f32 = 0.9;
/// The supply, V.
const SUPPLY: f32 = 12.0;
/// The motor: speed for a volt, rad/s, and the time in which it gets there, s.
const SPEED: f32 = 2.0;
const TIME: f32 = 0.08;
/// Friction of the moving shaft and of the resting one, V, and the speeds at which it has reversed and at which half of the
/// difference is gone, rad/s.
const MOVING: f32 = 0.6;
const RESTING: f32 = 0.9;
const REVERSED: f32 = 0.02;
const SLIDING: f32 = 0.3;
/// Steps of the motor's equations in a tick.
const STEPS: u8 = 4;

/// Motor and loop.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Servo {
    angle: f32,
    speed: f32,
}

impl Servo {
    /// At rest at zero.
    pub(crate) const fn new() -> Self {
        Self { angle: 0.0, speed: 0.0 }
    }

    /// The angle, rad.
    pub(crate) fn angle(&self) -> f32 {
        self.angle
    }

    /// One tick of the loop: the motor turns towards the reference, rad.
    pub(crate) fn track(&mut self, reference: f32) {
        let voltage = clamp(STIFFNESS * (reference - self.angle) - DAMPING * self.speed, -SUPPLY, SUPPLY);
        let dt = 1.0 / (RATE_HZ * f32::from(STEPS));
        for _ in 0..STEPS {
            let sliding = self.speed / SLIDING;
            let friction = MOVING + (RESTING - MOVING) / (1.0 + sliding * sliding);
            let friction = friction * clamp(self.speed / REVERSED, -1.0, 1.0);
            self.speed += dt * (SPEED * (voltage - friction) - self.speed) / TIME;
            self.angle += dt * self.speed;
        }
    }
}

/// Where the shaft shall be at a tick, rad: two tones that never repeat together, from rest.
pub(crate) fn desired(tick: i32) -> f32 {
    let time = tick as f32 / RATE_HZ;
    let start = clamp(time, 0.0, 1.0);
    start * start * (0.9 * sin_cos(2.1 * time).0 + 0.4 * sin_cos(5.3 * time + 1.0).0)
}

/// Adds up the tracking error.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TrackingError {
    sum: f32,
    count: f32,
    largest: f32,
}

impl TrackingError {
    /// Nothing yet.
    pub(crate) const fn new() -> Self {
        Self { sum: 0.0, count: 0.0, largest: 0.0 }
    }

    /// One tick: where the shaft is and where it shall be, rad.
    pub(crate) fn add(&mut self, angle: f32, desired: f32) {
        let error = abs(angle - desired);
        self.sum += error * error;
        self.count += 1.0;
        self.largest = if error > self.largest { error } else { self.largest };
    }

    /// Root of the mean square, and the largest, degrees.
    pub(crate) fn degrees(&self) -> [f32; 2] {
        [impromptu_firmware::math::sqrt(self.sum / clamp(self.count, 1.0, f32::MAX)), self.largest].map(f32::to_degrees)
    }
}
