#!/bin/sh
# app/setup.sh [PART...]: installs by apt what is missing. Says nothing when nothing is missing.
#   run      what playing, the demo and all commands are built from and need
#   python   the Python module besides
#   test     what the tests need: both of these, browsers, DICOM tools, a cluster of one machine
#   web      what the page is built with, besides
#   browser  what tests of pages look at them with
#   develop  all but that, and what formats, checks, fuzzes and measures the code (the default)
set -eu

# Off-screen OpenGL by OSMesa, or where there is no such package any more, or SELDINGER_GL=egl asks for it, by EGL.
osmesa="libosmesa6-dev"
egl="libegl-dev libgl-dev libegl-mesa0 libgl1-mesa-dri"
run="
    g++ cmake ninja-build pkg-config
    libeigen3-dev libembree-dev libimgui-dev libglfw3-dev libglm-dev libassimp-dev libpugixml-dev libpng-dev libdeflate-dev zlib1g-dev libbz2-dev libnifti-dev libopenjp2-7-dev libdcmtk-dev libssl-dev libseccomp-dev
    libtomlplusplus-dev nlohmann-json3-dev libfmt-dev libcli11-dev
    fonts-dejavu-core
"
python="pybind11-dev python3-dev python3-numpy"
browser="chromium"
other_browser="firefox-esr python3-websockets"
tests="
    libgtest-dev libvalijson-dev xvfb libx11-dev libxtst-dev $browser dcmtk dicom3tools gnuplot-nox dpkg-dev lintian openssl
    python3-pytest python3-cloudpickle python3-jsonschema patchelf mypy slurmctld slurmd slurm-client zsh fish
"
# nodejs and node-acorn are what Emscripten runs on.
web="emscripten nodejs node-acorn"
tools="doxygen mkdocs mkdocs-material debootstrap clang-format clang-tidy clang libclang-rt-dev libbenchmark-dev"

fail() {
    printf 'setup: %s\n' "$1" >&2
    exit 2
}

[ $# -gt 0 ] || set -- develop
packages=""
for part in "$@"; do
    case $part in
    run) packages="$packages $run" ;;
    python) packages="$packages $run $python" ;;
    test) packages="$packages $run $python $tests" ;;
    web) packages="$packages $run $web" ;;
    browser) packages="$packages $browser $other_browser" ;;
    develop) packages="$packages $run $python $tests $tools" ;;
    *) fail "expected run, python, test, web, browser or develop, found '$part'" ;;
    esac
done

lacks() {
    for package in "$@"; do
        dpkg-query -W -f='${Status}\n' "$package" 2>/dev/null | grep -q '^install ok installed$' || printf '%s\n' "$package"
    done | sort -u | tr '\n' ' '
}
# Packages that apt does not know here. For toml++ its headers in /usr/local/include do (Ubuntu 22.04 has no package).
unknown() {
    for package in "$@"; do
        [ -n "$(apt-cache madison "$package" 2>/dev/null)" ] || printf '%s ' "$package"
    done
}
if [ -e /usr/local/include/toml++/toml.h ]; then
    run=$(printf '%s' "$run" | sed 's/libtomlplusplus-dev//')
    packages=$(printf '%s' "$packages" | sed 's/libtomlplusplus-dev//')
fi
missing() {
    gl=$osmesa
    if [ "${SELDINGER_GL:-}" = egl ]; then
        gl=$egl
    elif [ -n "$(lacks $osmesa)" ] && [ -n "${osmesa_is_gone:-}" ]; then
        gl=$egl
    fi
    lacks $packages $gl
}

if ! command -v dpkg-query >/dev/null 2>&1; then
    # Not a Debian: the build itself names what it does not find.
    command -v cmake >/dev/null 2>&1 || fail "neither apt nor cmake is here; Debian 12's names of what is needed: $(echo $packages)"
    exit 0
fi
# Where apt has its lists and none has OSMesa, EGL it is; without lists they are asked for first.
if ls /var/lib/apt/lists/*Packages* >/dev/null 2>&1 && [ -z "$(apt-cache madison $osmesa 2>/dev/null)" ]; then
    osmesa_is_gone=yes
fi
lacking=$(missing)
[ -n "$lacking" ] || exit 0

command -v apt-get >/dev/null 2>&1 || fail "apt-get is not to be had; install by hand: $lacking"
if [ "$(id -u)" = 0 ]; then
    as_root=""
elif command -v sudo >/dev/null 2>&1; then
    as_root="sudo"
else
    fail "apt-get needs root, and there is no sudo; as root run: apt-get install $lacking"
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
export DEBIAN_FRONTEND=noninteractive LC_ALL=C

printf 'setup: %s: asking for the packages' "$*"
if ! $as_root apt-get update >"$log" 2>&1; then
    printf '\n'
    tail -n 5 "$log" >&2
    fail "'apt-get update' failed (above); still missing: $lacking"
fi
if [ -z "$(apt-cache madison $osmesa 2>/dev/null)" ]; then
    osmesa_is_gone=yes
    lacking=$(missing)
    [ -n "$lacking" ] || exit 0
fi
strange=$(unknown $lacking)
[ -z "$strange" ] || fail "apt knows no package ${strange% } on this system; docs/install.md lists the systems that have all, and what to do on others"
# "Need to get 1,234 kB of archives." and "After this operation, 5,678 kB of additional disk space will be used."
plan=$(apt-get install --assume-no --no-install-recommends $lacking 2>/dev/null || true)
count=$(printf '%s\n' "$plan" | sed -n 's/^.* \([0-9]*\) newly installed.*/\1/p')
load=$(printf '%s\n' "$plan" | sed -n 's/^Need to get \(.*\) of archives\.$/\1/p')
room=$(printf '%s\n' "$plan" | sed -n 's/^After this operation, \(.*\) of additional disk space will be used\.$/\1/p')
printf '\nsetup: %s: %s packages, %s to load, %s on the disk: %s\n' "$*" "${count:-some}" "${load:-?}" "${room:-?}" "$lacking"

# apt reports its progress as "pmstatus:PACKAGE:PER CENT:WORDS" and "dlstatus:NUMBER:PER CENT:WORDS". It writes to the third
# descriptor, which sudo closes: there the packages are counted in its log by whoever wants to look.
show() {
    last=-1
    while IFS=: read -r kind _ part _; do
        case $kind in
        dlstatus) words="loading" ;;
        pmstatus) words="installing" ;;
        *) continue ;;
        esac
        part=${part%.*}
        if [ -t 1 ]; then
            printf '\rsetup: %-10s %3s %%' "$words" "$part"
        elif [ "$words $((part / 25))" != "$last" ]; then
            printf 'setup: %s %s %%\n' "$words" "$part"
        fi
        last="$words $((part / 25))"
    done
    [ ! -t 1 ] || printf '\r%30s\r' ""
}
code=$(mktemp)
{
    result=0
    if [ -z "$as_root" ]; then
        apt-get install -y --no-install-recommends -o APT::Status-Fd=3 $lacking 3>&1 >"$log" 2>&1 || result=$?
    else
        $as_root apt-get install -y --no-install-recommends $lacking >"$log" 2>&1 || result=$?
    fi
    echo "$result" >"$code"
} | show
result=$(cat "$code")
rm -f "$code"
if [ "$result" != 0 ]; then
    tail -n 15 "$log" >&2
    fail "'apt-get install' failed (above); still missing: $(missing)"
fi
