#!/bin/bash
# tests/systems.sh [SYSTEM/GL[/COMPILER]...]: builds Seldinger on other systems, in chroots made by debootstrap, and compares what
# it computes there with what it computes here: states and scores of a whole exercise, which must be equal, and its images,
# which may differ by two grey levels, for Mesa's versions round differently. Needs root, debootstrap,
# some 3 GB and ten minutes a system; chroots are kept in build/systems for the next time.
#   SYSTEM    bookworm, trixie, sid (Debian 12, 13, unstable), jammy, noble (Ubuntu 22.04, 24.04)
#   GL        osmesa or egl
#   COMPILER  g++, or clang++ of the system
# Without arguments: bookworm/egl/clang++ trixie/osmesa trixie/egl sid/egl noble/osmesa jammy/osmesa.
# Ubuntu's need its keys, from the package ubuntu-keyring (of Debian 13 or later; it can be unpacked on any) or in the file
# SELDINGER_UBUNTU_KEYS.
set -euo pipefail
cd "$(dirname "$0")/.."
source=$PWD
folder=$source/build/systems
debian=${SELDINGER_DEBIAN_MIRROR:-http://deb.debian.org/debian}
ubuntu=${SELDINGER_UBUNTU_MIRROR:-http://archive.ubuntu.com/ubuntu}
ubuntu_keys=${SELDINGER_UBUNTU_KEYS:-/usr/share/keyrings/ubuntu-archive-keyring.gpg}
fail() {
    printf 'systems: %s\n' "$1" >&2
    exit 2
}
[ "$(id -u)" = 0 ] || fail "expected root, which chroots need; found user $(id -un)"
command -v debootstrap >/dev/null || fail "debootstrap was not found: apt-get install debootstrap"
[ $# -gt 0 ] || set -- bookworm/egl/clang++ trixie/osmesa trixie/egl sid/egl noble/osmesa jammy/osmesa
for wanted in "$@"; do
    [[ $wanted =~ ^(bookworm|trixie|sid|jammy|noble)/(osmesa|egl)(/(g|clang)\+\+)?$ ]] ||
        fail "expected SYSTEM/GL or SYSTEM/GL/COMPILER of bookworm, trixie, sid, jammy, noble; osmesa, egl; g++, clang++; found '$wanted'"
done
mkdir -p "$folder"

# In the chroot, with nothing of this machine's environment.
inside() { # COMMAND
    chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin SELDINGER_GL="$gl" CXX="$compiler" CC="$c_compiler" sh -c "$1"
}

make_chroot() { # SYSTEM
    case $1 in
    bookworm | trixie | sid) debootstrap --variant=minbase "$1" "$folder/$1.new" "$debian" ;;
    *)
        [ -f "$ubuntu_keys" ] || fail "$ubuntu_keys was not found, and so $1's packages can't be checked"
        # All of Ubuntu's releases are set up alike; an older debootstrap does not name the later ones.
        debootstrap --variant=minbase --keyring="$ubuntu_keys" --components=main,universe "$1" "$folder/$1.new" "$ubuntu" gutsy
        ;;
    esac
    # A mirror's copy of unstable may be older than its signature lasts.
    echo 'Acquire::Check-Valid-Until "false";' >"$folder/$1.new/etc/apt/apt.conf.d/90stale"
    mv "$folder/$1.new" "$folder/$1"
}

# One exercise: its states, score and images, in OUT.
play() { # PROGRAM ASSETS OUT
    rm -rf "$3"
    "$1" run renal --commands "$2/scripts/renal.gw" --out "$3" --cache "$3.cache" >"$3.txt" 2>&1
}
states() { grep '^state ' "$1/run.gw" | sha256sum | cut -c 1-12; }
images() { python3 tests/frame_difference.py "$folder/here/frames" "$1/frames" || true; } # differing frames, grey levels
score() { grep -v '"program' "$1/score.json" | sha256sum | cut -c 1-12; }

./app/build.sh release seldinger
play build/release/bin/seldinger assets "$folder/here" || fail "the exercise failed here: $folder/here.txt"
printf '%-24s %-10s %-8s %-8s %-8s %-8s %-13s %-13s %-13s\n' system compiler Embree ImGui set-up build states score images
printf '%-24s %-10s %-8s %-8s %-8s %-8s %-13s %-13s %-13s\n' "(here)" "$(g++ -dumpfullversion)" \
    "$(dpkg-query -W -f='${Version}' libembree-dev | cut -d+ -f1)" "$(pkg-config --modversion imgui)" - - \
    "$(states "$folder/here")" "$(score "$folder/here")" equal

bad=0
for wanted in "$@"; do
    IFS=/ read -r system gl compiler <<<"$wanted/g++"
    compiler=${compiler%%/*}
    c_compiler=clang
    [ "$compiler" = clang++ ] || c_compiler=gcc
    root=$folder/$system
    log=$folder/${wanted//\//-}.log
    if [ ! -d "$root" ]; then
        rm -rf "$root.new"
        make_chroot "$system" >"$log" 2>&1 || { tail -n 3 "$log" >&2; printf '%-24s no chroot: %s\n' "$wanted" "$log"; bad=1; continue; }
    fi
    # What is committed, as somebody who clones it would have it.
    rm -rf "$root/seldinger/source"
    mkdir -p "$root/seldinger/source"
    git archive HEAD | tar -x -C "$root/seldinger/source"
    if [ "$system" = jammy ]; then # which has no package of toml++: its headers, as docs/install.md says
        mkdir -p "$root/usr/local/include"
        cp -r /usr/include/toml++ "$root/usr/local/include"
    fi
    mountpoint -q "$root/proc" || mount -t proc proc "$root/proc"
    trap 'umount "$root/proc" 2>/dev/null || true' EXIT
    start=$SECONDS
    if ! inside "cd /seldinger/source && ./app/setup.sh run && case \$CXX in clang++) apt-get install -y --no-install-recommends clang;; esac" >"$log" 2>&1; then
        printf '%-24s set-up: %s\n' "$wanted" "$(tail -n 1 "$log")"
        umount "$root/proc"
        bad=1
        continue
    fi
    setup=$((SECONDS - start)) start=$SECONDS
    if ! inside "cd /seldinger/source && rm -rf ../build-$gl && cmake --preset release -B ../build-$gl -DSELDINGER_GL=$gl -DSELDINGER_TESTS=OFF -DSELDINGER_PYTHON=OFF && ninja -C ../build-$gl seldinger" >>"$log" 2>&1; then
        printf '%-24s build: %s\n' "$wanted" "$(grep -m 1 'error:\|CMake Error' "$log" || tail -n 1 "$log")"
        umount "$root/proc"
        bad=1
        continue
    fi
    build=$((SECONDS - start))
    inside "rm -rf /seldinger/out /seldinger/cache; cd /seldinger && build-$gl/bin/seldinger run renal --commands source/assets/scripts/renal.gw --out out --cache cache" >>"$log" 2>&1 || true
    out=$root/seldinger/out
    if [ -f "$out/score.json" ]; then
        printf '%-24s %-10s %-8s %-8s %-8s %-8s %-13s %-13s %-13s' "$wanted" "$(inside "\$CXX -dumpversion")" \
            "$(inside "dpkg-query -W -f='\${Version}' libembree-dev" | cut -d+ -f1)" "$(inside "pkg-config --modversion imgui")" \
            "$setup s" "$build s" "$(states "$out")" "$(score "$out")" "$(images "$out")"
        if [ "$(states "$out") $(score "$out")" = "$(states "$folder/here") $(score "$folder/here")" ] &&
            python3 tests/frame_difference.py "$folder/here/frames" "$out/frames" >/dev/null; then
            printf ' as here\n'
        else
            printf ' DIFFERENT\n'
            bad=1
        fi
    else
        printf '%-24s run: %s\n' "$wanted" "$(tail -n 1 "$log")"
        bad=1
    fi
    umount "$root/proc"
done
exit $bad
