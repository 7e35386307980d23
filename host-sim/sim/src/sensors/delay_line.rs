//! A transport delay of whole ticks, for measurements on their way in and commands on their way out.

/// Values come out a fixed number of ticks after they went in; until then, the first one that went in.
#[derive(Debug, Clone)]
pub struct DelayLine<T> {
    ticks: usize,
    /// The last `ticks` values in a ring; empty until the first value.
    ring: Vec<T>,
    /// Where the oldest value is.
    oldest: usize,
}

/// A delay longer than a [`DelayLine`] holds.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("a delay of {ticks} ticks is longer than the {limit} that are allowed; check its unit and the tick length")]
pub struct DelayError {
    /// The delay that was asked for.
    pub ticks: usize,
    /// The longest delay.
    pub limit: usize,
}

impl<T: Clone> DelayLine<T> {
    /// The longest delay, in ticks: 8 s at 500 Hz, far beyond any loop that still flies.
    pub const LIMIT: usize = 4096;

    /// A delay of that many ticks; 0 passes everything through.
    ///
    /// # Errors
    /// A delay above [`DelayLine::LIMIT`].
    pub fn new(ticks: usize) -> Result<Self, DelayError> {
        if ticks > Self::LIMIT {
            return Err(DelayError { ticks, limit: Self::LIMIT });
        }
        Ok(Self { ticks, ring: Vec::with_capacity(ticks), oldest: 0 })
    }

    /// The delay, in ticks.
    pub fn ticks(&self) -> usize {
        self.ticks
    }

    /// One tick: `value` goes in, and the value of `ticks` calls ago comes out.
    #[inline]
    pub fn push(&mut self, value: T) -> T {
        if self.ring.is_empty() {
            self.ring.resize(self.ticks, value.clone());
        }
        let Some(slot) = self.ring.get_mut(self.oldest) else {
            return value;
        };
        self.oldest += 1;
        if self.oldest == self.ticks {
            self.oldest = 0;
        }
        std::mem::replace(slot, value)
    }

    /// Forgets everything, as for a new flight.
    pub fn clear(&mut self) {
        self.ring.clear();
        self.oldest = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_out_after_the_delay_and_the_first_one_before() {
        for ticks in [0, 1, 12] {
            let mut line = DelayLine::new(ticks).unwrap();
            for tick in 0..100_usize {
                assert_eq!(line.push(tick), tick.saturating_sub(ticks));
            }
            line.clear();
            assert_eq!(line.push(7), 7);
        }
    }

    #[test]
    fn endless_delays_are_refused() {
        let limit = DelayLine::<f64>::LIMIT;
        assert!(DelayLine::<f64>::new(limit).is_ok());
        let message = DelayLine::<f64>::new(limit + 1).unwrap_err().to_string();
        assert!(message.contains("4097 ticks"), "{message}");
    }
}
