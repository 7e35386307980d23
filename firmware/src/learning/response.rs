//! What a loop makes of a correction of its reference.
//!
//! *in* gain, natural frequency, damping and delay, guessed or measured; *out* a recursive filter; *never* an unstable one;
//! *source* zero-order-hold discretisation of a second-order system (Åström and Wittenmark 1997, Table 2.1).

use super::ring::Ring;
use crate::math::finite_or_zero;

/// Most ticks of delay.
pub(super) const MAX_DELAY: usize = 32;
/// Words of a response that is kept.
pub(super) const RESPONSE_WORDS: usize = 6;

/// A second-order response behind a delay: the measured output at a tick is `gains . (u(t-1-delay), u(t-2-delay))` less
/// `poles . (y(t-1), y(t-2))`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    gains: [f32; 2],
    poles: [f32; 2],
    delay: usize,
    /// Of the natural frequency, rad a tick.
    turn: f32,
}

impl Response {
    /// Of a system with this gain at rest, natural frequency, rad/s, damping ratio, and delay, s, sampled at a rate, Hz. `None`
    /// if it is not stable, if it is too fast or too slow for the rate (0.001 to 1 rad a tick), or if the delay is longer than
    /// 32 ticks.
    pub fn second_order(gain: f32, frequency: f32, damping: f32, delay_s: f32, rate_hz: f32) -> Option<Self> {
        let turn = frequency / rate_hz;
        let delay = delay_s * rate_hz;
        let known = (1e-3..=1.0).contains(&turn) && (0.05..=5.0).contains(&damping) && (0.0..=MAX_DELAY as f32).contains(&delay);
        if !(known && gain.abs() > 0.0 && gain.abs() < 1e6) {
            return None;
        }
        let decay = libm::expf(-damping * turn);
        let square = damping * damping;
        // cos and sin / (sqrt(1 - d²)) of the damped turn; cosh and sinh beyond critical damping.
        let (even, odd) = if square < 1.0 {
            let root = libm::sqrtf((1.0 - square).max(1e-6));
            (libm::cosf(root * turn), libm::sinf(root * turn) / root)
        } else {
            let root = libm::sqrtf((square - 1.0).max(1e-6));
            (libm::coshf(root * turn), libm::sinhf(root * turn) / root)
        };
        let first = gain * (1.0 - decay * (even + damping * odd));
        let second = gain * (decay * decay + decay * (damping * odd - even));
        let poles = [-2.0 * decay * even, decay * decay];
        Some(Self { gains: [first, second], poles, delay: libm::roundf(delay) as usize, turn })
    }

    /// The same with so many times the gain.
    #[must_use]
    pub fn amplified(self, gain: f32) -> Self {
        Self { gains: self.gains.map(|own| gain * own), ..self }
    }

    /// Change of the output at rest after a correction of 1.
    pub fn gain(&self) -> f32 {
        let [first, second] = self.gains;
        (first + second) / (1.0 + self.poles[0] + self.poles[1])
    }

    /// Ticks by which a slow correction is answered late: the mean of the impulse response.
    pub fn lag(&self) -> f32 {
        let ([first, second], [newer, older]) = (self.gains, self.poles);
        let late = (first + 2.0 * second) / (first + second) - (newer + 2.0 * older) / (1.0 + newer + older);
        self.delay as f32 + late
    }

    /// Natural frequency, rad a tick.
    pub fn turn(&self) -> f32 {
        self.turn
    }

    /// Natural frequency, rad/s, damping ratio, and delay, s, at this rate, Hz.
    pub(super) fn second_order_of(&self, rate_hz: f32) -> [f32; 3] {
        let damping = -0.5 * libm::logf(self.poles[1]) / self.turn;
        [self.turn * rate_hz, damping, self.delay as f32 / rate_hz]
    }

    /// Ticks of delay.
    pub fn delay(&self) -> usize {
        self.delay
    }

    /// As words, to be kept.
    pub(super) fn words(&self) -> [u32; RESPONSE_WORDS] {
        let [first, second] = self.gains.map(f32::to_bits);
        let [newer, older] = self.poles.map(f32::to_bits);
        [first, second, newer, older, self.delay as u32, self.turn.to_bits()]
    }

    /// From [`Response::words`]; `None` if it is no stable response that a loop can have.
    pub(super) fn from_words(words: [u32; RESPONSE_WORDS]) -> Option<Self> {
        let [first, second, newer, older, delay, turn] = words;
        let [gains, poles] = [[first, second], [newer, older]].map(|pair| pair.map(f32::from_bits));
        let found = Self { gains, poles, delay: delay as usize, turn: f32::from_bits(turn) };
        let [a1, a2] = poles;
        // Both poles within the unit circle (Jury), written so that NaN is not.
        let stable = a2.abs() < 1.0 && a1.abs() < 1.0 + a2;
        let known = (1e-3..=1.0).contains(&found.turn) && found.delay <= MAX_DELAY;
        let gain = found.gain().abs();
        (stable && known && gain > 0.0 && gain < 1e6 && gains.iter().all(|gain| gain.abs() < 1e6)).then_some(found)
    }
}

/// A signal behind a [`Response`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Filter {
    input: f32,
    outputs: [f32; 2],
}

impl Filter {
    /// Always been at 0.
    pub(super) const NONE: Self = Self { input: 0.0, outputs: [0.0; 2] };

    /// As if the input had been this for long.
    pub fn at_rest(response: &Response, input: f32) -> Self {
        Self { input, outputs: [response.gain() * input; 2] }
    }

    /// The output at a tick; `input` is the one of `1 + delay` ticks before.
    pub fn step(&mut self, response: &Response, input: f32) -> f32 {
        let [newer, older] = self.outputs;
        let output =
            response.gains[0] * input + response.gains[1] * self.input - response.poles[0] * newer - response.poles[1] * older;
        (self.input, self.outputs) = (input, [finite_or_zero(output), newer]);
        self.outputs[0]
    }

    /// Change from one tick to the next.
    pub fn change(&self) -> f32 {
        self.outputs[0] - self.outputs[1]
    }
}

/// What the loop makes of a correction.
#[derive(Clone, Debug)]
pub(super) struct Answer {
    pub(super) inputs: Ring<{ MAX_DELAY + 1 }>,
    pub(super) filter: Filter,
}

impl Answer {
    pub(super) fn new() -> Self {
        Self { inputs: Ring::filled(0.0), filter: Filter::default() }
    }

    /// As if the correction had been this for long.
    pub(super) fn at_rest(response: &Response, correction: f32) -> Self {
        Self { inputs: Ring::filled(correction), filter: Filter::at_rest(response, correction) }
    }

    /// At a tick, before its correction is known.
    pub(super) fn at(&mut self, response: &Response) -> f32 {
        self.filter.step(response, self.inputs.past(response.delay()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_answers_a_step_as_the_system_does() {
        for damping in [0.3f32, 0.7, 1.0, 2.0] {
            let response = Response::second_order(1.1, 8.0, damping, 0.03, 100.0).unwrap();
            let mut filter = Filter::default();
            // The same system in small steps.
            let (mut x, mut v) = (0.0f64, 0.0f64);
            for tick in 0..300 {
                // The reference steps at tick 0; the output sees it one tick and the delay later.
                let output = filter.step(&response, f32::from(u8::from(tick >= 4)));
                assert!((f64::from(output) - x).abs() < 2e-3, "{damping}: {output} {x} at {tick}");
                for _ in 0..100 {
                    let input = if tick >= 3 { 1.1 } else { 0.0 };
                    v += 1e-4 * (64.0 * (input - x) - 2.0 * f64::from(damping) * 8.0 * v);
                    x += 1e-4 * v;
                }
            }
            assert!((response.gain() - 1.1).abs() < 1e-3);
            assert_eq!(response.delay(), 3);
        }
    }

    #[test]
    fn what_no_loop_has_is_refused() {
        for (gain, frequency, damping, delay) in [
            (0.0, 8.0, 0.7, 0.0),
            (f32::NAN, 8.0, 0.7, 0.0),
            (1.0, 800.0, 0.7, 0.0),
            (1.0, f32::INFINITY, 0.7, 0.0),
            (1.0, 8.0, -0.1, 0.0),
            (1.0, 8.0, 0.7, 1.0),
            (1.0, 8.0, 0.7, -0.1),
        ] {
            assert_eq!(Response::second_order(gain, frequency, damping, delay, 100.0), None);
        }
    }
}
