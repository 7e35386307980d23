//! The flight stack, from C.

use core::ffi::c_int;

use impromptu_firmware::{adapter::Lanes, model::Model, network::Scratch};
use impromptu_flight::{course::Course, flight::Flight};

use super::{Place, create, input, object, report, view};
use crate::{
    flight::Stack,
    memory::{FlightMemory, ModelMemory, Object, ScratchMemory},
    status::Status,
    values::{Command, FlightSettings, Inference, Job, Report, Setpoint, State},
};

/// All zeros, so that it is written in place.
const EMPTY: Stack = Stack { flight: Flight::empty(), course: Course::NONE, period: 0.0, flown: None };

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
            let stack = made.write(EMPTY);
            stack.flight.configure(&settings);
            stack.period = 1.0 / settings.rates.reference_hz();
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
/// of the same tick. After impromptu_flight_brake it gives IMPROMPTU_STATUS_BRAKING; with so many ahead that the next one would
/// push out what is still to be flown, or looked back at, IMPROMPTU_STATUS_FULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_flight_push(flight: *mut FlightMemory, setpoint: *const Setpoint) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        let (flight, setpoint) = unsafe { (object::<Stack>(flight)?, input(setpoint)?) };
        flight.push(&setpoint)
    })
}

/// Replaces what is stored from reference tick `tick` on, which must not have been flown: `setpoint` is the new trajectory's
/// first, and further ones are pushed. What it differs by from the old one fades within 5 m/s and 3 m/s^2, so that nothing
/// jumps. It ends a brake.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_flight_replan(flight: *mut FlightMemory, tick: i32, setpoint: *const Setpoint) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        let (flight, setpoint) = unsafe { (object::<Stack>(flight)?, input(setpoint)?) };
        flight.replan(tick, &setpoint)
    })
}

/// Replaces what is stored after the present by coming to rest within 3 m/s^2 and 8 m/s^3, and resting there until
/// impromptu_flight_replan.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_flight_brake(flight: *mut FlightMemory) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Stack>(flight)?.brake() };
        Ok(())
    })
}

/// Lets lanes act again that the guard has handed over for good. What is still wrong hands them over again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_flight_rearm(flight: *mut FlightMemory) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Stack>(flight)?.rearm() }
    })
}

/// States whether the vehicle is in the air (not 0), which a loop that is closed on the ground cannot know: until it is, no lane
/// acts, and nothing is integrated or learned. It is from the start on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_flight_set_airborne(flight: *mut FlightMemory, airborne: c_int) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Stack>(flight)?.flight.set_airborne(airborne != 0) };
        Ok(())
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
