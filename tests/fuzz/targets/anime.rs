#![no_main]

use isomorph::evaluation::GroundTruth;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let path = isomorph_fuzz::written("frames.anime", bytes);
    match GroundTruth::read(&path) {
        Err(error) => isomorph_fuzz::one_line(&error.to_string(), "frames.anime"),
        Ok(truth) => {
            let numbers = truth.frame_count() * truth.vertices(0).len();
            assert!(numbers <= bytes.len(), "larger than its file");
        }
    }
});
