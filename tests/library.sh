#!/bin/sh
# library.sh BUILD SOURCE: installs the libraries of the build folder elsewhere, builds the examples against them as another
# project would, and compares what they print with what they must.
set -eu
build=$1
source=$2
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
step() {
    "$@" >"$scratch/log" 2>&1 || { tail -n 40 "$scratch/log" >&2; printf 'library: %s failed\n' "$*" >&2; exit 1; }
}
step cmake --install "$build" --prefix "$scratch/prefix"
# Without the source's assets.
unset SELDINGER_ASSETS
step cmake -G Ninja -S "$source/examples" -B "$scratch/examples" -DCMAKE_PREFIX_PATH="$scratch/prefix"
step cmake --build "$scratch/examples"
step ctest --test-dir "$scratch/examples" --output-on-failure --no-tests=error
