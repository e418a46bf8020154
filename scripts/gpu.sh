#!/usr/bin/env bash
# Measures isomorph on the GPU of this machine: scripts/gpu.sh [OPTIONS OF gpu.py]
#
# Compares the GPU with the processor (isomorph self-test), measures a step of each size on both, trains
# data/fox/quick.toml and data/human/quick.toml on both, and writes table.md and data.json to
# scripts/results/gpu/NAME-OF-THE-GPU. Builds isomorph unless --binary names one. Takes about five minutes.
#
# Needs a Vulkan driver and its loader (Debian: libvulkan1), and Python 3.10.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
case " $* " in
*" --binary"* | *" --help "* | *" -h "* | *" --table"*) ;;
*) cargo build --release --locked ;;
esac
exec python3 scripts/gpu.py "$@"
