//! What an add-on must survive: its calls in any order, at any tick, with any number.
//!
//! *in* bytes that say which calls; *out* how many references were corrected; *never* a panic, a reference that is no finite
//! number, one further from the desired one than the application and the model allow, or a correction that changes by more than
//! its slew: that is what the fuzz target and the test on stable Rust look for.
//!
//! Beside the add-on stands another one that is told the same, but whose lanes stay off: its reference is the desired one.

use std::sync::LazyLock;

use impromptu_firmware::{
    AddOn, Cap, Caps, GuardSettings, Inference, Job, Lanes, Model, Scratch, SumCap,
    model::{Channels, file},
};

use crate::bytes::Bytes;

/// Channels of each signal of the golden models.
const CHANNELS: usize = 2;
/// As many samples as the models look at, and some of the past.
const PREVIEW: usize = 64;
/// Rate of the models' references, Hz.
const RATE: f32 = 100.0;
/// Bounds that are wider than the models'.
const WIDE: [Cap; CHANNELS] = [Cap { limit: 10.0, rate: 1e4 }; CHANNELS];
/// What the bounds may be exceeded by, as a share of them.
const SLACK: f32 = 2e-5;
/// What a reference may be rounded by, as a share of it.
const ROUNDING: f32 = 2.4e-7;

/// The add-on of a cart.
type Cart = AddOn<'static, CHANNELS, CHANNELS, CHANNELS, PREVIEW>;

/// The bytes of a model where a model reads them fast.
#[repr(C, align(16))]
struct Aligned<const N: usize>([u8; N]);

static INT8: Aligned<964> = Aligned(*include_bytes!("../golden/models/int8-lane.model"));
static FLOAT: Aligned<1360> = Aligned(*include_bytes!("../golden/models/float-skip.model"));
const _: () = assert!(align_of::<Aligned<1>>() == file::ALIGNMENT);

/// The golden models: one with everything, one with a network alone.
static MODELS: LazyLock<[Model<'static>; 2]> = LazyLock::new(|| {
    let load = |bytes| Model::from_bytes(bytes).unwrap_or_else(|refusal| panic!("a golden model is refused: {refusal}"));
    [load(&INT8.0), load(&FLOAT.0)]
});

/// What the correction of a channel may be, and how it was.
#[derive(Clone, Copy, Default)]
struct Bound {
    limit: f32,
    slew: f32,
    /// Difference of the last reference to the desired one,
    last: f32,
    /// and how exactly that is known.
    rounding: f32,
}

impl Bound {
    /// Other bounds: unless there is no correction, what is left goes by its slew, whichever of the two holds by then.
    fn replace(&mut self, limit: f32, slew: f32, clean: bool) {
        self.slew = if clean { slew } else { self.slew.max(slew) };
        self.limit = limit;
    }

    /// Judges a reference beside the desired one; whether it is another one.
    fn judge(&mut self, reference: f32, desired: f32) -> bool {
        assert!(reference.is_finite() && desired.is_finite(), "{reference} where {desired} is desired");
        let correction = reference - desired;
        let rounding = ROUNDING * (reference.abs().max(desired.abs()) + self.last.abs());
        let most = (1.0 + SLACK) * self.limit.max(self.last.abs()) + self.rounding + rounding;
        assert!(correction.abs() <= most, "{reference} where {desired} is desired: more than {most}");
        let change = (1.0 + SLACK) * self.slew + self.rounding + rounding;
        assert!((correction - self.last).abs() <= change, "from {} to {correction}: more than {change}", self.last);
        (self.last, self.rounding) = (correction, rounding);
        correction != 0.0
    }
}

/// An add-on, and the other one.
struct Pair {
    corrected: Cart,
    plain: Cart,
    bounds: [Bound; CHANNELS],
    jobs: [Job; 2],
    released: bool,
    tick: i32,
    scratch: Scratch,
    changed: usize,
}

/// Makes calls as the bytes say; gives how many references were corrected.
pub fn survive(bytes: &[u8]) -> usize {
    let mut bytes = Bytes(bytes);
    let mut pair = Pair {
        corrected: Cart::empty(),
        plain: Cart::empty(),
        bounds: [Bound::default(); CHANNELS],
        jobs: [Job::EMPTY, Job::EMPTY],
        released: false,
        tick: 0,
        scratch: Scratch::new(),
        changed: 0,
    };
    let model = &MODELS[usize::from(bytes.choice(2))];
    assert!(pair.load(model, RATE, &Caps { channels: &WIDE, sums: &[] }), "the golden models are taken");
    while !bytes.is_empty() {
        pair.call(&mut bytes);
    }
    pair.changed
}

impl Pair {
    /// Tells both the same; they must answer the same.
    fn both<T: PartialEq + std::fmt::Debug>(&mut self, call: impl Fn(&mut Cart) -> T) -> T {
        let (answer, other) = (call(&mut self.corrected), call(&mut self.plain));
        assert_eq!(answer, other);
        answer
    }

    /// One call, or some that belong together.
    fn call(&mut self, bytes: &mut Bytes<'_>) {
        match bytes.choice(24) {
            // A good tick, which most calls must be, or the lanes never come.
            0..=5 => {
                self.tick = self.tick.wrapping_add(1);
                self.follow(bytes);
            }
            6 => {
                self.tick = bytes.tick(self.tick);
                self.follow(bytes);
            }
            7 => {
                let (tick, measured) = (bytes.tick(self.tick), bytes.numbers());
                self.begin(tick, &measured);
            }
            8 => {
                let (tick, measured) = (bytes.tick(self.tick), bytes.numbers());
                self.finish(tick, &measured);
            }
            9 => self.run(),
            10 => {
                let inference = Inference { tick: bytes.tick(self.tick), outputs: bytes.numbers() };
                self.both(|add_on| add_on.deliver(inference.clone()));
            }
            11 | 12 => self.push(bytes.numbers()),
            13 => (0..bytes.byte()).for_each(|_| self.push([0.5; CHANNELS])),
            14 => {
                let from = bytes.tick(self.corrected.next_tick());
                self.both(|add_on| add_on.truncate(from));
            }
            15 => {
                let first = bytes.tick(self.tick);
                self.both(|add_on| add_on.clear(first));
            }
            16 => {
                let first = bytes.tick(self.tick);
                self.both(|add_on| add_on.restart(first));
            }
            17 => {
                let first = bytes.tick(self.tick);
                self.both(|add_on| add_on.reset(first));
                // For a loop at rest: what was corrected is gone at once.
                self.bounds.iter_mut().for_each(|bound| (bound.last, bound.rounding) = (0.0, 0.0));
            }
            18 | 19 => {
                let lanes = bytes.byte();
                self.corrected.switch(Lanes { network: lanes & 1 == 0, feedback: lanes & 2 == 0 });
            }
            20 => self.both(Cart::rearm),
            21 => {
                let [age, standing] = [(); 2].map(|()| u16::from(bytes.byte()).saturating_sub(0xf0) * 0x1111);
                self.both(|add_on| {
                    add_on.set_age(age);
                    add_on.parts().0.set_standing(standing);
                });
            }
            22 => match bytes.choice(4) {
                0 => self.both(Cart::defer),
                1 => self.both(|add_on| add_on.set_guard(GuardSettings::OFF)),
                2 => self.both(|add_on| add_on.set_guard(GuardSettings::default())),
                _ => {
                    let signals = &MODELS[0].card().signals;
                    assert!(self.both(|add_on| add_on.bypass(signals)).is_ok(), "the models' own signals are taken");
                    self.released = false;
                }
            },
            _ => self.reload(bytes),
        }
    }

    /// Another model, or the same, within bounds that may be impossible.
    fn reload(&mut self, bytes: &mut Bytes<'_>) {
        let model = &MODELS[usize::from(bytes.choice(2))];
        let rate = if bytes.choice(8) == 0 { bytes.number() } else { RATE };
        let caps = [(); CHANNELS].map(|()| Cap { limit: bytes.number(), rate: RATE * bytes.number() });
        let channels = if bytes.choice(16) == 0 { &caps[1..] } else { &caps };
        let sum =
            SumCap { first: (bytes.choice(3), bytes.number()), second: (bytes.choice(3), bytes.number()), limit: bytes.number() };
        let sums = [sum; 5];
        let sums = &sums[..usize::from(bytes.choice(6)).min(sums.len())];
        self.load(model, rate, &Caps { channels, sums });
    }

    /// Whether a model was taken; if not, nothing has changed.
    fn load(&mut self, model: &'static Model<'static>, rate: f32, caps: &Caps<'_>) -> bool {
        let before = self.corrected.report();
        let clean = self.corrected.model().is_some() && before.correction.iter().all(|value| *value == 0.0);
        let signals = Channels::from(&model.card().signals);
        if !self.both(|add_on| add_on.load(model, signals, rate, caps).is_ok()) {
            assert_eq!(before, self.corrected.report());
            return false;
        }
        for output in &model.card().outputs {
            let channel = usize::from(output.channel);
            let cap = caps.channels[channel];
            self.bounds[channel].replace(output.limit.min(cap.limit), output.slew.min(cap.rate / RATE), clean);
        }
        self.released = false;
        true
    }

    /// A tick with as much of a trajectory as the models look at, and the vehicle near it.
    fn follow(&mut self, bytes: &mut Bytes<'_>) {
        let ahead = MODELS[0].card().preview_span().1 as i32;
        if self.corrected.next_tick().wrapping_sub(self.tick) < 0 && bytes.choice(2) == 0 {
            let tick = self.tick;
            self.both(|add_on| add_on.clear(tick));
        }
        for _ in 0..=ahead {
            if self.corrected.next_tick().wrapping_sub(self.tick) > ahead || !self.push_next(bytes) {
                break;
            }
        }
        let [position, speed] = self.corrected.desired(self.tick);
        let measured = match bytes.choice(8) {
            0 => bytes.numbers(),
            _ => [position, speed].map(|desired| desired + 0.01 * f32::from(bytes.byte())),
        };
        let tick = self.tick;
        self.begin(tick, &measured);
        if bytes.choice(16) != 0 {
            self.run();
        }
        self.finish(tick, &measured);
    }

    /// A sample of a slow trajectory; whether it was taken.
    fn push_next(&mut self, bytes: &mut Bytes<'_>) -> bool {
        let speed = f32::from(bytes.byte()) / 255.0;
        let [position, _] = self.corrected.desired(self.corrected.next_tick());
        self.both(|add_on| add_on.push([position + speed / RATE, speed])).is_ok()
    }

    fn push(&mut self, desired: [f32; CHANNELS]) {
        let next = self.corrected.next_tick();
        let taken = self.both(|add_on| add_on.push(desired)).is_ok();
        assert_eq!(self.corrected.next_tick(), next.wrapping_add(i32::from(taken)));
        assert!(!taken || desired.iter().all(|number| number.is_finite()));
    }

    /// The jobs of the two differ, as the references of the past do.
    fn begin(&mut self, tick: i32, measured: &[f32; CHANNELS]) {
        let [job, _] = &mut self.jobs;
        self.released |= self.corrected.begin_into(tick, measured, job);
        let [_, job] = &mut self.jobs;
        self.plain.begin_into(tick, measured, job);
    }

    /// What a task of lower priority does.
    fn run(&mut self) {
        let Some(network) = self.corrected.model().and_then(Model::network).filter(|_| self.released) else { return };
        self.corrected.deliver(self.jobs[0].run(network, &mut self.scratch));
        self.released = false;
    }

    fn finish(&mut self, tick: i32, measured: &[f32; CHANNELS]) {
        let (reference, desired) = (self.corrected.finish(tick, measured), self.plain.finish(tick, measured));
        if self.corrected.has_trajectory() {
            assert_eq!(desired.map(f32::to_bits), self.corrected.desired(tick).map(f32::to_bits), "lanes that are off");
        }
        let mut changed = false;
        for ((bound, reference), desired) in self.bounds.iter_mut().zip(reference).zip(desired) {
            changed |= bound.judge(reference, desired);
        }
        self.changed += usize::from(changed);
        let report = self.corrected.report();
        let weights = [report.network_weight, report.feedback_weight];
        assert!(weights.iter().all(|weight| (0.0..=1.0).contains(weight)), "{report:?}");
        assert!(report.correction.iter().all(|value| value.is_finite()), "{report:?}");
    }
}
