//! A servo with the add-on as tasks of embassy: 20 s along a trajectory by the loop alone, then 20 s with the add-on.
//!
//! - in: the model, in the program's flash; the angle, here of a simulated servo
//! - out: the motor's reference, here to the simulated servo; one line of JSON on standard output: errors in degrees, RMS and
//!   largest
//! - never: clocks or pins, so that it runs on the emulated board as it is. SysTick wakes the control task; there is no time
//!   driver
//!
//! Tasks of one executor wait for each other: a control tick may be late by one evaluation of the network. A loop that cannot
//! bear that runs `control` in an `InterruptExecutor` of higher priority; nothing else changes.
//!
//! `cargo run -p impromptu-example-embassy --target thumbv7em-none-eabihf --profile firmware` (needs qemu-system-arm).
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../../../../examples/one_axis/servo.rs"]
mod servo;

#[cfg(target_os = "none")]
mod app {
    use cortex_m::{Peripherals, peripheral::syst::SystClkSource};
    use cortex_m_rt::exception;
    use embassy_executor::Spawner;
    use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, signal::Signal};
    use impromptu_firmware::{
        AddOn,
        adapter::{Inference, Job, Lanes},
        model::Model,
        network::{Network, Scratch},
    };
    use static_cell::ConstStaticCell;
    // The vector table of the microcontroller.
    use stm32f4 as _;

    use crate::servo::{CAPS, RATE_HZ, SIGNALS, Servo, TrackingError, desired};

    static FILE: &[u8] = include_bytes!("../../../../examples/one_axis.impromptu");
    /// Clock of the core, Hz.
    const CORE_HZ: u32 = 168_000_000;
    /// Ticks of a flight.
    const TICKS: i32 = 20 * RATE_HZ as i32;

    type ServoAddOn = AddOn<'static, 1, 1, 1, 128>;

    static TICK: Signal<CriticalSectionRawMutex, ()> = Signal::new();
    static JOB: Signal<CriticalSectionRawMutex, Job> = Signal::new();
    static INFERENCE: Signal<CriticalSectionRawMutex, Inference> = Signal::new();

    #[exception]
    fn SysTick() {
        TICK.signal(());
    }

    #[embassy_executor::main]
    async fn main(spawner: Spawner) {
        static MODEL: ConstStaticCell<Model<'static>> = ConstStaticCell::new(Model::EMPTY);
        static ADD_ON: ConstStaticCell<ServoAddOn> = ConstStaticCell::new(AddOn::empty());
        static SCRATCH: ConstStaticCell<Scratch> = ConstStaticCell::new(Scratch::new());
        let (add_on, scratch) = (ADD_ON.take(), SCRATCH.take());
        let model = Model::load_into(MODEL.take(), FILE, scratch);
        match model.and_then(|model| add_on.load(model, SIGNALS, RATE_HZ, &CAPS).map(|()| model)) {
            Ok(model) => {
                if let Some(network) = model.network()
                    && let Ok(task) = inference(network, scratch)
                {
                    spawner.spawn(task);
                }
            }
            Err(refusal) => {
                // Without a model the loop goes on as it was. The signals are whole.
                semihosting::eprintln!("no add-on: {refusal}");
                let _ = add_on.bypass(SIGNALS);
            }
        }
        if let Some(core) = Peripherals::take() {
            let mut timer = core.SYST;
            timer.set_clock_source(SystClkSource::Core);
            timer.set_reload(CORE_HZ / RATE_HZ as u32 - 1);
            timer.clear_current();
            timer.enable_counter();
            timer.enable_interrupt();
        }
        if let (Ok(control), Ok(idle)) = (control(add_on), idle()) {
            spawner.spawn(control);
            spawner.spawn(idle);
        }
    }

    /// Evaluates the network.
    #[embassy_executor::task]
    async fn inference(network: &'static Network<'static>, scratch: &'static mut Scratch) {
        loop {
            let job = JOB.wait().await;
            INFERENCE.signal(job.run(network, scratch));
        }
    }

    /// Without the add-on, then with it.
    #[embassy_executor::task]
    async fn control(add_on: &'static mut ServoAddOn) {
        add_on.defer();
        let alone = fly(add_on).await;
        add_on.reset(0);
        add_on.switch(Lanes::BOTH);
        let with = fly(add_on).await;
        let late = add_on.report().late;
        semihosting::println!("{{\"alone\": {alone:?}, \"with\": {with:?}, \"late\": {late}}}");
        semihosting::process::exit(0)
    }

    /// Follows the trajectory: at each tick it measures, asks the add-on for the reference, and drives the motor.
    async fn fly(add_on: &mut ServoAddOn) -> [f32; 2] {
        let ahead = add_on.model().map_or(0, |model| model.card().preview_span().1 as i32);
        let (mut servo, mut error) = (Servo::new(), TrackingError::new());
        for tick in 0..TICKS {
            while add_on.next_tick() <= tick + ahead {
                // It is finite.
                let _ = add_on.push([desired(add_on.next_tick())]);
            }
            TICK.wait().await;
            let measured = [servo.angle()];
            if let Some(inference) = INFERENCE.try_take() {
                add_on.deliver(inference);
            }
            if let Some(job) = add_on.begin(tick, &measured) {
                JOB.signal(job);
            }
            let [reference] = add_on.finish(tick, &measured);
            error.add(servo.angle(), desired(tick));
            servo.track(reference);
        }
        error.degrees()
    }

    /// Sleeps while there is nothing to do. A board does so in the executor, with WFE, at which the emulator does not stop.
    #[embassy_executor::task]
    async fn idle() {
        loop {
            cortex_m::interrupt::free(|_| {
                if !TICK.signaled() && !JOB.signaled() {
                    cortex_m::asm::wfi();
                }
            });
            embassy_futures::yield_now().await;
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("this program is for the emulated board; add --target thumbv7em-none-eabihf --profile firmware");
    std::process::ExitCode::FAILURE
}
