//! Models and working memory, from C.

use core::ffi::c_char;

use impromptu_firmware::{model::Model, network::Scratch};

use super::{Place, checked, create, input, object, report, view};
use crate::{
    memory::{ModelMemory, Object, ScratchMemory},
    status::Status,
    values::{Description, Inference, Job},
};

/// A status in words, with what to do; for any number.
#[unsafe(no_mangle)]
pub extern "C" fn impromptu_status_text(status: i32) -> *const c_char {
    let known = Status::ALL.into_iter().find(|known| *known as i32 == status);
    known.map_or(c"no status of this library", Status::text).as_ptr()
}

/// Checks a model file of `length` bytes and creates the model in `model`, which has `size` bytes (sizeof *model).
///
/// The bytes stay where they are, in flash for instance: they must live and keep unchanged as long as the model. They should
/// start at a multiple of 16 bytes; elsewhere they are read by slower kernels, with the same results. Needs up to 4 KB of stack
/// on a microcontroller; what is not said to need more, 2 KB.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_model_create(model: *mut ModelMemory, size: usize, bytes: *const u8, length: usize) -> Status {
    let bytes = match checked(bytes) {
        // SAFETY: `length` bytes are readable and keep unchanged.
        Ok(bytes) => unsafe { core::slice::from_raw_parts(bytes, length.min(isize::MAX as usize)) },
        Err(status) => return status,
    };
    // SAFETY: the module's rules.
    unsafe {
        create::<Model<'static>>(model, size, |place| {
            place.write(Model::EMPTY);
            Model::load_into(&mut *place, bytes, &mut Scratch::new())?;
            Ok(())
        })
    }
}

/// What a model says of itself.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_model_describe(model: *const ModelMemory, description: *mut Description) -> Status {
    report(|| {
        let place = Place::new(description)?;
        // SAFETY: the module's rules.
        unsafe {
            let model = view::<Model<'static>>(model)?;
            place.write(Description::new(model));
        }
        Ok(())
    })
}

/// Creates the working memory of an evaluation in `scratch`, which has `size` bytes. One is enough for everything that never runs
/// at the same time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_scratch_create(scratch: *mut ScratchMemory, size: usize) -> Status {
    // SAFETY: the module's rules.
    unsafe {
        create::<Scratch>(scratch, size, |place| {
            place.write(Scratch::new());
            Ok(())
        })
    }
}

/// Evaluates the network: the work of a task of lower priority. It touches nothing but its arguments, so that an adapter or
/// flight stack may go on at the same time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn impromptu_job_run(
    job: *const Job,
    model: *const ModelMemory,
    scratch: *mut ScratchMemory,
    inference: *mut Inference,
) -> Status {
    report(|| {
        let place = Place::new(inference)?;
        // SAFETY: the module's rules.
        let (job, model, scratch) = unsafe { (input(job)?, view::<Model<'static>>(model)?, object::<Scratch>(scratch)?) };
        let network = model.network().ok_or(Status::Nothing)?;
        let done = impromptu_firmware::adapter::Job::from(job).run(network, scratch);
        // SAFETY: the module's rules.
        unsafe { place.write(done.into()) };
        Ok(())
    })
}

/// Bytes of an object as the library was compiled: at most the sizeof of its type in the header. For checks in tests and start-up
/// code.
#[unsafe(no_mangle)]
pub extern "C" fn impromptu_model_size() -> usize {
    size_of::<Object<Model<'static>>>()
}
