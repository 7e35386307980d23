//! The desired trajectory of a flight.
//!
//! *in* setpoints, one for each reference tick, ahead of time; *out* the setpoint of any tick; *never* one pushed out that is
//! still to be flown or looked back at; *source* [`impromptu_firmware::preview`].

use impromptu_firmware::learning::BEHIND;
use nalgebra::Vector3;

use super::{Flight, PREVIEW};
use crate::{quadrotor, types::Setpoint};

impl Flight<'_> {
    /// Appends the desired state of the next reference tick; `false`, and nothing changes, if no vehicle can be asked for it
    /// ([`Setpoint::is_physical`]), or if it would push out one that is still to be flown or that the model will look back at:
    /// the next one is still that of the same tick.
    pub fn push_setpoint(&mut self, setpoint: &Setpoint) -> bool {
        if !setpoint.is_physical() {
            return false;
        }
        let sample = quadrotor::desired(setpoint);
        if self.stage.adapted {
            return self.add_on.push(sample).is_ok();
        }
        let flown = self.clock.reference.wrapping_sub(1);
        let (_, preview) = self.add_on.parts();
        let room = !preview.is_ahead_full(Some(flown), 0);
        if room {
            preview.push(sample);
        }
        room
    }

    /// How many setpoints can be stored from the one that is flown next on, so that what a model or a learner looks back at
    /// stays.
    pub fn room(&self) -> i32 {
        PREVIEW as i32 - self.add_on.behind().max(BEHIND + 1)
    }

    /// Reference tick of the next [`Flight::push_setpoint`].
    pub fn next_setpoint(&self) -> i32 {
        self.add_on.next_tick()
    }

    /// Forgets the desired trajectory: the next setpoint is that of this reference tick.
    pub fn clear_setpoints(&mut self, tick: i32) {
        self.add_on.clear(tick);
    }

    /// The desired state at a reference tick; beyond the trajectory's ends at rest there.
    pub fn setpoint(&self, tick: i32) -> Setpoint {
        let [px, py, pz, vx, vy, vz, ax, ay, az, yaw] = self.add_on.desired(tick);
        let vector = Vector3::new;
        Setpoint { position: vector(px, py, pz), velocity: vector(vx, vy, vz), acceleration: vector(ax, ay, az), yaw }
    }

    /// Forgets the desired trajectory from a reference tick on, of which the next setpoint then is. What is before it stays.
    pub fn replace_setpoints(&mut self, from: i32) {
        self.add_on.truncate(from);
    }
}
