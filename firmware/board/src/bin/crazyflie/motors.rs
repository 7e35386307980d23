//! The motors of a Crazyflie 2.x: M1 PA1, M2 PB11, M3 PA15, M4 PB9, 328 kHz in 256 steps, as `motors.c` of Bitcraze's firmware
//! drives them.

use impromptu_board::motor::duty;
use impromptu_flight::types::MotorCommand;
use stm32f4xx_hal::{
    gpio::{Debugger, PA1, PA15, PB9, PB11},
    pac::{TIM2, TIM4},
    prelude::*,
    rcc::Rcc,
    timer::PwmChannel,
};

/// 84 MHz in 256 steps.
const PWM_HZ: u32 = 84_000_000 / 256;

/// Four duty cycles.
pub(crate) struct Motors {
    m1: PwmChannel<TIM2, 1>,
    m2: PwmChannel<TIM2, 3>,
    m3: PwmChannel<TIM2, 0>,
    m4: PwmChannel<TIM4, 3>,
}

impl Motors {
    /// Motors off.
    pub(crate) fn new(timers: (TIM2, TIM4), pins: (PA1, PB11, PA15<Debugger>, PB9), rcc: &mut Rcc) -> Self {
        let (_, (first, second, _, fourth)) = timers.0.pwm_hz(PWM_HZ.Hz(), rcc);
        let (_, (.., other)) = timers.1.pwm_hz(PWM_HZ.Hz(), rcc);
        // Until now a pin of the debugger.
        let third = pins.2.into_pull_down_input();
        let mut motors = Self { m1: second.with(pins.0), m2: fourth.with(pins.1), m3: first.with(third), m4: other.with(pins.3) };
        motors.drive(&MotorCommand::OFF);
        motors.m1.enable();
        motors.m2.enable();
        motors.m3.enable();
        motors.m4.enable();
        motors
    }

    pub(crate) fn drive(&mut self, command: &MotorCommand) {
        let full = f32::from(self.m1.get_max_duty());
        let [m1, m2, m3, m4] = command.fractions().map(|fraction| (duty(fraction) * full) as u16);
        self.m1.set_duty(m1);
        self.m2.set_duty(m2);
        self.m3.set_duty(m3);
        self.m4.set_duty(m4);
    }
}
