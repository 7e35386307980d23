//! Models and working memory, from C.

use core::ffi::c_char;

use impromptu_firmware::{
    model::{Model, Refusal},
    network::Scratch,
};

use super::{Begun, Made, Place, checked, create, input, object, report, view};
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

/// Checks a model file of `length` bytes and creates the model in `model`, which has `size` bytes (sizeof *model). A model that
/// was there before lives on if the file is refused; nothing that was created from it may be in use during the call.
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
        create::<Model<'static>>(model, size, |made| {
            let before = view::<Model<'static>>(model).ok().map(Model::file);
            load(made, bytes, before)
        })
    }
}

/// Makes a place for a model an empty one. On its way it may be on the stack, which is free again for the load.
#[inline(never)]
unsafe fn begin<'p>(made: Made<'p, Model<'static>>) -> Begun<'p, Model<'static>> {
    // SAFETY: the module's rules.
    unsafe { made.begin(Model::empty()) }
}

/// Loads a model, or, if it is refused, the one that was there before, and says why; an error leaves none.
#[inline(never)]
fn fill(place: &mut Model<'static>, bytes: &'static [u8], before: Option<&'static [u8]>) -> Result<Option<Refusal>, Status> {
    let mut scratch = Scratch::new();
    let Err(refusal) = Model::load_into(place, bytes, &mut scratch) else { return Ok(None) };
    match before {
        // It passed every check before.
        Some(file) if Model::load_into(place, file, &mut scratch).is_ok() => Ok(Some(refusal)),
        _ => Err(refusal.into()),
    }
}

/// Loads a model where it will live, or, if it is refused, the one again that was there before.
unsafe fn load(made: Made<'_, Model<'static>>, bytes: &'static [u8], before: Option<&'static [u8]>) -> Result<(), Status> {
    // SAFETY: the module's rules.
    let mut place = unsafe { begin(made) };
    let refusal = fill(place.value(), bytes, before)?;
    place.finish();
    refusal.map_or(Ok(()), |refusal| Err(refusal.into()))
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
        create::<Scratch>(scratch, size, |made| {
            made.write(Scratch::new());
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
