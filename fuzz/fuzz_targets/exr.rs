#![no_main]
#![expect(missing_docs, reason = "a fuzz target")]

#[path = "../targets.rs"]
mod targets;

// A decompressor's panic that the reader catches is no crash; one that it lets pass still is.
libfuzzer_sys::fuzz_target!(init: { std::panic::set_hook(Box::new(|_| ())) }, |bytes: &[u8]| targets::exr(bytes));
