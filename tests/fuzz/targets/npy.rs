#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| isomorph_fuzz::shape("npy", bytes));
