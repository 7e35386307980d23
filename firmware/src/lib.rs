//! Everything that flies: a learned add-on for control loops, and the quadrotor loop that is its first user.
//!
//! ```text
//! desired trajectory ──► features ──► network lane (sub-rate, interpolated) ──┐
//!       (preview)           ▲                                                 ├─► correction ─► adapted reference ─► baseline loop ─► motors
//!                           │   ┌─► feedback lane (every reference tick) ─────┘    (bounded)      (every tick)            ▲
//!                           └───┴──────────────────── measured state ─────────────────────────────────────────────────────┘
//! ```
//!
//! `no_std`, no heap, no unsafe code but in the Cortex-M4 kernels, no clock: time is an argument. SI units; world frame ENU (z up), body frame FLU, Hamilton quaternion
//! body to world, f32. The same bits on the host and on a Cortex-M4F. Errors exist where bytes enter
//! ([`model::Model::from_bytes`], [`storage`]); in flight nothing returns a `Result`.
//!
//! # A whole use
//!
//! A servo's position loop runs at 500 Hz and lags behind; the model was trained on its logs. [`AddOn`] comes between the trajectory
//! and the loop. In a static, without a model, with the network in another task: see there, and `examples/`.
//!
//! ```
//! use impromptu_firmware::AddOn;
//! use impromptu_firmware::adapter::Lanes;
//! use impromptu_firmware::model::{Channel, Channels, Model};
//! use impromptu_firmware::network::Scratch;
//! use impromptu_firmware::preview::EndRule;
//!
//! // What the loop is told, measures, and tracks. A model for anything else is refused.
//! const ANGLE: Channel = Channel { name: "angle", unit: "rad", frame: "output shaft", end: EndRule::Hold };
//! const SIGNALS: Channels = Channels { desired: &[ANGLE], measured: &[ANGLE], reference: &[ANGLE] };
//!
//! let model = Model::from_bytes(include_bytes!("../examples/one_axis.impromptu"))?;
//! let ahead = model.card().preview_span().1 as i32;
//! let mut add_on = AddOn::<1, 1, 1, 128>::new(&model, SIGNALS, 500.0)?;
//! let mut scratch = Scratch::new();
//! add_on.switch(Lanes::BOTH);
//! # use impromptu_firmware::math::sin_cos;
//! # fn desired(tick: i32) -> f32 { 0.8 - 0.8 * sin_cos(0.006 * tick as f32).1 }
//! # #[derive(Default)] struct Servo { angle: f32, speed: f32, error: f32 }
//! # impl Servo {
//! #     fn angle(&self) -> f32 { self.angle }
//! #     fn track(&mut self, reference: f32) {
//! #         self.speed += 0.002 * (500.0 * (reference - self.angle) - 35.0 * self.speed);
//! #         self.angle += 0.002 * self.speed;
//! #     }
//! # }
//! # let mut servo = Servo::default();
//! for tick in 0..5_000 {
//!     // The trajectory, ahead of time.
//!     while add_on.next_tick() <= tick + ahead {
//!         add_on.push([desired(add_on.next_tick())])?;
//!     }
//! #   servo.error = servo.error.max((servo.angle() - desired(tick)).abs());
//!     let [reference] = add_on.step(tick, &[servo.angle()], &mut scratch);
//!     servo.track(reference);
//! }
//! # assert!(servo.error < 0.1, "{}", servo.error);
//! assert_eq!(add_on.report().trips.by_lane(), [0, 0]);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
#![cfg_attr(not(test), no_std)]
// Tests may compare with the standard library.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod math;
pub mod preview;

pub mod features;

pub mod model;

pub mod network;

pub mod feedback;

pub mod guard;

pub mod adapter;

pub mod add_on;

pub mod region;

pub mod exchange;

pub mod storage;

pub use add_on::AddOn;
