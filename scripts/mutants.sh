#!/usr/bin/env bash
# Changes the program, one operator or result at a time, and says which changes no test notices:
#
#   scripts/mutants.sh PACKAGE TESTS FILE... [-- OPTION...]
#   scripts/mutants.sh isomorph-model "loss:: operators::" 'model/src/loss/*.rs' 'model/src/operators/*.rs'
#   scripts/mutants.sh isomorph-training schedule src/training/schedule.rs
#   scripts/mutants.sh isomorph formats:: 'src/formats/**/*.rs' -- --shard 0/16
#
# TESTS are parts of the names of the tests that are run; options are those of cargo mutants. It works on a copy of the
# sources. What it finds is left in target/mutants/mutants.out.
#
# Needs cargo-mutants (cargo install cargo-mutants). The first change takes minutes, each further one 2 to 15 seconds.
set -euo pipefail
(($# >= 3)) || {
    sed -n '2,/^set/{/^#/p}' "$0" >&2
    exit 2
}
cd "$(dirname "${BASH_SOURCE[0]}")/.."
package=$1 tests=$2
shift 2
files=()
while (($#)) && [[ $1 != -- ]]; do
    files+=(--file "$1")
    shift
done
[[ ${1:-} != -- ]] || shift
# The package itself without optimisation, in many units, and what it builds on as in a release: quick to build again,
# and the tests take seconds.
export CARGO_PROFILE_MUTANTS_INHERITS=release CARGO_PROFILE_MUTANTS_INCREMENTAL=true CARGO_TARGET_DIR=$PWD/target/mutants
quick=()
for option in --config "profile.mutants.package.$package.codegen-units=256" \
    --config "profile.mutants.package.$package.opt-level=0"; do
    quick+=(-C "$option")
done
# shellcheck disable=SC2086
cargo mutants --profile mutants "${quick[@]}" --package "$package" --baseline skip --timeout 120 \
    --build-timeout 1200 --output target/mutants "${files[@]}" "$@" -- --lib -- $tests
