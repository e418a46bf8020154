#![no_main]

// The bytes are the recipe, the metrics and the state of a checkpoint, divided by zeros.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let mut parts = bytes.split(|byte| *byte == 0);
    let recipe = isomorph_fuzz::written("run/recipe.toml", parts.next().unwrap_or_default());
    let files = [
        "run/metrics.jsonl",
        "run/checkpoints/step-000020/state.json",
    ];
    for file in files {
        isomorph_fuzz::written(file, parts.next().unwrap_or_default());
    }
    let run = recipe.parent().expect("it lies in a folder");
    // Sentences or none: no panic.
    let _ = isomorph::describe(run).map_err(|error| assert!(!error.to_string().is_empty()));
    let _ = isomorph::current_report(run).map_err(|error| assert!(!error.to_string().is_empty()));
});
