#!/usr/bin/env bash
# Builds the wheel for Python and tries it: scripts/wheels.sh [FOLDER]
#
# The wheel is for Linux with glibc 2.17 or later (manylinux2014) and any CPython from 3.10 on. It uses the processor
# alone; vector instructions are chosen when it runs. It goes to FOLDER (default: target/wheels). Then it is installed
# into an empty virtual environment, where Rust is out of reach, and the example of the README's section on Python runs.
#
# Needs Rust and Python 3.10 with venv; maturin and zig come from PyPI. Takes about ten minutes on two cores.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder=$(realpath -m "${1:-target/wheels}")
tools=target/wheel-tools
[[ -x $tools/bin/maturin && -x $tools/bin/python ]] || python3 -m venv "$tools"
"$tools/bin/pip" install --quiet 'maturin==1.16.*' 'ziglang==0.17.*'
export PATH=$PWD/$tools/bin:$PATH
rm -f "$folder"/isomorph-*.whl
maturin build --release --locked --zig --compatibility manylinux2014 --interpreter python3 --out "$folder"
wheel=$(ls "$folder"/isomorph-*.whl)

place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
start=$SECONDS
"$place/venv/bin/pip" install --quiet "$wheel"
echo "installed in $((SECONDS - start)) s: $(basename "$wheel"), $(($(stat --format %s "$wheel") / 1000)) kB"
cp data/fox/source.ply data/fox/target.ply "$place"
cat >"$place/example.py" <<'PYTHON'
import isomorph

run = isomorph.morph("source.ply", "target.ply")
vertices, faces = run.surface(t=0.5)
moved = run.carry(vertices, start=0.5, end=1.0)
run.save_glb("motion.glb")
print(f"{len(vertices)} vertices and {len(faces)} faces at t = 0.5; {run}")
PYTHON
(cd "$place" && env -i HOME="$place" PATH=/usr/bin:/bin venv/bin/python example.py && ls -l motion.glb)
