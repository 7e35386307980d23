//! Signal tables, from C.

use core::ffi::{CStr, c_char};

use impromptu_firmware::{
    caps,
    model::{self, SignalTable},
    preview::EndRule,
};

use super::{checked, input};
use crate::{
    status::Status,
    values::{Cap, Channel, MAX_CHANNELS, Signals},
};

/// The application's table, compared with the model's by those who read it.
pub(super) unsafe fn table<'a>(signals: *const Signals) -> Result<SignalTable<'a>, Status> {
    // SAFETY: the module's rules.
    let signals = unsafe { input(signals)? };
    // SAFETY: the module's rules.
    unsafe {
        Ok(SignalTable {
            desired: rows(signals.desired, signals.desired_count)?,
            measured: rows(signals.measured, signals.measured_count)?,
            reference: rows(signals.reference, signals.reference_count)?,
        })
    }
}

/// The application's bounds, one for each reference channel.
pub(super) unsafe fn bounds(caps: *const Cap, count: usize) -> Result<heapless::Vec<caps::Cap, MAX_CHANNELS>, Status> {
    let mut bounds = heapless::Vec::new();
    let caps = checked(caps).map_err(|status| if status == Status::Null { Status::Caps } else { status })?;
    if count > MAX_CHANNELS {
        return Err(Status::Count);
    }
    for index in 0..count {
        // SAFETY: `count` bounds are readable.
        let Cap { limit, rate } = unsafe { input(caps.add(index))? };
        let _ = bounds.push(caps::Cap { limit, rate });
    }
    Ok(bounds)
}

type Rows<'a> = heapless::Vec<model::Channel<'a>, MAX_CHANNELS>;

unsafe fn rows<'a>(channels: *const Channel, count: u32) -> Result<Rows<'a>, Status> {
    let mut rows = Rows::new();
    if count as usize > MAX_CHANNELS {
        return Err(Status::Count);
    }
    for index in 0..count as usize {
        // SAFETY: `count` channels are readable, their texts end with a zero byte.
        let row = unsafe {
            let channel = input(checked(channels)?.add(index))?;
            let end = if channel.zero_beyond == 0 { EndRule::Hold } else { EndRule::Zero };
            model::Channel { name: text(channel.name)?, unit: text(channel.unit)?, frame: text(channel.frame)?, end }
        };
        rows.push(row).map_err(|_| Status::Count)?;
    }
    Ok(rows)
}

unsafe fn text<'a>(text: *const c_char) -> Result<&'a str, Status> {
    let text = checked(text)?;
    // SAFETY: the text ends with a zero byte.
    unsafe { CStr::from_ptr(text) }.to_str().map_err(|_| Status::Text)
}
