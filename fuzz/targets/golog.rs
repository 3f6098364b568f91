#![no_main]
#![allow(missing_docs, reason = "it is in the library's module of that name")]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| slate_fuzz::golog::run(bytes));
