#![no_main]

use isomorph::Recipe;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let path = isomorph_fuzz::written("recipe.toml", bytes);
    // What is accepted is printed, read again, and the same.
    if let Ok(recipe) = Recipe::read(&path, &[]) {
        let printed = recipe.to_toml();
        let again = isomorph_fuzz::written("again.toml", printed.as_bytes());
        let again = Recipe::read(&again, &[]).expect("what is printed is read");
        assert_eq!(again.to_toml(), printed);
    }
});
