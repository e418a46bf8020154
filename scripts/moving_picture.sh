#!/bin/sh
# The moving picture of the README, data/fox/animation.png: the sample fox by the first command of the README,
# without its pairs, and 21 surfaces of it.
#
#     sh scripts/moving_picture.sh [ISOMORPH]
#
# ISOMORPH is the program, target/release/isomorph without it. It takes about 20 seconds on two cores.
set -eu
cd "$(dirname "$0")/.."
isomorph=${1:-target/release/isomorph}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$isomorph" morph data/fox/source.ply data/fox/target.ply --frames 2 --quiet -o "$work/run" >/dev/null
"$isomorph" extract "$work/run" --frames 21 --resolution 192 --film --quiet -o "$work/surfaces" >/dev/null
mv "$work/surfaces/animation.png" data/fox/animation.png
ls -l data/fox/animation.png
