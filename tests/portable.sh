#!/bin/bash
# tests/portable.sh [SYSTEM]: makes the portable archive (cpack -G TGZ), unpacks it in a bare chroot of an older system, with
# nothing of what Seldinger needs, and runs it there: an exercise, whose states, score and images must equal those of this
# machine's build, a study, and the room on a virtual display of this machine. Needs root, debootstrap, Xvfb; 1 GB, 3 minutes.
#   SYSTEM   bullseye (Debian 11, glibc 2.31; the default) or another release of Debian
# The chroot is kept in build/systems for the next time.
set -euo pipefail
cd "$(dirname "$0")/.."
system=${1:-bullseye}
folder=$PWD/build/systems
fail() {
    printf 'portable: %s\n' "$1" >&2
    exit 1
}
[ "$(id -u)" = 0 ] || fail "expected root, which chroots need; found user $(id -un)"
command -v debootstrap >/dev/null || fail "debootstrap was not found: apt-get install debootstrap"
mkdir -p "$folder"
root=$folder/$system-bare
if [ ! -d "$root" ]; then
    rm -rf "$root.new"
    debootstrap --variant=minbase "$system" "$root.new" "${SELDINGER_DEBIAN_MIRROR:-http://deb.debian.org/debian}" >"$root.log" 2>&1 ||
        fail "no chroot: $root.log"
    mv "$root.new" "$root"
fi

./app/build.sh release seldinger seldinger-study
(cd build/release && cpack -G TGZ) >build/portable.log 2>&1 || { tail -n 5 build/portable.log >&2; fail "cpack failed"; }
archive=$(ls -t build/release/seldinger-*.tar.gz | head -n 1)
rm -rf "$root/opt" "$root/root"
mkdir "$root/opt" "$root/root"
tar -xzf "$archive" -C "$root/opt" --strip-components=1
inside() { chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/bin:/bin "$@"; }
mountpoint -q "$root/proc" || mount -t proc proc "$root/proc"
trap 'kill $(jobs -p) 2>/dev/null; umount "$root/tmp/.X11-unix" 2>/dev/null; umount "$root/proc"' EXIT
printf '%s: %s; %s in %s, glibc %s, %s packages\n' "$archive" "$(du -h "$archive" | cut -f1) packed, $(du -sh "$root/opt" | cut -f1) unpacked" \
    "$(inside /opt/bin/seldinger --version)" "$system" "$(inside ldd --version | sed -n '1s/.* //p')" "$(inside dpkg-query -W | wc -l)"

# Everything that a program loads is the archive's own.
inside LD_DEBUG=files /opt/lib/ld-linux-x86-64.so.2 --library-path /opt/lib /opt/lib/seldinger.bin list 2>&1 >/dev/null | sed -n 's/.*calling init: \(\/.*\)/\1/p' | sort -u >build/portable.libraries
grep -q /opt/lib/ build/portable.libraries || fail "expected the libraries of the archive to be loaded, found none"
! grep -v '^/opt/' build/portable.libraries || fail "these libraries are the system's"

rm -rf build/portable
build/release/bin/seldinger run renal --commands assets/scripts/renal.gw --out build/portable --cache build/cache >/dev/null 2>&1
inside /opt/bin/seldinger run renal --commands /opt/share/seldinger/scripts/renal.gw --out /root/out --cache /root/cache >"$root.txt" 2>&1 ||
    { tail -n 3 "$root.txt" >&2; fail "the exercise failed"; }
cmp <(grep '^state ' build/portable/run.gw) <(grep '^state ' "$root/root/out/run.gw") || fail "states differ"
cmp <(grep -v '"program' build/portable/score.json) <(grep -v '"program' "$root/root/out/score.json") || fail "scores differ"
diff -rq build/portable/frames "$root/root/out/frames" || fail "images differ"
printf 'renal: %s states, the score and %s images are equal to those of this build\n' "$(grep -c '^state ' build/portable/run.gw)" "$(ls build/portable/frames | wc -l)"
inside /opt/bin/seldinger study separation --quick --out /root/study >/dev/null 2>&1 || fail "the study failed"
[ -s "$root/root/study/separation.md" ] || fail "the study has written no page"

if command -v Xvfb >/dev/null; then
    Xvfb :93 -screen 0 1280x800x24 >/dev/null 2>&1 &
    mkdir -p "$root/tmp/.X11-unix"
    for _ in $(seq 100); do [ -S /tmp/.X11-unix/X93 ] && break || sleep 0.1; done
    mount --bind /tmp/.X11-unix "$root/tmp/.X11-unix"
    # The recording is played in the window, which stays until it is told to close.
    code=0
    inside DISPLAY=:93 timeout 30 /opt/bin/seldinger play --replay /root/out/run.gw --cache /root/cache >"$root.play.txt" 2>&1 || code=$?
    [ "$code" = 124 ] || { tail -n 3 "$root.play.txt" >&2; fail "expected the room to stay open for 30 s, it ended with $code"; }
    printf 'room: open for 30 s\n'
fi
