//! A servo with the add-on as tasks of RTIC: 20 s along a trajectory by the loop alone, then 20 s with the add-on.
//!
//! - in: the model, in the program's flash; the angle, here of a simulated servo
//! - out: the motor's reference, here to the simulated servo; one line of JSON on standard output: errors in degrees, RMS and
//!   largest
//! - never: a control tick that waits for the network. It touches no clocks or pins, so that it runs on the emulated board as it
//!   is
//!
//! | task | bound to | priority | |
//! |---|---|---|---|
//! | `control` | SysTick, 500 Hz | 2 | measures, asks the add-on for the reference, drives the motor |
//! | `inference` | an unused vector | 1 | evaluates the network |
//!
//! `cargo run -p impromptu-example-rtic --target thumbv7em-none-eabihf --profile firmware` (needs qemu-system-arm).
#![cfg_attr(target_os = "none", no_std, no_main)]
// RTIC hands a job back that it cannot take.
#![allow(clippy::result_large_err)]

#[cfg(target_os = "none")]
#[path = "../../../../examples/one_axis/servo.rs"]
mod servo;

#[cfg(target_os = "none")]
#[rtic::app(device = stm32f4::stm32f405, peripherals = true, dispatchers = [CRYP])]
mod app {
    use cortex_m::peripheral::syst::SystClkSource;
    use impromptu_firmware::{
        AddOn,
        adapter::{Job, Lanes},
        model::Model,
        network::Scratch,
    };
    use static_cell::ConstStaticCell;

    use crate::servo::{CAPS, RATE_HZ, SIGNALS, Servo, TrackingError, desired};

    static FILE: &[u8] = include_bytes!("../../../../examples/one_axis.impromptu");
    /// Clock of the core, Hz.
    const CORE_HZ: u32 = 168_000_000;
    /// Ticks of a flight.
    const TICKS: i32 = 20 * RATE_HZ as i32;

    #[shared]
    struct Shared {
        add_on: &'static mut AddOn<'static, 1, 1, 1, 128>,
    }

    #[local]
    struct Local {
        model: Option<&'static Model<'static>>,
        scratch: &'static mut Scratch,
        servo: Servo,
        tick: i32,
        /// How far ahead the trajectory is pushed.
        ahead: i32,
        error: TrackingError,
        /// Of the loop alone, once it is known.
        alone: Option<[f32; 2]>,
    }

    #[init]
    fn init(cx: init::Context) -> (Shared, Local) {
        static MODEL: ConstStaticCell<Model<'static>> = ConstStaticCell::new(Model::EMPTY);
        static ADD_ON: ConstStaticCell<AddOn<'static, 1, 1, 1, 128>> = ConstStaticCell::new(AddOn::empty());
        static SCRATCH: ConstStaticCell<Scratch> = ConstStaticCell::new(Scratch::new());
        let (add_on, scratch) = (ADD_ON.take(), SCRATCH.take());
        let model = Model::load_into(MODEL.take(), FILE, scratch);
        let model = model.and_then(|model| add_on.load(model, SIGNALS, RATE_HZ, &CAPS).map(|()| model));
        let model = match model {
            Ok(model) => Some(model),
            Err(refusal) => {
                // Without a model the loop goes on as it was. The signals are whole.
                semihosting::eprintln!("no add-on: {refusal}");
                let _ = add_on.bypass(SIGNALS);
                None
            }
        };
        add_on.defer();
        let ahead = model.map_or(0, |model| model.card().preview_span().1 as i32);

        let mut timer = cx.core.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(CORE_HZ / RATE_HZ as u32 - 1);
        timer.clear_current();
        timer.enable_counter();
        timer.enable_interrupt();
        let (servo, error) = (Servo::new(), TrackingError::new());
        (Shared { add_on }, Local { model, scratch, servo, tick: 0, ahead, error, alone: None })
    }

    #[idle]
    fn idle(_: idle::Context) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }

    #[task(binds = SysTick, priority = 2, local = [servo, tick, ahead, error, alone], shared = [add_on])]
    fn control(mut cx: control::Context) {
        let control::LocalResources { servo, tick, ahead, error, alone, .. } = cx.local;
        let measured = [servo.angle()];
        let ([reference], job) = cx.shared.add_on.lock(|add_on| {
            while add_on.next_tick() <= *tick + *ahead {
                // It is finite.
                let _ = add_on.push([desired(add_on.next_tick())]);
            }
            let job = add_on.begin(*tick, &measured);
            (add_on.finish(*tick, &measured), job)
        });
        error.add(servo.angle(), desired(*tick));
        servo.track(reference);
        if let Some(job) = job {
            // One that comes while the last one is still being done is dropped, and counted as late.
            let _ = inference::spawn(job);
        }
        *tick += 1;
        if *tick < TICKS {
            return;
        }
        match alone {
            None => {
                *alone = Some(error.degrees());
                (*servo, *tick, *error) = (Servo::new(), 0, TrackingError::new());
                cx.shared.add_on.lock(|add_on| {
                    add_on.reset(0);
                    add_on.switch(Lanes::BOTH);
                });
            }
            Some(alone) => {
                let (with, late) = (error.degrees(), cx.shared.add_on.lock(|add_on| add_on.report().late));
                semihosting::println!("{{\"alone\": {alone:?}, \"with\": {with:?}, \"late\": {late}}}");
                semihosting::process::exit(0)
            }
        }
    }

    #[task(priority = 1, local = [model, scratch], shared = [add_on])]
    async fn inference(mut cx: inference::Context, job: Job) {
        if let Some(network) = cx.local.model.and_then(Model::network) {
            let inference = job.run(network, cx.local.scratch);
            cx.shared.add_on.lock(|add_on| add_on.deliver(inference));
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("this program is for the emulated board; add --target thumbv7em-none-eabihf --profile firmware");
    std::process::ExitCode::FAILURE
}
