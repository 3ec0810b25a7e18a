#!/bin/sh
# Installs what Seldinger is built from, by apt, where it is missing. Says nothing when nothing is to do.
set -eu

packages="
    g++ cmake ninja-build pkg-config
    libeigen3-dev libembree-dev libosmesa6-dev libimgui-dev libglfw3-dev libglm-dev libassimp-dev libpugixml-dev libpng-dev libdeflate-dev zlib1g-dev libnifti-dev libdcmtk-dev
    libtomlplusplus-dev nlohmann-json3-dev libfmt-dev libcli11-dev
    libgtest-dev libvalijson-dev libbenchmark-dev xvfb libx11-dev libxtst-dev chromium dcmtk clang-format clang-tidy gnuplot-nox fonts-dejavu-core dpkg-dev
    pybind11-dev python3-dev python3-numpy python3-pytest python3-cloudpickle
    slurmctld slurmd slurm-client
    clang libclang-rt-14-dev
"

missing() {
    for package in $packages; do
        dpkg-query -W -f='${Status}\n' "$package" 2>/dev/null | grep -q '^install ok installed$' || printf ' %s' "$package"
    done
}

fail() {
    printf 'setup: %s\n' "$1" >&2
    exit 2
}

if ! command -v dpkg-query >/dev/null 2>&1; then
    # Not a Debian: the build itself names what it does not find.
    command -v cmake >/dev/null 2>&1 || fail "neither apt nor cmake is here; Debian 12's names of what is needed: $(echo $packages)"
    exit 0
fi
lacking=$(missing)
[ -n "$lacking" ] || exit 0

printf 'setup: installing%s\n' "$lacking"
command -v apt-get >/dev/null 2>&1 || fail "apt-get is not to be had; install by hand:$lacking"
if [ "$(id -u)" = 0 ]; then
    as_root=""
elif command -v sudo >/dev/null 2>&1; then
    as_root="sudo"
else
    fail "apt-get needs root, and there is no sudo; as root run: apt-get install$lacking"
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
export DEBIAN_FRONTEND=noninteractive
if ! $as_root apt-get update >"$log" 2>&1; then
    tail -n 5 "$log" >&2
    fail "'apt-get update' failed (above); still missing:$lacking"
fi
if ! $as_root apt-get install -y --no-install-recommends $lacking >"$log" 2>&1; then
    tail -n 15 "$log" >&2
    fail "'apt-get install' failed (above); still missing:$(missing)"
fi
