//! The C face: the one place where pointers become values, and the source of `include/impromptu.h`.
//!
//! *in* pointers from C; *out* checked values for the safe modules; *never* a reference to the caller's numbers (they are copied
//! in and out, so that buffers may overlap), nor an object that was not created in its memory; *source* the rules below, which
//! the header tells the caller.
//!
//! # Safety
//! What no check can find, the caller of every function promises: a pointer that is neither NULL nor misaligned points to as many
//! values of its type as the function says; memory of an object is left alone, is not moved, and lives as long as what was
//! created from it; no two calls use the same object at the same time, unless both only read it; texts end with a zero byte.
#![allow(unsafe_code)]
// Said once, above.
#![allow(clippy::missing_safety_doc)]

mod adapter;
mod flight;
mod learner;
mod model;
#[cfg(target_os = "none")]
mod panic;
mod signals;

use core::ptr;

use crate::{
    adapter::Channels,
    memory::{Object, Stored},
    status::Status,
    values::Job,
};

pub use adapter::*;
pub use flight::*;
pub use learner::*;
pub use model::*;

/// The status of a call.
fn report(body: impl FnOnce() -> Result<(), Status>) -> Status {
    match body() {
        Ok(()) => Status::Ok,
        Err(status) => status,
    }
}

/// Refuses NULL and misaligned pointers.
fn checked<T>(pointer: *const T) -> Result<*const T, Status> {
    if pointer.is_null() {
        Err(Status::Null)
    } else if !pointer.is_aligned() {
        Err(Status::Misaligned)
    } else {
        Ok(pointer)
    }
}

/// Memory in which an object is to be made: whole, and not before everything that may refuse it has been checked.
struct Made<'p, T>(*mut Object<T>, core::marker::PhantomData<&'p mut T>);

impl<'p, T: Stored> Made<'p, T> {
    /// Writes the object, in place of what was there.
    unsafe fn write(self, value: T) -> &'p mut T {
        // SAFETY: the module's rules.
        unsafe { self.begin(value).finish() }
    }

    /// Writes an object that is none before it is [finished](Begun::finish).
    unsafe fn begin(self, value: T) -> Begun<'p, T> {
        // SAFETY: memory for an object that nobody else uses; it is written whole before it is referred to.
        unsafe {
            ptr::addr_of_mut!((*self.0).mark).write(0);
            ptr::addr_of_mut!((*self.0).value).write(value);
            Begun(&mut *self.0)
        }
    }
}

/// An object that is still to be filled.
struct Begun<'p, T>(&'p mut Object<T>);

impl<'p, T: Stored> Begun<'p, T> {
    fn value(&mut self) -> &mut T {
        &mut self.0.value
    }

    /// From now on it is one.
    fn finish(self) -> &'p mut T {
        self.0.mark = T::MARK;
        &mut self.0.value
    }
}

/// Creates an object in memory of `size` bytes, in place: it may be larger than a task's stack. If it cannot be made, what was
/// there before lives on.
unsafe fn create<T: Stored>(memory: *mut T::Memory, size: usize, make: impl FnOnce(Made<'_, T>) -> Result<(), Status>) -> Status {
    let () = T::FITS;
    report(|| {
        let object = checked(memory)?.cast::<Object<T>>().cast_mut();
        if size < size_of::<Object<T>>() {
            return Err(Status::Memory);
        }
        // The caller's memory is aligned (`FITS`) and large enough for the object, and nobody else uses it.
        make(Made(object, core::marker::PhantomData))
    })
}

/// The object that was created in this memory, to be changed.
unsafe fn object<'a, T: Stored>(memory: *mut T::Memory) -> Result<&'a mut T, Status> {
    let () = T::FITS;
    let object = checked(memory)?.cast::<Object<T>>().cast_mut();
    // SAFETY: the memory has the object's size; the value is read only if the mark says that it was written. No other call uses
    // it.
    unsafe {
        match ptr::addr_of!((*object).mark).read() == T::MARK {
            true => Ok(&mut (*object).value),
            false => Err(Status::NotCreated),
        }
    }
}

/// The object that was created in this memory, to be read. It lives as long as what borrows it: the caller's promise.
unsafe fn view<'a, T: Stored>(memory: *const T::Memory) -> Result<&'a T, Status> {
    let () = T::FITS;
    let object = checked(memory)?.cast::<Object<T>>();
    // SAFETY: as for `object`; other calls only read it.
    unsafe {
        match ptr::addr_of!((*object).mark).read() == T::MARK {
            true => Ok(&(*object).value),
            false => Err(Status::NotCreated),
        }
    }
}

/// The values of a signal, copied.
unsafe fn channels(pointer: *const f32, count: usize) -> Result<Channels, Status> {
    let pointer = checked(pointer)?;
    let mut values = Channels::default();
    if count > values.len() {
        return Err(Status::Count);
    }
    // SAFETY: `count` values are readable, and fit.
    unsafe { ptr::copy(pointer, values.as_mut_ptr(), count) };
    Ok(values)
}

/// A structure of plain numbers, copied.
unsafe fn input<T: Copy>(pointer: *const T) -> Result<T, Status> {
    // SAFETY: one readable value of plain numbers.
    checked(pointer).map(|pointer| unsafe { pointer.read() })
}

/// The caller's place for an output, checked before anything is done.
struct Place<T>(*mut T);

impl<T: Copy> Place<T> {
    fn new(pointer: *mut T) -> Result<Self, Status> {
        checked(pointer).map(|pointer| Self(pointer.cast_mut()))
    }

    unsafe fn write(&self, value: T) {
        // SAFETY: a place for one value that nobody else uses.
        unsafe { self.0.write(value) };
    }

    /// Writes the first `count` values.
    unsafe fn write_first(&self, values: &[T], count: usize) {
        // SAFETY: a place for `count` values that nobody else uses.
        unsafe { ptr::copy(values.as_ptr(), self.0, count.min(values.len())) };
    }
}

impl Place<Job> {
    /// Writes a job field by field: it is large, and control tasks have small stacks.
    unsafe fn write_job(&self, job: &impromptu_firmware::adapter::Job) {
        // SAFETY: a place for one job that nobody else uses.
        unsafe {
            ptr::addr_of_mut!((*self.0).tick).write(job.tick);
            ptr::copy(job.inputs.as_ptr(), ptr::addr_of_mut!((*self.0).inputs).cast(), job.inputs.len());
        }
    }
}
