#!/usr/bin/env bash
# Builds what a release consists of, and tries each part: scripts/wheels.sh [FOLDER]
#
#   isomorph-VERSION.tar.gz                  the sources, from which all else is built
#   isomorph-VERSION-cp310-abi3-*.whl        the package for Python: any CPython from 3.10 on
#   isomorph-VERSION-x86_64-linux.tar.gz     the program, with completions for shells and manual pages
#
# All is for Linux with glibc 2.17 or later (manylinux2014). Vector instructions are chosen when it runs, and the GPU's
# part loads Vulkan only where it is used. Files go to FOLDER (default: target/wheels). Then, where Rust is out of reach,
# the program runs, the wheel is installed into an empty virtual environment, and the example of the README's section on
# Python runs.
#
# Needs Rust, binutils and Python 3.10 with venv; maturin, cargo-zigbuild and zig come from PyPI. Takes 18 minutes on two
# cores of an AMD EPYC, 2026-11-28.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
folder=$(realpath -m "${1:-target/wheels}")
tools=$root/target/wheel-tools
[[ -x $tools/bin/maturin && -x $tools/bin/cargo-zigbuild && -x $tools/bin/python ]] || python3 -m venv "$tools"
"$tools/bin/pip" install --quiet 'maturin==1.16.*' 'cargo-zigbuild==0.24.*' 'ziglang==0.17.*'
export PATH=$tools/bin:$PATH CARGO_TARGET_DIR=$root/target/wheel-build
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
size_of() { echo "$(basename "$1"): $(($(stat --format %s "$1") / 1000)) kB"; }

mkdir -p "$folder"
rm -f "$folder"/isomorph-*
maturin sdist --out "$folder"
sources=$(ls "$folder"/isomorph-*.tar.gz)
size_of "$sources"
# One place, so that what is built already is not built again.
rm -rf "$CARGO_TARGET_DIR/sources"
mkdir -p "$CARGO_TARGET_DIR/sources"
tar -xzf "$sources" --strip-components 1 -C "$CARGO_TARGET_DIR/sources"
cd "$CARGO_TARGET_DIR/sources"
maturin build --release --locked --zig --compatibility manylinux2014 --interpreter python3 --out "$folder"
cargo-zigbuild zigbuild --release --locked --target x86_64-unknown-linux-gnu.2.17 --bin isomorph
cd "$root"

version=$(basename "$sources" .tar.gz)
kit=$place/$version-x86_64-linux
mkdir -p "$kit/completions"
cp "$CARGO_TARGET_DIR/x86_64-unknown-linux-gnu/release/isomorph" README.md LICENSE-* CHANGELOG.md "$kit"
strip "$kit/isomorph"
"$kit/isomorph" man --output "$kit/man/man1"
"$kit/isomorph" completions bash >"$kit/completions/isomorph.bash"
"$kit/isomorph" completions zsh >"$kit/completions/_isomorph"
"$kit/isomorph" completions fish >"$kit/completions/isomorph.fish"
tar -czf "$folder/$(basename "$kit").tar.gz" -C "$place" "$(basename "$kit")"
size_of "$folder/$(basename "$kit").tar.gz"
newest=$(objdump -T "$kit/isomorph" | grep -o 'GLIBC_[0-9.]*' | sort --version-sort --unique | tail -n 1)
[[ $(printf '%s\n' "$newest" GLIBC_2.17 | sort --version-sort | tail -n 1) == GLIBC_2.17 ]] || {
    echo "$kit/isomorph: needs $newest; GLIBC_2.17 is the oldest that is promised" >&2
    exit 1
}

# Each in a place without Rust.
bare() { env -i HOME="$place" PATH=/usr/bin:/bin "$@"; }
cp data/fox/source.ply data/fox/target.ply "$place"
tar -xzf "$folder/$(basename "$kit").tar.gz" -C "$place"
(cd "$place" && bare "./$(basename "$kit")/isomorph" morph source.ply target.ply --output of-program)
wheel=$(ls "$folder"/isomorph-*.whl)
size_of "$wheel"
python3 -m venv "$place/venv"
start=$SECONDS
"$place/venv/bin/pip" install --quiet "$wheel"
echo "installed in $((SECONDS - start)) s"
cat >"$place/example.py" <<'PYTHON'
import isomorph

run = isomorph.morph("source.ply", "target.ply")
vertices, faces = run.surface(t=0.5)
moved = run.carry(vertices, start=0.5, end=1.0)
run.save_glb("motion.glb")
print(f"{len(vertices)} vertices and {len(faces)} faces at t = 0.5; {run}")
PYTHON
(cd "$place" && bare venv/bin/python example.py && ls -l motion.glb)
