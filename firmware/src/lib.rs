//! A learned add-on for any control loop: it corrects the references of a loop that is stable without it.
//!
//! ```text
//! desired ──► preview ──► features ──► network lane (sub-rate, ramped) ──┐
//! trajectory     │           ▲                                           ├─► guard ─► limits, slew ─► reference ─► any loop
//!                └─► errors ─┼─► feedback lane (every reference tick) ───┘    ▲            │                          │
//!                      ▲     │                                                └─ observes ─┘                          │
//!                      └─────┴───────────────────── measured state ◄──────────────────────────────────────────────────┘
//! ```
//!
//! `no_std`, no heap, no unsafe code but in the Cortex-M4 kernels, no clock: time is an argument. SI units, f32; which channels
//! there are, and in which frames, says the model. The same bits on the host and on a Cortex-M4F. Errors exist where bytes enter
//! ([`Model::from_bytes`](model::Model::from_bytes), [`storage`]); in flight nothing returns a `Result`.
//!
//! # A whole use
//!
//! A servo's position loop runs at 500 Hz and lags behind; the model was trained on its logs. [`AddOn`] comes between the
//! trajectory and the loop. In a static, without a model, with the network in another task: see there, and `examples/`.
//!
//! ```
//! use impromptu_firmware::{AddOn, Cap, Caps, Channel, Channels, EndRule, Lanes, Model, Scratch};
//!
//! // What the loop is told, measures, and tracks. A model for anything else is refused.
//! const ANGLE: Channel = Channel { name: "angle", unit: "rad", frame: "output shaft", end: EndRule::Hold };
//! const SIGNALS: Channels = Channels { desired: &[ANGLE], measured: &[ANGLE], reference: &[ANGLE] };
//! // What corrections may be, whatever a model says: rad, rad/s.
//! const CAPS: Caps = Caps { channels: &[Cap { limit: 0.5, rate: 20.0 }], sums: &[] };
//!
//! let model = Model::from_bytes(include_bytes!("../examples/one_axis.impromptu"))?;
//! let ahead = model.card().preview_span().1 as i32;
//! let mut add_on = AddOn::<1, 1, 1, 128>::new(&model, SIGNALS, 500.0, &CAPS)?;
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
//!
//! # Layers
//!
//! At the bottom stand functions and values that know nothing of a model. On them stands what is stored of one: bytes and types.
//! Each part of a model that is evaluated (features, network, feedback lane, the loop's response by which the guard judges)
//! stands on the format alone, and the checked model on all of them. The adapter runs a model before a loop: in each reference
//! tick it evaluates what is due, shows the guard one observation, and adds what the guard allows within limits and slew. What is
//! above may use what is below, never the other way round:
//!
//! | layer | modules | what they hold |
//! |--:|---|---|
//! | 1 | `math` | elementary functions with the same bits on every machine |
//! | 1 | `lanes` | which of the two lanes act |
//! | 1 | `exchange` | hand-over between tasks without a lock: newest value, queue of bytes |
//! | 2 | `format` | a model file: its bytes, the types that they become, why one is refused |
//! | 2 | `region` | which of several modules acts, by operating region |
//! | 3 | `learning` | parts of a correction that are learned while the loop runs |
//! | 3 | `caps` | bounds of the correction that the application sets |
//! | 3 | `preview` | the desired trajectory around the present |
//! | 3 | `features` | network inputs, evaluated from the list in the model |
//! | 3 | `network` | the network lane's map, with its kernels |
//! | 3 | `feedback` | the feedback lane's map and its memory |
//! | 4 | `guard` | which lanes may act: inputs, limits, and what the error would be without a lane |
//! | 5 | `model` | a model file whose every index, shape and probe has been checked |
//! | 6 | `adapter` | the add-on: lanes, guard and bounds between the desired trajectory and a loop |
//! | 7 | `add_on` | the adapter with the trajectory ahead of it, for one loop: what most applications use |
//! | 8 | `divided` | an add-on at a fraction of the rate of a fast loop, its correction ramped between |
//! | 6 | `storage` | models in flash, replaced without a new program |
//!
//! # Words
//!
//! - `reset` forgets what was seen: the next tick is the first one. Settings, models, the lanes wanted and counts stay.
//! - `restart` does that, and sets counts to zero and lanes off: as just loaded or configured.
//! - `clear` empties one buffer.
//!
//! A lane that comes or goes is ramped by its weight (bumpless transfer); in the code that is a *fade*. *Refusal* is why a model
//! is not flown, [`StorageError`](storage::StorageError) why it is not stored.
#![cfg_attr(not(test), no_std)]
// Tests may compare with the standard library.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod adapter;
pub mod add_on;
pub mod caps;
pub mod divided;
pub mod exchange;
pub mod features;
pub mod feedback;
pub mod format;
pub mod guard;
pub mod lanes;
pub mod learning;
pub mod math;
pub mod model;
pub mod network;
pub mod preview;
pub mod region;
pub mod storage;

pub use adapter::{Adapter, Inference, Job};
pub use add_on::AddOn;
pub use caps::{Cap, Caps, SumCap};
pub use divided::Divided;
pub use format::{Channel, Channels, EndRule, Refusal};
pub use guard::{GuardSettings, Trip, Trips};
pub use lanes::Lanes;
pub use model::Model;
pub use network::Scratch;
pub use preview::Preview;
