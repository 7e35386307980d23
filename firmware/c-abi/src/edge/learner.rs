//! What learns an axis, from C.

use core::{ffi::c_int, ptr};

use super::{Place, checked, create, input, object, report, view};
use crate::{
    learner::Learning,
    memory::{LearnerMemory, Object},
    status::Status,
    values::{LearnerReport, LearnerSettings},
};

/// Creates in `learner`, which has `size` bytes, what learns the corrections of one axis while its loop runs: no model is needed.
/// It is off: impromptu_learner_commission or impromptu_learner_learn start it. An axis more is an object more. The first sample
/// pushed will be that of reference tick `first_tick`. Needs up to 8 KB of stack.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_create(
    learner: *mut LearnerMemory,
    size: usize,
    settings: *const LearnerSettings,
    first_tick: i32,
) -> Status {
    // SAFETY: the module's rules.
    unsafe {
        create(learner, size, |made| {
            let settings = input(settings)?;
            made.write(Learning::EMPTY).configure(&settings, first_tick)
        })
    }
}

/// Appends what is desired at the next reference tick. Push 80 ticks ahead; what is missing is taken as the trajectory's end. At
/// most 128 samples are kept.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_push(learner: *mut LearnerMemory, desired: f32) -> Status {
    // SAFETY: the module's rules.
    report(|| unsafe { object::<Learning>(learner)?.push(desired) })
}

/// Forgets the trajectory, for another one: the next sample pushed will be that of reference tick `first_tick`. What was learned
/// stays.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_restart(learner: *mut LearnerMemory, first_tick: i32) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Learning>(learner)?.clear(first_tick) };
        Ok(())
    })
}

/// Forgets what is desired at reference tick `from` and later, for another trajectory from there on: the next sample pushed is
/// that of `from`, if as many had been pushed. What lies before stays.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_replan(learner: *mut LearnerMemory, from: i32) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Learning>(learner)?.truncate(from) };
        Ok(())
    })
}

/// States what a correction may be from the next step on, within the limits: for a loop of which it is known how far the desired
/// motion may need one. The limits if it is not said; what is not a number is refused.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_bound(learner: *mut LearnerMemory, low: f32, high: f32) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        let learning = unsafe { object::<Learning>(learner)? };
        if low.is_nan() || high.is_nan() || low > high {
            return Err(Status::NotFinite);
        }
        learning.add_on.bound(0, low, high);
        Ok(())
    })
}

/// States, before a step, what another feedback corrected of this axis in the last tick, as a model's feedback lane
/// (impromptu_adapter_fed_back): what that resists is not still missing. Measure the response without it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_tell_other(learner: *mut LearnerMemory, correction: f32) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Learning>(learner)?.add_on.tell_other(0, correction) };
        Ok(())
    })
}

/// Measures the response: as soon as the trajectory rests, the reference steps to and fro by the stated size; then it learns,
/// from nothing. impromptu_learner_report tells how far it is, and why it was given up.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_commission(learner: *mut LearnerMemory) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Learning>(learner)?.add_on.commission() };
        Ok(())
    })
}

/// Learns and corrects. IMPROMPTU_STATUS_UNKNOWN: no response is known.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_learn(learner: *mut LearnerMemory) -> Status {
    // SAFETY: the module's rules.
    report(|| unsafe { Ok(object::<Learning>(learner)?.add_on.learn()?) })
}

/// Corrects by what it has learned, and learns no more. IMPROMPTU_STATUS_UNKNOWN: no response is known.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_hold(learner: *mut LearnerMemory) -> Status {
    // SAFETY: the module's rules.
    report(|| unsafe { Ok(object::<Learning>(learner)?.add_on.hold()?) })
}

/// Neither learns nor corrects: the correction goes back to nothing by its rate. What was learned stays.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_stop(learner: *mut LearnerMemory) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Learning>(learner)?.add_on.stop() };
        Ok(())
    })
}

/// Forgets what was learned, not how the loop answers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_forget(learner: *mut LearnerMemory) -> Status {
    report(|| {
        // SAFETY: the module's rules.
        unsafe { object::<Learning>(learner)?.add_on.forget() };
        Ok(())
    })
}

/// A reference tick: writes the correction, which the caller adds to what is desired. `measured` is the value of the axis, `rate`
/// its rate of change; NaN stands for a sample that is missing and for a rate that is not measured. `moving` (not 0) says that
/// the loop moves the machine: else nothing is learned and nothing corrected.
///
/// It is written, and the tick is done, also after IMPROMPTU_STATUS_BAD_SAMPLE (the value was missing) and
/// IMPROMPTU_STATUS_NO_TRAJECTORY (nothing was pushed: no correction).
///
/// Needs up to 8 KB of stack where commissioning begins and ends, else 2 KB.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_step(
    learner: *mut LearnerMemory,
    tick: i32,
    measured: f32,
    rate: f32,
    moving: c_int,
    correction: *mut f32,
) -> Status {
    report(|| {
        let place = Place::new(correction)?;
        // SAFETY: the module's rules.
        let learning = unsafe { object::<Learning>(learner)? };
        let (value, missing) = learning.step(tick, measured, rate, moving != 0);
        // SAFETY: the module's rules.
        unsafe { place.write(value) };
        missing
    })
}

/// How far it is.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_report(learner: *const LearnerMemory, result: *mut LearnerReport) -> Status {
    report(|| {
        let place = Place::new(result)?;
        // SAFETY: the module's rules.
        unsafe { place.write(view::<Learning>(learner)?.report()) };
        Ok(())
    })
}

/// Writes what was learned to `bytes`, which has room for `size` of them, and their number to `length`: to be stored, and given
/// to impromptu_learner_recall after a power cut. IMPROMPTU_KEPT bytes are enough. Needs up to 4 KB of stack.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_keep(
    learner: *const LearnerMemory,
    bytes: *mut u8,
    size: usize,
    length: *mut usize,
) -> Status {
    report(|| {
        let (place, bytes) = (Place::new(length)?, Place::new(bytes)?);
        let mut kept = [0; crate::values::KEPT];
        // SAFETY: the module's rules.
        let written = unsafe { view::<Learning>(learner)?.keep(&mut kept)? };
        if written > size {
            return Err(Status::NotKept);
        }
        // SAFETY: the module's rules.
        unsafe {
            bytes.write_first(&kept, written);
            place.write(written);
        }
        Ok(())
    })
}

/// Goes on with what was kept, `size` bytes or more at `bytes`: in the phase in which it is. IMPROMPTU_STATUS_OTHER: it is of
/// another loop. Needs up to 8 KB of stack.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_learner_recall(learner: *mut LearnerMemory, bytes: *const u8, size: usize) -> Status {
    report(|| {
        let bytes = checked(bytes)?;
        let mut kept = [0; crate::values::KEPT];
        // SAFETY: the module's rules.
        let learning = unsafe { object::<Learning>(learner)? };
        // SAFETY: `size` bytes are readable, and as many as are copied fit.
        unsafe { ptr::copy(bytes, kept.as_mut_ptr(), size.min(kept.len())) };
        learning.recall(&kept)
    })
}

/// Bytes of a learner as the library was compiled: at most sizeof(impromptu_learner).
#[unsafe(no_mangle)]
pub extern "C" fn impromptu_learner_size() -> usize {
    size_of::<Object<Learning>>()
}
