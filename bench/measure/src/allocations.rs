//! Counts what a step allocates: the system's allocator with a count of calls for each thread.
//!
//! It counts in programs that make it theirs, `#[global_allocator] static ALLOCATOR: Counting = Counting;`, as the
//! binary `taut` and the test of the workspace's structure do. What C code allocates is not seen.

#![allow(unsafe_code)] // an allocator cannot be written without

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::hint::black_box;

thread_local! {
    static CALLS: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator; each call adds one to a number of its thread.
pub struct Counting;

impl Counting {
    fn count() {
        // Beyond the thread's end nothing is counted.
        let _ = CALLS.try_with(|calls| calls.set(calls.get().wrapping_add(1)));
    }
}

// SAFETY: every call is passed on to the system's allocator as it came; counting touches no memory of its own.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::count();
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Self::count();
        // SAFETY: the caller keeps the contract of `alloc_zeroed`.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Self::count();
        // SAFETY: the caller keeps the contract of `realloc`.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        Self::count();
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Result of `work` and the number of allocator calls of this thread in it: allocate, grow, free.
pub fn during<T>(work: impl FnOnce() -> T) -> (T, u64) {
    let before = CALLS.get();
    let done = work();
    (done, CALLS.get().wrapping_sub(before))
}

/// True if this program's allocator is [`Counting`]; a count of 0 means nothing otherwise.
pub fn are_counted() -> bool {
    during(|| drop(black_box(Box::new(1)))).1 > 0
}
