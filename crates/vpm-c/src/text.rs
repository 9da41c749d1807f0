//! Texts that C can read: zero-terminated, without zeros inside.

use std::ffi::{CStr, CString, c_char};

/// A text of ours for C; a zero inside, which no sentence of ours has, would end it there.
pub(crate) fn terminated(text: &str) -> CString {
    let until = text.find('\0').unwrap_or(text.len());
    CString::new(&text[..until]).unwrap_or_default()
}

/// Writes a text into the caller's room, cut where the room ends.
///
/// # Safety
/// `room` is null or has `size` bytes that may be written.
pub(crate) unsafe fn write(text: &str, room: *mut c_char, size: usize) {
    if room.is_null() || size == 0 {
        return;
    }
    let text = terminated(text);
    let kept = text.as_bytes().len().min(size - 1);
    // SAFETY: `kept + 1 <= size` bytes are written into the room; it is the caller's and ours does not overlap it.
    unsafe {
        std::ptr::copy_nonoverlapping(text.as_ptr(), room, kept);
        *room.add(kept) = 0;
    }
}

/// The caller's text, or a sentence about what is wrong with it.
///
/// # Safety
/// `text` is null or points at a zero-terminated text that nobody changes meanwhile.
pub(crate) unsafe fn read<'a>(text: *const c_char, what: &str) -> Result<&'a str, String> {
    if text.is_null() {
        return Err(format!("{what} is a null pointer; give a zero-terminated text"));
    }
    // SAFETY: not null, and zero-terminated as the caller promises.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().map_err(|error| format!("{what} is no UTF-8 text ({error}); write it in UTF-8"))
}
