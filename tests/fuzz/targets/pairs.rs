#![no_main]

use isomorph::Shape;
use isomorph::correspondence::known_pairs;

// The first byte chooses the kind of file.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((kind, bytes)) = bytes.split_first() else {
        return;
    };
    let name = ["pairs.csv", "pairs.npy", "pairs.vts", "pairs.txt"][usize::from(*kind) % 4];
    let path = isomorph_fuzz::written(name, bytes);
    let corner = |k: i32| [k, k * k % 7, k % 3].map(f64::from);
    let shape = Shape::cloud((0..20).map(corner).collect());
    match known_pairs(&path, &[&shape, &shape, &shape, &shape]) {
        Err(error) => isomorph_fuzz::one_line(&error.to_string(), name),
        Ok(count) => assert!(count <= 3 * bytes.len().max(20), "larger than its file"),
    }
});
