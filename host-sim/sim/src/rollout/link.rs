//! The way from the position part of a loop to its attitude part, on which commands may take a while.
//!
//! *in* a command, now and then; *out* the newest that has arrived; *never* one before its time, but that of the first tick;
//! *source* a position loop off board.

use std::collections::VecDeque;

use impromptu_flight::types::Tick;

/// Commands on their way.
pub(super) struct Link<T> {
    /// Control ticks that a command takes.
    delay: u32,
    /// With the control tick at which they are due.
    on_the_way: VecDeque<(u32, T)>,
    arrived: T,
}

impl<T> Link<T> {
    /// A link of `delay` control ticks at whose end something is already.
    pub(super) fn new(delay: u32, arrived: T) -> Self {
        Self { delay, on_the_way: VecDeque::new(), arrived }
    }

    /// Sends a command. That of the first tick is there at once.
    pub(super) fn send(&mut self, tick: Tick, command: T)
    where
        T: Copy,
    {
        if tick.0 == 0 {
            self.arrived = command;
        }
        self.on_the_way.push_back((tick.0.wrapping_add(self.delay), command));
    }

    /// The newest command that has arrived.
    pub(super) fn receive(&mut self, tick: Tick) -> &T {
        while self.on_the_way.front().is_some_and(|(due, _)| *due <= tick.0)
            && let Some((_, command)) = self.on_the_way.pop_front()
        {
            self.arrived = command;
        }
        &self.arrived
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_arrives_when_it_is_due_and_the_first_at_once() {
        let mut link = Link::new(3, -1);
        let mut arrived = Vec::new();
        for tick in 0..10 {
            if tick % 2 == 0 {
                link.send(Tick(tick), tick as i32);
            }
            arrived.push(*link.receive(Tick(tick)));
        }
        assert_eq!(arrived, [0, 0, 0, 0, 0, 2, 2, 4, 4, 6]);
    }
}
