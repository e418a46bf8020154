#!/usr/bin/env bash
# Fuzzes everything that reads a file: scripts/fuzz.sh [SECONDS [TARGET...]]
#
# Each target runs for so long (default 30) on one core, as many side by side as there are cores, from the seeds in
# tests/fuzz/seeds. Inputs that fail are left in tests/fuzz/artifacts. At the end a table says how often each was
# executed. Exit status 1 if an input failed.
#
# Needs cargo-fuzz (cargo install cargo-fuzz). Without a sanitiser any Rust will do. A build takes some minutes on two
# cores.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../tests/fuzz"
seconds=${1:-30}
shift || true
all=$(sed -n 's/^path = "targets\/\(.*\)\.rs"$/\1/p' Cargo.toml)
targets=${*:-$all}
logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
# Safe Rust: what a sanitiser finds is not there to be found, and costs half of the speed.
cargo fuzz build --fuzz-dir . --sanitizer none
one() {
    local corpus=corpus/$2
    mkdir -p "$corpus" "artifacts/$2"
    # A file that makes a reader take over half a gigabyte, or ten seconds, is a fault too.
    "target/$(rustc -vV | sed -n 's/^host: //p')/release/$2" "$corpus" "seeds/$2" \
        -max_total_time="$1" -max_len=20000 -timeout=10 -rss_limit_mb=1024 -malloc_limit_mb=512 \
        -artifact_prefix="artifacts/$2/" -print_final_stats=1 >"$3/$2" 2>&1 || echo "failed" >>"$3/$2"
    rm -rf "/dev/shm/isomorph-fuzz-"* 2>/dev/null || true
}
export -f one
# shellcheck disable=SC2086
printf '%s\n' $targets | xargs -P "$(nproc)" -I{} bash -c "one $seconds {} $logs"
failed=0
printf '| target | executions | result |\n|---|---|---|\n'
for target in $targets; do
    count=$(sed -n 's/^stat::number_of_executed_units: *//p' "$logs/$target")
    result=ok
    if grep -q '^failed$' "$logs/$target"; then
        result=FAILED
        failed=1
        # What failed first, then what the fuzzer says of it.
        grep -m1 -A2 'panicked at' "$logs/$target" >&2 || true
        grep -E '^ +at ' "$logs/$target" | grep -v '/registry/\|/rustc/' | head -10 >&2 || true
        tail -12 "$logs/$target" >&2
    fi
    printf '| %s | %s | %s |\n' "$target" "${count:-0}" "$result"
done
exit $failed
