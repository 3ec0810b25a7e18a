#!/bin/bash
# tests/wheels.sh [SYSTEM...]: makes portable wheels (app/python/wheel.py --portable) for the CPythons of other systems, unpacks
# each in a bare chroot of its system, with NumPy and nothing else of what Seldinger needs, and runs it there: two exercises of
# 100 steps, whose states must equal those of this machine's build where glibc is 2.35 or newer (on 2.31 they do not), images,
# which may differ by two grey levels, for Mesa and its LLVM are older, and an environment. Needs root, debootstrap, patchelf and
# build/python.
#   SYSTEM   bullseye, bookworm, trixie (Debian 11, 12, 13: CPython 3.9, 3.11, 3.13), jammy, noble (Ubuntu 22.04, 24.04: CPython
#            3.10, 3.12; systems.sh says which keys they need); by default bullseye
# The chroots are kept in build/systems for the next time, the wheels in build/wheels. Ends with 77 where it cannot run.
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# -gt 0 ] || set -- bullseye
folder=$PWD/build/systems
debian=${SELDINGER_DEBIAN_MIRROR:-http://deb.debian.org/debian}
ubuntu=${SELDINGER_UBUNTU_MIRROR:-http://archive.ubuntu.com/ubuntu}
ubuntu_keys=${SELDINGER_UBUNTU_KEYS:-/usr/share/keyrings/ubuntu-archive-keyring.gpg}
fail() {
    printf 'wheels: %s\n' "$1" >&2
    exit 1
}
cannot() {
    printf 'wheels: %s\n' "$1" >&2
    exit 77
}
[ "$(id -u)" = 0 ] || cannot "expected root, which chroots need; found user $(id -un)"
for tool in debootstrap patchelf; do command -v $tool >/dev/null || cannot "$tool was not found: apt-get install $tool"; done
ls build/python/seldinger/_core*.so >/dev/null 2>&1 || cannot "build/python holds no module; ./app/python.sh builds it"
mkdir -p "$folder"

inside() { chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin "$@"; }
pythons=()
for system in "$@"; do
    root=$folder/$system-numpy
    if [ ! -d "$root" ]; then
        rm -rf "$root.new"
        case $system in
        bullseye | bookworm | trixie) debootstrap --variant=minbase --include=python3-numpy "$system" "$root.new" "$debian" >"$root.log" 2>&1 ;;
        jammy | noble)
            [ -f "$ubuntu_keys" ] || cannot "$ubuntu_keys was not found, and so $system's packages can't be checked"
            debootstrap --variant=minbase --include=python3-numpy --keyring="$ubuntu_keys" --components=main,universe \
                "$system" "$root.new" "$ubuntu" gutsy >"$root.log" 2>&1
            ;;
        *) fail "expected bullseye, bookworm, trixie, jammy or noble; found '$system'" ;;
        esac || cannot "no chroot: $root.log"
        mv "$root.new" "$root"
    fi
    version=$(inside python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    if [ ! -d "$folder/headers/usr/include/python$version" ]; then
        # Of its package of headers nothing is installed.
        (cd "$root/tmp" && rm -f ./*.deb && inside sh -c "cd /tmp && apt-get -qq update && apt-get -qq download libpython$version-dev" >>"$root.log" 2>&1) ||
            cannot "no headers of CPython $version: $root.log"
        dpkg-deb -x "$root"/tmp/libpython*.deb "$folder/headers"
    fi
    pythons+=(--python "$folder/headers/usr/include/python$version")
done

rm -rf build/wheels
/usr/bin/python3 app/python/wheel.py --portable --out build/wheels "${pythons[@]}" >build/wheels.log || fail "no wheels"
cat >"$folder/try.py" <<'TRY'
import ctypes, hashlib, os, sys
import numpy as np
ctypes.CDLL("libstdc++.so.6")  # the system's, as other modules bring it, beside the wheel's
import seldinger as sd
folder = sys.argv[1]
for name in ("s_bend", "renal"):
    with sd.Simulation(name, cache=folder + "/cache") as sim:
        hashes = [sim.step(advance_mm=2, rotate_deg=7).hash for _ in range(100)]
        np.save(f"{folder}/{name}.npy", np.stack([sim.image(256), sim.masks(256)["vessels"]]))
        print(name, hashlib.sha256(repr(hashes).encode()).hexdigest()[:16])
env = sd.gym.make("seldinger/Renal-v1", cache=folder + "/cache")
env.reset(seed=1)
print("environment", env.step(env.action_space.high)[4]["hash"])
try:
    sd.Simulation("nothing")
except ValueError as error:  # raised in C++
    print(type(error).__name__, error)
loaded = {line.split()[-1] for line in open("/proc/self/maps") if ".so" in line}
ours = {path for path in loaded if "/seldinger.libs/" in path}
print(f"CPython {sys.version.split()[0]}, NumPy {np.__version__}, {os.confstr('CS_GNU_LIBC_VERSION')}, {len(ours)} libraries of the wheel",
      file=sys.stderr)
TRY
rm -rf "$folder/native"
mkdir "$folder/native"
PYTHONPATH=build/python PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 "$folder/try.py" "$folder/native" >"$folder/native.txt" 2>/dev/null || fail "this machine's build failed"
for system in "$@"; do
    root=$folder/$system-numpy
    tag=$(inside python3 -c 'import sys; print("cp%d%d" % sys.version_info[:2])')
    wheel=$(ls build/wheels/*-"$tag"-manylinux_2_28_*.whl) || fail "expected a wheel for glibc 2.28 and $tag, found $(ls build/wheels)"
    rm -rf "$root/opt" "$root/root"
    mkdir "$root/opt" "$root/root"
    python3 -m zipfile -e "$wheel" "$root/opt"
    cp "$folder/try.py" "$root/root"
    mountpoint -q "$root/proc" || mount -t proc proc "$root/proc"
    code=0
    inside PYTHONPATH=/opt python3 /root/try.py /root >"$folder/$system.txt" 2>"$folder/$system.err" || code=$?
    umount "$root/proc"
    [ "$code" = 0 ] || { tail -n 5 "$folder/$system.err" >&2; fail "$system: it ended with $code"; }
    glibc=$(inside ldd --version | sed -n '1s/.* //p')
    equal=$(comm -12 <(sort "$folder/native.txt") <(sort "$folder/$system.txt") | wc -l)
    [ "$(cut -d' ' -f1 "$folder/$system.txt")" = "$(cut -d' ' -f1 "$folder/native.txt")" ] || fail "$system: other lines"
    [ "$equal" = 4 ] || [ "$(printf '%s\n2.35\n' "$glibc" | sort -V | head -n 1)" != 2.35 ] ||
        { diff "$folder/native.txt" "$folder/$system.txt"; fail "$system: states differ"; }
    /usr/bin/python3 - "$folder/native" "$root/root" <<'COMPARE' || fail "$system: images differ"
import sys
import numpy as np
for name in ("s_bend", "renal"):
    here, there = (np.load(f"{folder}/{name}.npy").astype(int) for folder in sys.argv[1:])
    away = abs(here - there)
    print(f"{name}: {(away[0] > 0).sum()} of {away[0].size} pixels differ, by {away[0].max()} grey levels at most; "
          f"{(away[1] > 0).sum()} of the mask")
    assert away[0].max() <= 2 and (away[1] > 0).sum() < 50
COMPARE
    printf '%s: %s; %s of 4 answers are equal to those of this machine: %s\n' "$system" "$(cat "$folder/$system.err")" "$equal" \
        "$(basename "$wheel")"
done
