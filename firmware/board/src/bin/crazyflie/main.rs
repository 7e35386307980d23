//! A Crazyflie 2.x: STM32F405, brushed motors, the link on the deck port UART1. Not flown yet: it builds, and the emulated board,
//! which shares all but pins and clocks, flies.
//!
//! - in: the link's bytes, the models in flash
//! - out: duty cycles of four motors, the link's bytes
//! - never: motors that turn after a panic, a fault or a hang. All three end in a reset, after which every pin is an input and
//!   the gates' resistors hold the motors off
//!
//! | task | bound to | priority | |
//! |---|---|---|---|
//! | `control` | SysTick, 500 Hz | 3 | receives, flies a tick, answers, feeds the watchdog |
//! | `serial` | USART3 | 4 | a byte from the line, a byte to the line |
//! | `inference` | an unused vector | 1 | evaluates the network, which may take until the next reference tick |
//! | `storage` | an unused vector | 1 | stores a piece of a model while disarmed; the core stands still meanwhile |
//!
//! Tasks share nothing but the lock-free [`impromptu_firmware::exchange`].
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod flash;
#[cfg(target_os = "none")]
mod instruments;
#[cfg(target_os = "none")]
mod motors;
#[cfg(target_os = "none")]
mod safety;

#[cfg(target_os = "none")]
#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use cortex_m::peripheral::SCB;
    use impromptu_board::{CONTROL_HZ, Cost as _, LINK_BAUD, Start, Tasks, slots::slots, start};
    use impromptu_firmware::{
        exchange::ByteRing,
        network::{Network, Scratch},
        storage::Uploader,
    };
    use impromptu_flight::{
        application::{Application, OUTBOX},
        autopilot::Meters,
        types::MotorCommand,
    };
    use static_cell::ConstStaticCell;
    use stm32f4xx_hal::{
        pac::{Interrupt, USART3},
        prelude::*,
        rcc::Config,
        serial::{Config as Line, Rx, Tx},
    };

    use crate::{
        flash::Sector,
        instruments::{self, Cycles},
        motors::Motors,
        safety::{Restart, Watchdog},
    };

    static TASKS: Tasks = Tasks::new();
    /// Bytes from and to the line.
    static RECEIVED: ByteRing<512> = ByteRing::new();
    static SENDING: ByteRing<512> = ByteRing::new();
    const _: () = assert!(OUTBOX <= 512, "what a tick says fits into the line's queue");
    const _: () = assert!(2 * LINK_BAUD / 10 / CONTROL_HZ <= 512, "and what arrives in two ticks");

    #[shared]
    struct Shared {
        /// Of tasks of one priority.
        #[lock_free]
        scratch: &'static mut Scratch,
    }

    #[local]
    struct Local {
        application: &'static mut Application<'static>,
        motors: Motors,
        meters: Meters,
        watchdog: Watchdog,
        restart: Restart,
        /// A piece came in the last tick.
        piece: bool,
        network: Option<&'static Network<'static>>,
        uploader: Uploader<Sector>,
        receiver: Rx<USART3>,
        transmitter: Tx<USART3>,
    }

    #[init]
    fn init(cx: init::Context) -> (Shared, Local) {
        let device = cx.device;
        let clocks = Config::hse(8.MHz()).sysclk(impromptu_board::CORE_HZ.Hz()).pclk1(42.MHz()).pclk2(84.MHz());
        let mut rcc = device.RCC.freeze(clocks);
        let (a, b, c) = (device.GPIOA.split(&mut rcc), device.GPIOB.split(&mut rcc), device.GPIOC.split(&mut rcc));
        let motors = Motors::new((device.TIM2, device.TIM4), (a.pa1, b.pb11, a.pa15, b.pb9), &mut rcc);

        instruments::paint_stack();
        static APPLICATION: ConstStaticCell<Application<'static>> = ConstStaticCell::new(Application::new());
        let Some(Start { application, network, spare, sequence, scratch }) = start(APPLICATION.take(), slots(), &[]) else {
            SCB::sys_reset()
        };
        let uploader = Uploader::new(Sector::new(device.FLASH, spare), sequence);

        let baud = Line::default().baudrate(LINK_BAUD.bps());
        let Ok(port) = device.USART3.serial((c.pc10, c.pc11), baud, &mut rcc) else { SCB::sys_reset() };
        let (transmitter, mut receiver) = port.split();
        receiver.listen();

        instruments::start_cycles(cx.core.DCB, cx.core.DWT);
        instruments::start_tick(cx.core.SYST);
        let local = Local {
            application,
            motors,
            meters: Meters::default(),
            watchdog: Watchdog::start(device.IWDG),
            restart: Restart::default(),
            piece: false,
            network,
            uploader,
            receiver,
            transmitter,
        };
        (Shared { scratch }, local)
    }

    #[idle]
    fn idle(_: idle::Context) -> ! {
        loop {
            TASKS.report_stack(instruments::stack_high_water());
            cortex_m::asm::wfi();
        }
    }

    #[task(binds = SysTick, priority = 3, local = [application, motors, meters, watchdog, restart, piece])]
    fn control(cx: control::Context) {
        let control::LocalResources { application, motors, meters, watchdog, restart, piece, .. } = cx.local;
        let entry = instruments::since_tick();
        if application.autopilot().in_flight() {
            meters.entry_latency_max = meters.entry_latency_max.max(entry);
        }
        // The watchdog has taken up its patience of a disarmed vehicle since the piece came.
        if core::mem::take(piece) {
            rtic::pend(Interrupt::CRYP);
        }
        let (came, received) = Cycles.measure(|| {
            let mut came = false;
            let mut bytes = [0; 32];
            loop {
                match RECEIVED.take_some(&mut bytes) {
                    [] => break came,
                    bytes => came |= TASKS.on_bytes(application, bytes),
                }
            }
        });
        *piece = came;
        let tick = TASKS.fly(application, meters, &Cycles, received);
        motors.drive(if application.storing() { &MotorCommand::OFF } else { &tick.command });
        if tick.job {
            rtic::pend(Interrupt::DCMI);
        }
        if SENDING.put_all(application.outbox()) {
            application.sent();
        }
        rtic::pend(Interrupt::USART3);
        // The next tick is due, and this one is not done.
        meters.deadline_misses += u32::from(application.autopilot().in_flight() && SCB::is_pendst_pending());
        restart.tick(application.restart_due());
        watchdog.feed(application.autopilot().armed());
    }

    #[task(binds = DCMI, priority = 1, local = [network], shared = [scratch])]
    fn inference(cx: inference::Context) {
        TASKS.infer(*cx.local.network, cx.shared.scratch, &Cycles);
    }

    #[task(binds = CRYP, priority = 1, local = [uploader], shared = [scratch])]
    fn storage(cx: storage::Context) {
        TASKS.store(cx.local.uploader, cx.shared.scratch);
    }

    #[task(binds = USART3, priority = 4, local = [receiver, transmitter])]
    fn serial(cx: serial::Context) {
        let serial::LocalResources { receiver, transmitter, .. } = cx.local;
        // An overrun is read away; the frame's check sum tells.
        if let Ok(byte) = receiver.read() {
            RECEIVED.put(byte);
        }
        if transmitter.is_tx_empty() {
            match SENDING.take() {
                Some(byte) => {
                    // There is room.
                    let _ = transmitter.write(byte);
                    transmitter.listen();
                }
                None => transmitter.unlisten(),
            }
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("this program is for a Crazyflie 2.x; build it for thumbv7em-none-eabihf and flash it");
    std::process::ExitCode::FAILURE
}
