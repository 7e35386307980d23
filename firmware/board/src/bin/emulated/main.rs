//! The emulated board: QEMU's `netduinoplus2`, an STM32F405, flies in real time, and the plant is a peripheral that the host
//! simulates.
//!
//! - in: the flash with its slots; the link's bytes
//! - out: the link's bytes; a slot that was written, as a file in the folder where the emulator was started
//! - never: touches clocks or pins. QEMU's RCC reads 0, so waiting for a crystal would never end
//!
//! | task | bound to | priority | |
//! |---|---|---|---|
//! | `control` | SysTick, 500 Hz | 3 | receives, flies a tick, answers |
//! | `receive` | USART1 | 4 | queues the bytes of the serial port |
//! | `inference` | an unused vector | 1 | evaluates the network, which may take until the next reference tick |
//! | `storage` | an unused vector | 1 | stores a piece of a model, or what was learned |
//!
//! Tasks share nothing but the lock-free [`impromptu_firmware::exchange`].
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod flash;
#[cfg(target_os = "none")]
mod instruments;
#[cfg(target_os = "none")]
mod port;

#[cfg(target_os = "none")]
#[rtic::app(device = stm32f4::stm32f405, peripherals = true)]
mod app {
    use core::sync::atomic::{AtomicBool, Ordering};

    use cortex_m::peripheral::SCB;
    use impromptu_board::{Cost as _, Keeping, Start, Tasks, slots, start};
    use impromptu_firmware::{
        exchange::ByteRing,
        network::{Network, Scratch},
        storage::{Journal, Uploader},
    };
    use impromptu_flight::{
        application::Application,
        autopilot::{FlightLearner, Meters},
        learning::KEPT,
    };
    use static_cell::ConstStaticCell;
    use stm32f4::stm32f405::{Interrupt, TIM2, TIM5, USART1};

    use crate::{
        flash::{FileSlot, LEARNED, SLOT},
        instruments::{self, Counter},
        port::{self, Lockstep},
    };

    static TASKS: Tasks = Tasks::new();
    static KEEPING: Keeping = Keeping::new();
    /// Whether the network has a job that it has not done.
    static INFERRING: AtomicBool = AtomicBool::new(false);
    /// Whether a tick of the serial port waits for it.
    static WAITING: AtomicBool = AtomicBool::new(false);
    /// Bytes from the serial port.
    static RECEIVED: ByteRing<2048> = ByteRing::new();

    #[shared]
    struct Shared {
        /// Of tasks of one priority.
        #[lock_free]
        scratch: &'static mut Scratch,
        serial: USART1,
    }

    #[local]
    struct Local {
        application: &'static mut Application<'static, FlightLearner>,
        lockstep: Option<Lockstep>,
        meters: Meters,
        counter: Counter<TIM2>,
        network: Option<&'static Network<'static>>,
        inference_counter: Counter<TIM5>,
        uploader: Uploader<FileSlot<SLOT>>,
        journal: Journal<FileSlot<LEARNED>, KEPT>,
    }

    #[init]
    fn init(cx: init::Context) -> (Shared, Local) {
        instruments::paint_stack();
        static APPLICATION: ConstStaticCell<Application<'static, FlightLearner>> =
            ConstStaticCell::new(Application::with(FlightLearner::new()));
        let started = start(APPLICATION.take(), slots::slots(), slots::learned());
        let Some(Start { application, network, spare, sequence, scratch }) = started else { semihosting::process::exit(1) };
        let uploader = Uploader::new(FileSlot::spare(spare), sequence);
        let journal = Journal::new(FileSlot::learned(slots::learned()));
        let lockstep = Lockstep::open();
        let counter = Counter::new(cx.device.TIM2);
        let inference_counter = Counter::new(cx.device.TIM5);
        if lockstep.is_some() {
            instruments::start_tick(cx.core.SYST);
        } else {
            port::start_serial(&cx.device.USART1);
        }
        let meters = Meters::default();
        let local = Local { application, lockstep, meters, counter, network, inference_counter, uploader, journal };
        (Shared { scratch, serial: cx.device.USART1 }, local)
    }

    #[idle]
    fn idle(_: idle::Context) -> ! {
        loop {
            // It takes far longer than a control tick of a slow emulator: not each time.
            for _ in 0..1_000 {
                // Between two of these marks the cycle model counts: a control tick, and what it leaves to be inferred.
                cortex_m::asm::sev();
                cortex_m::asm::wfi();
                cortex_m::asm::sev();
            }
            TASKS.report_stack(instruments::stack_high_water());
        }
    }

    #[task(binds = SysTick, priority = 3, local = [application, lockstep, meters, counter], shared = [serial])]
    fn control(mut cx: control::Context) {
        let control::LocalResources { application, lockstep, meters, counter, .. } = cx.local;
        // Whole trajectories are uploaded in a tick before a flight.
        let flying = application.autopilot().in_flight();
        let mut received = 0;
        let mut on_bytes = |bytes: &[u8]| {
            let (piece, instructions) = counter.measure(|| TASKS.on_bytes(application, bytes));
            if piece {
                rtic::pend(Interrupt::CRYP);
            }
            received += instructions;
        };
        let due = match lockstep {
            Some(lockstep) => {
                let entry = counter.since_tick();
                if flying {
                    meters.entry_latency_max = meters.entry_latency_max.max(entry);
                }
                lockstep.receive(on_bytes);
                true
            }
            None => {
                let mut bytes = [0; 32];
                loop {
                    match RECEIVED.take_some(&mut bytes) {
                        [] => break,
                        bytes => on_bytes(bytes),
                    }
                }
                // No clock says when the next tick is due, so a busy host may leave the network no time at all: it gets what it
                // needs. An upload comes without news of the attitude.
                let inferring = INFERRING.load(Ordering::Relaxed);
                WAITING.store(inferring, Ordering::Relaxed);
                !inferring && (application.informed() || !application.autopilot().armed())
            }
        };
        if due && TASKS.fly(application, meters, counter, received).job {
            INFERRING.store(true, Ordering::Relaxed);
            rtic::pend(Interrupt::DCMI);
        }
        if TASKS.keep(application, &KEEPING) {
            rtic::pend(Interrupt::CRYP);
        }
        match lockstep {
            Some(lockstep) => {
                // The next tick is due, and this one is not done.
                meters.deadline_misses += u32::from(application.autopilot().in_flight() && SCB::is_pendst_pending());
                lockstep.send(application.outbox());
            }
            None => cx.shared.serial.lock(|serial| port::write_serial(serial, application.outbox())),
        }
        application.sent();
    }

    #[task(binds = DCMI, priority = 1, local = [network, inference_counter], shared = [scratch])]
    fn inference(cx: inference::Context) {
        TASKS.infer(*cx.local.network, cx.shared.scratch, cx.local.inference_counter);
        INFERRING.store(false, Ordering::Relaxed);
        if WAITING.load(Ordering::Relaxed) {
            SCB::set_pendst();
        }
    }

    #[task(binds = CRYP, priority = 1, local = [uploader, journal], shared = [scratch])]
    fn storage(cx: storage::Context) {
        TASKS.store(cx.local.uploader, cx.shared.scratch);
        TASKS.store_learned(cx.local.journal, &KEEPING);
        // Over the serial port there is a control tick only when something is received: the outcome is to be told.
        SCB::set_pendst();
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
