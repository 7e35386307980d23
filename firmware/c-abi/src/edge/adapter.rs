//! The adapter alone, from C.

use core::ffi::c_int;

use impromptu_firmware::{
    adapter::Lanes,
    caps::Caps,
    model::{Channels, Model},
    network::Scratch,
};
use impromptu_flight::{caps, quadrotor};

use super::{
    Made, Place, channels, create, input, object, report,
    signals::{bounds, table},
    view,
};
use crate::{
    adapter::{EMPTY, Stage, counted},
    memory::{AdapterMemory, ModelMemory, Object, ScratchMemory},
    status::Status,
    values::{Cap, Inference, Job, Report, Signals},
};

/// Creates an adapter in `adapter`, which has `size` bytes, for a loop whose references run at `rate_hz`. Both lanes are off.
///
/// `signals` is compared with the model's table, name by name; NULL takes the model's for the application's. `caps` says for each
/// reference channel, `cap_count` of them in the order of the signals, what its correction may be, whatever the model says: there
/// is no default. The model must live as long as the adapter. The first sample pushed will be that of reference tick
/// `first_tick`. Needs up to 4 KB of stack.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_create(
    adapter: *mut AdapterMemory,
    size: usize,
    model: *const ModelMemory,
    signals: *const Signals,
    rate_hz: f32,
    first_tick: i32,
    caps: *const Cap,
    cap_count: usize,
) -> Status {
    // SAFETY: the module's rules.
    unsafe {
        create(adapter, size, |made| {
            let model = view::<Model<'static>>(model)?;
            let caps = bounds(caps, cap_count)?;
            let caps = Caps { channels: &caps, sums: &[] };
            match signals.is_null() {
                true => fill(made, model, &(&model.card().signals).into(), rate_hz, &caps, first_tick),
                false => fill(made, model, &(&table(signals)?).into(), rate_hz, &caps, first_tick),
            }
        })
    }
}

/// impromptu_adapter_create for the signals of a quadrotor, as the flight stack has them: 10 desired channels (position,
/// velocity, acceleration, yaw), 13 measured (position, velocity, roll, pitch, yaw, body rates, vertical acceleration without
/// gravity), 6 references (position, velocity). m, s, rad; world ENU, body FLU, pitch positive nose down. A correction of a
/// position is at most 1 m and 40 m/s, one of a velocity at most 4 m/s and 160 m/s^2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_create_quadrotor(
    adapter: *mut AdapterMemory,
    size: usize,
    model: *const ModelMemory,
    rate_hz: f32,
    first_tick: i32,
) -> Status {
    // SAFETY: the module's rules.
    unsafe {
        create(adapter, size, |made| {
            let caps = Caps { channels: &caps::CHANNELS, sums: &[] };
            fill(made, view::<Model<'static>>(model)?, &quadrotor::signals(), rate_hz, &caps, first_tick)
        })
    }
}

/// Makes an adapter where it will live. Nothing is written before all has been checked.
#[inline(never)]
unsafe fn fill(
    made: Made<'_, Stage>,
    model: &'static Model<'static>,
    table: &Channels<'_>,
    rate_hz: f32,
    caps: &Caps<'_>,
    first_tick: i32,
) -> Result<(), Status> {
    Stage::check(model, table, rate_hz, caps)?;
    // SAFETY: the module's rules.
    let stage = unsafe { made.write(EMPTY) };
    stage.load(model, table, rate_hz, caps)?;
    stage.clear(first_tick);
    Ok(())
}

/// Appends the desired channels of the next reference tick. Push as far ahead as impromptu_description.future says; what is
/// missing is taken as the trajectory's end.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_push(adapter: *mut AdapterMemory, desired: *const f32, count: usize) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        let (adapter, desired) = unsafe { (object::<Stage>(adapter)?, channels(desired, count)?) };
        counted(adapter, [Some(count), None, None])?;
        Ok(adapter.push(desired)?)
    })
}

/// Forgets the trajectory, for another one: the next sample pushed will be that of reference tick `first_tick`. Until then the
/// loop holds what was desired last. For another trajectory on the way without a gap: impromptu_adapter_replan.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_restart(adapter: *mut AdapterMemory, first_tick: i32) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Stage>(adapter)?.clear(first_tick) };
        Ok(())
    })
}

/// Forgets the samples of reference tick `from` and later, in whose place others will be pushed: the next one is that of
/// impromptu_report.next_tick, which is `from` unless fewer had been pushed. What lies before stays.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_replan(adapter: *mut AdapterMemory, from: i32) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Stage>(adapter)?.truncate(from) };
        Ok(())
    })
}

/// Lets lanes act again that the guard has handed over for good. What is still wrong hands them over again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_rearm(adapter: *mut AdapterMemory) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Stage>(adapter)?.rearm() };
        Ok(())
    })
}

/// Tells how many reference ticks ago the newest measurement arrived, beyond the delay that the model knows; 0 from the start.
/// Both lanes are handed over while it is older than 0.1 s.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_set_age(adapter: *mut AdapterMemory, ticks: u32) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Stage>(adapter)?.set_age(u16::try_from(ticks).unwrap_or(u16::MAX)) };
        Ok(())
    })
}

/// States that measured channels have noise in them, bit `c` of `channels` for channel `c`, so that all of them together are
/// never twice the same but where no new measurement came, for at most `ticks` reference ticks in a row. Once they have been the
/// same for longer, they are as old as that: both lanes are handed over from 0.1 s on. No bit, as from the start: nothing is
/// stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_expect_noise(adapter: *mut AdapterMemory, channels: u32, ticks: u32) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        let adapter = unsafe { object::<Stage>(adapter)? };
        let own = adapter.model().ok_or(Status::Nothing)?.card().signals.measured.len();
        if u64::from(channels) >> own != 0 {
            return Err(Status::Count);
        }
        let stated = (0..own).filter(|channel| channels >> channel & 1 == 1);
        adapter.expect_noise(stated, u16::try_from(ticks).unwrap_or(u16::MAX));
        Ok(())
    })
}

/// States whether the loop moves the machine (not 0): a vehicle on the ground, or a machine that is held, does not follow. Until
/// it does, no lane acts, nothing is integrated, learned or judged; then the lanes fade in. It does from the start on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_set_airborne(adapter: *mut AdapterMemory, airborne: c_int) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Stage>(adapter)?.set_airborne(airborne != 0) };
        Ok(())
    })
}

/// Writes what the feedback lane corrected of each reference channel in the last tick, as many numbers as the loop has reference
/// channels, for what learns beside it (impromptu_learner_tell_other).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_fed_back(adapter: *mut AdapterMemory, fed_back: *mut f32, count: usize) -> Status {
    report(|| {
        let place = Place::new(fed_back)?;
        // SAFETY: the module's rules.
        let adapter = unsafe { object::<Stage>(adapter)? };
        counted(adapter, [None, None, Some(count)])?;
        // SAFETY: the module's rules.
        unsafe { place.write_first(&adapter.fed_back(), count) };
        Ok(())
    })
}

/// Switches the network lane and the feedback lane on (not 0) or off; they fade in and out over the model's fade time. With both
/// off and faded out the reference is the desired one, to the bit.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_switch(adapter: *mut AdapterMemory, network: c_int, feedback: c_int) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Stage>(adapter)?.switch(Lanes { network: network != 0, feedback: feedback != 0 }) };
        Ok(())
    })
}

/// Gives inferences time until the next reference tick: for a network that is evaluated by a task of lower priority. Once, after
/// impromptu_adapter_create.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_defer(adapter: *mut AdapterMemory) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Stage>(adapter)?.defer() };
        Ok(())
    })
}

/// A whole reference tick, the network included: takes what is measured and writes the reference that the loop shall track.
///
/// It is written, and the tick is done, also after IMPROMPTU_STATUS_BAD_SAMPLE (a measured number is NaN or infinite: it counts
/// as a missed sample, the last good one stands in) and IMPROMPTU_STATUS_NO_TRAJECTORY (nothing was pushed since creation or
/// impromptu_adapter_restart: the loop holds what was desired last or, at first, where it is).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_step(
    adapter: *mut AdapterMemory,
    scratch: *mut ScratchMemory,
    tick: i32,
    measured: *const f32,
    measured_count: usize,
    reference: *mut f32,
    reference_count: usize,
) -> Status {
    report(|| {
        let place = Place::new(reference)?;
        // SAFETY: the module's rules.
        let (adapter, scratch) = unsafe { (object::<Stage>(adapter)?, object::<Scratch>(scratch)?) };
        // SAFETY: the module's rules.
        let measured = unsafe { channels(measured, measured_count)? };
        counted(adapter, [None, Some(measured_count), Some(reference_count)])?;
        let values = adapter.step(tick, &measured, scratch);
        // SAFETY: the module's rules.
        unsafe { place.write_first(&values, reference_count) };
        held(adapter, &measured)
    })
}

/// First part of a reference tick. Sets `due` to 1 and writes `job` if the network is to be evaluated (impromptu_job_run), else
/// sets it to 0 and leaves `job` alone. The inference is given to impromptu_adapter_deliver by whoever calls the adapter, before
/// impromptu_adapter_finish or, after impromptu_adapter_defer, before the next impromptu_adapter_begin.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_begin(
    adapter: *mut AdapterMemory,
    tick: i32,
    measured: *const f32,
    measured_count: usize,
    job: *mut Job,
    due: *mut c_int,
) -> Status {
    report(|| {
        let (place, flag) = (Place::new(job)?, Place::new(due)?);
        // SAFETY: the module's rules.
        let (adapter, measured) = unsafe { (object::<Stage>(adapter)?, channels(measured, measured_count)?) };
        counted(adapter, [None, Some(measured_count), None])?;
        let released = adapter.begin(tick, &measured);
        // SAFETY: the module's rules.
        unsafe {
            flag.write(c_int::from(released.is_some()));
            if let Some(released) = &released {
                place.write_job(released);
            }
        }
        Ok(())
    })
}

/// Takes what came of the last job; one that is not awaited any more is dropped. One with a number that is not finite is refused,
/// and late.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_deliver(adapter: *mut AdapterMemory, inference: *const Inference) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        let (adapter, inference) = unsafe { (object::<Stage>(adapter)?, input(inference)?) };
        if !inference.outputs.iter().all(|output| output.is_finite()) {
            return Err(Status::NotFinite);
        }
        adapter.deliver(inference.into());
        Ok(())
    })
}

/// Second part of a reference tick: writes the reference that the loop shall track. The statuses are those of
/// impromptu_adapter_step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_finish(
    adapter: *mut AdapterMemory,
    tick: i32,
    measured: *const f32,
    measured_count: usize,
    reference: *mut f32,
    reference_count: usize,
) -> Status {
    report(|| {
        let place = Place::new(reference)?;
        // SAFETY: the module's rules.
        let (adapter, measured) = unsafe { (object::<Stage>(adapter)?, channels(measured, measured_count)?) };
        counted(adapter, [None, Some(measured_count), Some(reference_count)])?;
        let values = adapter.finish(tick, &measured);
        // SAFETY: the module's rules.
        unsafe { place.write_first(&values, reference_count) };
        held(adapter, &measured)
    })
}

/// What was held in this tick, if anything was.
fn held(adapter: &Stage, measured: &crate::adapter::Channels) -> Result<(), Status> {
    if !adapter.has_trajectory() {
        return Err(Status::NoTrajectory);
    }
    if measured.iter().all(|number| number.is_finite()) { Ok(()) } else { Err(Status::BadSample) }
}

/// Correction, fades, saturations, late inferences, trips and how far the trajectory reaches.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_adapter_report(adapter: *mut AdapterMemory, result: *mut Report) -> Status {
    report(|| {
        let place = Place::new(result)?;
        // SAFETY: the module's rules.
        unsafe { place.write(object::<Stage>(adapter)?.report().into()) };
        Ok(())
    })
}

/// Bytes of an adapter as the library was compiled: at most sizeof(impromptu_adapter).
#[unsafe(no_mangle)]
pub extern "C" fn impromptu_adapter_size() -> usize {
    size_of::<Object<Stage>>()
}
