//! The flight stack, from C.

use core::ffi::c_int;

use impromptu_firmware::{adapter::Lanes, model::Model, network::Scratch};
use impromptu_flight::flight::Flight;

use super::{Place, create, input, object, report, view};
use crate::{
    flight::Stack,
    memory::{FlightMemory, ModelMemory, Object, ScratchMemory},
    status::Status,
    values::{Command, FlightSettings, Inference, Job, Report, Setpoint, State},
};

/// All zeros, so that it is written in place.
const EMPTY: Flight<'static> = Flight::empty();

/// Creates a flight stack in `flight`, which has `size` bytes, with no add-on. The first setpoint is that of reference tick 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_flight_create(
    flight: *mut FlightMemory,
    size: usize,
    settings: *const FlightSettings,
) -> Status {
    // SAFETY: the module's rules.
    unsafe {
        create::<Stack>(flight, size, |made| {
            let settings = input(settings)?.checked().ok_or(Status::Settings)?;
            if settings.check().is_err() {
                return Err(Status::Settings);
            }
            made.write(Stack { flight: EMPTY }).flight.configure(&settings);
            Ok(())
        })
    }
}

/// Puts an add-on before the loop, with the lanes that are not 0 on. The model must live as long as the flight stack.
/// Needs up to 4 KB of stack.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_flight_attach(
    flight: *mut FlightMemory,
    model: *const ModelMemory,
    network: c_int,
    feedback: c_int,
) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        let (flight, model) = unsafe { (object::<Stack>(flight)?, view::<Model<'static>>(model)?) };
        flight.attach(model, Lanes { network: network != 0, feedback: feedback != 0 })
    })
}

/// Appends the desired state of the next reference tick, as far ahead as impromptu_description.future says. One that is not
/// finite, or that no vehicle can be asked for, gives IMPROMPTU_STATUS_NOT_FINITE and is not stored: the next one is still that
/// of the same tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_flight_push(flight: *mut FlightMemory, setpoint: *const Setpoint) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        let (flight, setpoint) = unsafe { (object::<Stack>(flight)?, input(setpoint)?) };
        flight.push(&setpoint)
    })
}

/// Switches the network lane and the feedback lane on (not 0) or off.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_flight_switch(flight: *mut FlightMemory, network: c_int, feedback: c_int) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Stack>(flight)?.switch(Lanes { network: network != 0, feedback: feedback != 0 }) }
    })
}

/// One control tick, the network included. Ticks count from 0. A state that is not finite, or that no vehicle can be in, gives
/// IMPROMPTU_STATUS_NOT_FINITE, no command, and changes nothing: a missed sample. What the motors then do is the caller's
/// decision. Needs up to 4 KB of stack.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_flight_step(
    flight: *mut FlightMemory,
    scratch: *mut ScratchMemory,
    tick: u32,
    state: *const State,
    command: *mut Command,
) -> Status {
    report(|| {
        let place = Place::new(command)?;
        // SAFETY: the module's rules.
        let (flight, scratch, state) = unsafe { (object::<Stack>(flight)?, object::<Scratch>(scratch)?, input(state)?) };
        let command = flight.step(tick, &state, scratch)?;
        // SAFETY: the module's rules.
        unsafe { place.write(command) };
        Ok(())
    })
}

/// One control tick without the network: the same commands as impromptu_flight_step, if each inference is delivered before the
/// next reference tick. Sets `due` to 1 and writes `job` if the network is to be evaluated (impromptu_job_run), else sets it to
/// 0. Needs up to 4 KB of stack.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_flight_control(
    flight: *mut FlightMemory,
    tick: u32,
    state: *const State,
    command: *mut Command,
    job: *mut Job,
    due: *mut c_int,
) -> Status {
    report(|| {
        let (place, work, flag) = (Place::new(command)?, Place::new(job)?, Place::new(due)?);
        // SAFETY: the module's rules.
        let (flight, state) = unsafe { (object::<Stack>(flight)?, input(state)?) };
        let (command, released) = flight.control(tick, &state)?;
        // SAFETY: the module's rules.
        unsafe {
            place.write(command);
            flag.write(c_int::from(released.is_some()));
            if let Some(released) = &released {
                work.write_job(released);
            }
        }
        Ok(())
    })
}

/// Takes what came of the last job; one that is not awaited any more is dropped.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_flight_deliver(flight: *mut FlightMemory, inference: *const Inference) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        let (flight, inference) = unsafe { (object::<Stack>(flight)?, input(inference)?) };
        flight.deliver(inference.into());
        Ok(())
    })
}

/// What the add-on has done; IMPROMPTU_STATUS_NOTHING without one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_flight_report(flight: *mut FlightMemory, result: *mut Report) -> Status {
    report(|| {
        let place = Place::new(result)?;
        // SAFETY: the module's rules.
        unsafe { place.write(object::<Stack>(flight)?.report()?) };
        Ok(())
    })
}

/// Bytes of a flight stack as the library was compiled: at most sizeof(impromptu_flight).
#[unsafe(no_mangle)]
pub extern "C" fn impromptu_flight_size() -> usize {
    size_of::<Object<Stack>>()
}
