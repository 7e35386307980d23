//! The emulated board: QEMU's `netduinoplus2`, an STM32F405, flies in real time, and the plant is a peripheral that the host simulates.
//!
//! - in: `model.impromptu` in the folder where the emulator was started, if it is there; the link's bytes
//! - out: the link's bytes
//! - never: touches clocks or pins. QEMU's RCC reads 0, so waiting for a crystal would never end
//!
//! | task | bound to | priority | |
//! |---|---|---|---|
//! | `control` | SysTick, 500 Hz | 3 | hears the link, flies a tick, answers |
//! | `receive` | USART1 | 4 | queues the bytes of the serial port |
//! | `inference` | an unused vector | 1 | evaluates the network, which may take until the next reference tick |
//!
//! Tasks share nothing but the lock-free [`impromptu_firmware::exchange`].
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod instruments;
#[cfg(target_os = "none")]
mod port;
#[cfg(target_os = "none")]
mod start;

#[cfg(target_os = "none")]
#[rtic::app(device = stm32f4::stm32f405, peripherals = true)]
mod app {
    use core::sync::atomic::{AtomicU32, Ordering};

    use cortex_m::peripheral::SCB;
    use impromptu_firmware::{
        adapter::{Inference, Job},
        application::Application,
        autopilot::Meters,
        exchange::{ByteRing, Mailbox},
        model::{MAX_FEATURES, MAX_OUTPUTS},
        network::{Network, Scratch},
    };
    use stm32f4::stm32f405::{Interrupt, TIM2, TIM5, USART1};

    use crate::{
        instruments::{self, Counter},
        port::{self, Lockstep},
        start,
    };

    /// Jobs for the network, and what came of them.
    static JOBS: Mailbox<MAX_FEATURES> = Mailbox::new();
    static INFERENCES: Mailbox<MAX_OUTPUTS> = Mailbox::new();
    /// Bytes from the serial port.
    static RECEIVED: ByteRing<2048> = ByteRing::new();
    /// Instructions of the control task so far, which interrupt the inference; the largest inference without them.
    static CONTROL_TOTAL: AtomicU32 = AtomicU32::new(0);
    static INFERENCE_MAX: AtomicU32 = AtomicU32::new(0);
    /// Bytes of the stack that were ever used.
    static STACK: AtomicU32 = AtomicU32::new(0);

    #[shared]
    struct Shared {
        serial: USART1,
    }

    #[local]
    struct Local {
        application: &'static mut Application<'static>,
        lockstep: Option<Lockstep>,
        meters: Meters,
        counter: Counter<TIM2>,
        network: Option<&'static Network<'static>>,
        scratch: Scratch,
        inference_counter: Counter<TIM5>,
    }

    #[init]
    fn init(cx: init::Context) -> (Shared, Local) {
        let (application, network) = start::application();
        instruments::paint_stack();
        let lockstep = Lockstep::open();
        let counter = Counter::new(cx.device.TIM2);
        let inference_counter = Counter::new(cx.device.TIM5);
        if lockstep.is_some() {
            instruments::start_tick(cx.core.SYST);
        } else {
            port::start_serial(&cx.device.USART1);
        }
        let meters = Meters::default();
        let local = Local { application, lockstep, meters, counter, network, scratch: Scratch::new(), inference_counter };
        (Shared { serial: cx.device.USART1 }, local)
    }

    #[idle]
    fn idle(_: idle::Context) -> ! {
        loop {
            // It takes far longer than a control tick of a slow emulator: not each time.
            for _ in 0..1_000 {
                cortex_m::asm::wfi();
            }
            STACK.store(instruments::stack_high_water(), Ordering::Relaxed);
        }
    }

    #[task(binds = SysTick, priority = 3, local = [application, lockstep, meters, counter], shared = [serial])]
    fn control(mut cx: control::Context) {
        let control::LocalResources { application, lockstep, meters, counter, .. } = cx.local;
        let mut cost = 0;
        let flying = application.autopilot().armed();
        let mut hear = |bytes: &[u8]| {
            let ((), instructions) = counter.measure(|| {
                for byte in bytes {
                    // There is no flash to write to here.
                    let _ = application.hear(*byte);
                }
            });
            cost += instructions;
        };
        let due = match lockstep {
            Some(lockstep) => {
                meters.entry_latency_max = meters.entry_latency_max.max(counter.since_tick());
                lockstep.hear(hear);
                true
            }
            None => {
                while let Some(byte) = RECEIVED.take() {
                    hear(&[byte]);
                }
                application.informed()
            }
        };
        if due {
            let (job, instructions) = counter.measure(|| {
                if let Some((tick, outputs)) = INFERENCES.take_floats() {
                    application.deliver(Inference { tick: tick as i32, outputs });
                }
                let (_, job) = application.step(meters);
                if let Some(Job { tick, inputs }) = &job {
                    JOBS.put_floats(*tick as u32, inputs);
                }
                job.is_some()
            });
            if job {
                rtic::pend(Interrupt::DCMI);
            }
            cost += instructions;
            // Before and after a flight, trajectories and settings are uploaded in a tick.
            if flying && application.autopilot().armed() {
                meters.control_max = meters.control_max.max(cost);
            }
            meters.inference_max = INFERENCE_MAX.load(Ordering::Relaxed);
            meters.stack_bytes = STACK.load(Ordering::Relaxed);
        }
        match lockstep {
            Some(lockstep) => {
                // The next tick is due, and this one is not done.
                meters.deadline_misses += u32::from(SCB::is_pendst_pending());
                lockstep.say(application.outbox());
            }
            None => cx.shared.serial.lock(|serial| port::write_serial(serial, application.outbox())),
        }
        application.sent();
        CONTROL_TOTAL.fetch_add(cost, Ordering::Relaxed);
    }

    #[task(binds = DCMI, priority = 1, local = [network, scratch, inference_counter])]
    fn inference(cx: inference::Context) {
        let inference::LocalResources { network, scratch, inference_counter: counter, .. } = cx.local;
        if let (Some(network), Some((tick, inputs))) = (network, JOBS.take_floats()) {
            let interrupted = CONTROL_TOTAL.load(Ordering::Relaxed);
            let ((), instructions) = counter.measure(|| {
                let Inference { tick, outputs } = Job { tick: tick as i32, inputs }.run(network, scratch);
                INFERENCES.put_floats(tick as u32, &outputs);
            });
            let interrupted = CONTROL_TOTAL.load(Ordering::Relaxed).wrapping_sub(interrupted);
            INFERENCE_MAX.fetch_max(instructions.saturating_sub(interrupted), Ordering::Relaxed);
        }
    }

    #[task(binds = USART1, priority = 4, shared = [serial])]
    fn receive(mut cx: receive::Context) {
        // A zero ends a frame.
        if cx.shared.serial.lock(|serial| port::read_serial(serial, &RECEIVED)) == Some(0) {
            SCB::set_pendst();
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("this program is for the emulated board; fly it with `host-sim fly --pil`");
    std::process::ExitCode::FAILURE
}
