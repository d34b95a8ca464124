#![no_main]
#![expect(missing_docs, reason = "a fuzz target")]

#[path = "../targets.rs"]
mod targets;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::pfm(bytes));
