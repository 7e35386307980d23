//! Rotor speed to duty cycle of a Crazyflie's brushed motors.
//!
//! *in* fraction of the largest rotor speed; *out* share of the time in which the motor is driven; *never* outside of 0..=1, other than 0
//! for a motor that is off, or falling with a growing speed; *source* rpm = 0.2685 pwm + 4070.3, pwm of 16 bits: the constants
//! `PWM2RPM_SCALE` and `PWM2RPM_CONST` of gym-pybullet-drones (Panerati 2021), from the thrust measurements of Luis and Le Ny 2016.
//!
//! A battery that is not full turns the rotors slower: who flies fast compensates the voltage.

use crate::vehicle::CRAZYFLIE;

/// Revolutions a minute for a step of the duty cycle in 16 bits.
const SCALE: f32 = 0.2685;
/// Revolutions a minute that the line has at no duty cycle.
const OFFSET: f32 = 4_070.3;
/// Revolutions a minute at the largest rotor speed.
const FULL: f32 = CRAZYFLIE.airframe.max_rotor_speed * 60.0 / core::f32::consts::TAU;

/// The duty cycle for a fraction of the largest rotor speed; 0 also for NaN.
pub fn duty(fraction: f32) -> f32 {
    let share = (fraction * FULL - OFFSET) / (SCALE * 65_535.0);
    if share > 1.0 {
        1.0
    } else if share > 0.0 {
        share
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn duties_are_shares_that_grow_with_the_speed(bits in any::<u32>(), slower in -1.0f32..2.0, more in 0.0f32..2.0) {
            prop_assert!((0.0..=1.0).contains(&duty(f32::from_bits(bits))));
            prop_assert!(duty(slower) <= duty(slower + more));
        }
    }

    #[test]
    fn motors_that_are_off_get_nothing_and_a_hover_what_the_vehicle_measured() {
        assert_eq!(duty(0.0), 0.0);
        assert_eq!(duty(1.0), 1.0);
        // 27 g hover at 14,475 rpm with gym-pybullet-drones' k_F, which its controller commands by 38,750 of 65,535.
        let share = duty(14_475.0 / FULL);
        assert!((share - 38_750.0 / 65_535.0).abs() < 1e-3, "{share}");
    }
}
