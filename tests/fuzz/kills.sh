#!/bin/bash
# tests/fuzz/kills.sh [COUNT [SEED [PROGRAM]]]: ends commands at random moments by SIGKILL, SIGTERM and SIGINT, each with
# a cold cache. What is left must be valid, and the next whole run must give what a run gives that nobody disturbed, with
# nothing left over. Then several commands share one cache. Not part of any test run: COUNT = 50 takes some minutes.
set -u
cd "$(dirname "$0")/../.."
count=${1:-50} seed=${2:-$(date +%s)} program=$(realpath "${3:-build/release/bin/seldinger}")
[ -x "$program" ] || { echo "kills: $program: no such program; ./app/build.sh release builds it" >&2; exit 2; }
RANDOM=$((seed % 32768))
echo "kills: $count kills, seed $seed"
work=$(mktemp -d "${TMPDIR:-/tmp}/seldinger-kills-XXXXXX")
trap 'rm -rf "$work"' EXIT
mkdir "$work/in" "$work/tmp" "$work/home"
export SELDINGER_ASSETS="${SELDINGER_ASSETS:-$PWD/assets}" TMPDIR=$work/tmp HOME=$work/home MESA_SHADER_CACHE_DISABLE=true
unset XDG_CACHE_HOME XDG_DATA_HOME XDG_CONFIG_HOME
failed=0
fail() {
    failed=$((failed + 1))
    echo "kills: FAILED: $*"
}

cat >"$work/in/tree.toml" <<'END'
schema = 1
[[branch]]
name = "main"
points_mm = [[0, 0, 0, 3], [40, 0, 0, 3], [90, 10, 0, 3], [140, 10, 0, 2.8]]
[[branch]]
name = "side"
parent = "main"
at_mm = 60
points_mm = [[0, 0, 0, 2], [12, 16, 0, 2], [24, 40, 0, 1.6]]
[[target]]
name = "far"
branch = "main"
at_mm = 110
END
# The same with another width, for commands side by side.
sed 's/0, 0, 0, 3]/0, 0, 0, 3.2]/' "$work/in/tree.toml" >"$work/in/other_tree.toml"
for name in "" other_; do
    {
        printf 'schema = 1\ntitle = "Kills"\nframe_rate_hz = 15\nseed = 7\n[anatomy]\ntree = "%stree.toml"\n' "$name"
        printf '[entry]\nend = "main.in"\ninserted_mm = 40.0\n[guidewire]\ndevice = "glide035"\n'
        printf '[wall]\nstiffness_N_per_mm = 5.0\n[target]\nname = "far"\nradius_mm = 4.0\n'
        printf '[c_arm]\nisocentre_mm = [70.0, 5.0, 0.0]\nsid_mm = 1100.0\nsod_mm = 750.0\ndetector_width_mm = 200.0\n'
        printf 'pixels = 128\n[imaging]\npatient = false\n'
    } >"$work/in/${name}kills.toml"
done
printf '0 beam on\n1..20 advance 3 mm\n4 rotate 40 deg\n30 end\n' >"$work/in/kills.gw"
printf 'schema = 1\n[[run]]\nscenario = ["kills.toml", "other_kills.toml"]\ncommands = "kills.gw"\nimages = false\n' \
    >"$work/in/list.toml"

names=(run generate import render study)
# words NAME FOLDER: the command with its outputs in FOLDER and its cache in FOLDER/cache.
words() {
    case $1 in
    run) echo run "$work/in/kills.toml" --commands "$work/in/kills.gw" --out "$2/out" --truth --dicom shown --cache "$2/cache" ;;
    generate) echo anatomy generate "$work/in/tree.toml" --out "$2/out" ;;
    import) echo anatomy import "$work/in/tree.stl" --unit mm --out "$2/out" --scenario "$2/first.toml" ;;
    render) echo render "$work/in/kills.toml" --commands "$work/in/kills.gw" --frame 20 --out "$2/x.png" --cache "$2/cache" ;;
    study) echo study resolution --quick --out "$2/out" ;;
    esac
}
quiet() { "$program" "$@" >"$work/said" 2>&1; }

# valid FOLDER: every file there but unfinished ones is whole.
valid() {
    local file
    while IFS= read -r -d '' file; do
        case $file in
        *.part | *.part/* | *.lock) ;;
        *.png) [ "$(tail -c 8 "$file" | od -An -tx1 | tr -d ' \n')" = 49454e44ae426082 ] || fail "$file is no whole picture" ;;
        *.anatomy.json) [ -d "$(dirname "$file")" ] && { quiet anatomy check "$file" || fail "$file: $(tail -1 "$work/said")"; } ;;
        *.json) [ "$(tail -c 2 "$file" | tr -d '\n')" = "}" ] || [ "$(tail -c 2 "$file" | tr -d '\n')" = "]" ] || fail "$file is no whole JSON" ;;
        *.gw) [ -s "$file" ] && { quiet replay "$file" --scenario "$work/in/kills.toml" --cache "$work/cache" || fail "$file: $(tail -1 "$work/said")"; } ;;
        esac
    done < <(find "$1" -type f -print0)
}
left_over() { find "$1" "$work/tmp" \( -name '*.part' -o -name '*.lock' \) -print; }

declare -A took code
"$program" anatomy generate "$work/in/tree.toml" --out "$work/in" >/dev/null || exit 2
for name in "${names[@]}"; do
    mkdir -p "$work/whole/$name"
    quiet $(words "$name" "$work/whole/$name")
    code[$name]=$?
    [ "${code[$name]}" -le 1 ] || { cat "$work/said" >&2; exit 2; }
    for ((k = 0; k < 3; ++k)); do # the quickest of three, or most kills come too late
        mkdir "$work/timed"
        start=$(date +%s%N)
        quiet $(words "$name" "$work/timed")
        ms=$((($(date +%s%N) - start) / 1000000))
        rm -rf "$work/timed"
        [ "${took[$name]:-$ms}" -lt "$ms" ] || took[$name]=$ms
    done
    echo "kills: $name takes ${took[$name]} ms"
done

signals=(KILL TERM INT)
declare -A ended
for ((k = 0; k < count; ++k)); do
    name=${names[k % ${#names[@]}]} signal=${signals[RANDOM % 3]}
    delay=$(((RANDOM * 32768 + RANDOM) % (took[$name] + 1)))
    at=$work/killed
    rm -rf "$at" && mkdir "$at"
    set -m # a group of its own, which gets the signal as from a terminal
    "$program" $(words "$name" "$at") >"$work/said" 2>&1 &
    pid=$!
    set +m
    sleep "$(printf '%d.%03d' $((delay / 1000)) $((delay % 1000)))"
    kill -s "$signal" -- "-$pid" 2>/dev/null
    wait "$pid" 2>/dev/null
    status=$?
    ended[$status]=$((${ended[$status]:-0} + 1))
    what="kill $k, seed $seed: $name by SIG$signal after $delay ms"
    before=$failed
    [ "$signal" = KILL ] || [ -z "$(left_over "$at")" ] || fail "$what left $(left_over "$at" | head -3 | tr '\n' ' ')"
    valid "$at"
    quiet $(words "$name" "$at")
    again=$?
    [ "$again" = "${code[$name]}" ] || fail "$what: the next run ended with $again: $(tail -1 "$work/said")"
    [ -z "$(left_over "$at")" ] || fail "$what, and the next run: $(left_over "$at" | head -3 | tr '\n' ' ')"
    if [ "$name" = study ]; then # its pages have times
        diff <(cd "$at" && find out | sort) <(cd "$work/whole/study" && find out | sort) >/dev/null || fail "$what: other files"
    else
        diff -r -q -x first.toml "$at" "$work/whole/$name" || fail "$what: the next run gave other files"
    fi
    [ "$failed" = "$before" ] || echo "kills: see $what"
done
for status in "${!ended[@]}"; do echo "kills: exit code $status: ${ended[$status]}"; done

# Side by side, with one cold cache.
shared=$work/shared
mkdir "$shared"
pids=()
for name in "" other_; do
    for k in 1 2; do
        "$program" run "$work/in/${name}kills.toml" --commands "$work/in/kills.gw" --frames none --out "$shared/$name$k" \
            --cache "$shared/cache" >/dev/null 2>"$shared/$name$k.txt" &
        pids+=($!)
    done
done
"$program" batch "$work/in/list.toml" --out "$shared/batch" --cache "$shared/cache" >/dev/null 2>"$shared/batch.txt" &
pids+=($!)
# The room beside them, where there can be a display.
room="" screen=""
if command -v Xvfb >/dev/null 2>&1; then
    Xvfb -displayfd 3 -screen 0 1600x1200x24 3>"$work/display" >/dev/null 2>&1 &
    screen=$!
    for ((k = 0; k < 100; ++k)); do [ ! -s "$work/display" ] || break; sleep 0.1; done
    DISPLAY=:$(cat "$work/display") "$program" play "$work/in/kills.toml" --cache "$shared/cache" \
        --record "$shared/room.gw" >/dev/null 2>"$shared/room.txt" &
    room=$!
fi
for pid in "${pids[@]}"; do
    wait "$pid"
    [ $? -le 1 ] || fail "a command beside others: $(cat "$shared"/*.txt)"
done
if [ -n "$room" ]; then
    sleep 3
    kill -TERM "$room"
    wait "$room"
    status=$?
    [ $status = 130 ] || [ $status -le 1 ] || fail "the room beside others ended with $status: $(cat "$shared/room.txt")"
    kill "$screen"
    # Nobody has begun the attempt, so that there is nothing to record.
    [ ! -e "$shared/room.gw" ] || fail "the room has recorded an attempt that nobody began"
fi
[ -z "$(left_over "$shared")" ] || fail "side by side left $(left_over "$shared" | tr '\n' ' ')"
[ "$(ls "$shared/cache" | grep -c '^anatomy-')" = 2 ] || fail "side by side: $(ls "$shared/cache" | tr '\n' ' ')"
for name in "" other_; do
    cmp "$shared/${name}1/run.gw" "$shared/${name}2/run.gw" || fail "side by side: recordings of ${name}kills differ"
done
states() { grep '^state ' "$1/run.gw"; }
[ "$(states "$shared/1")" = "$(states "$work/whole/run/out")" ] || fail "side by side: other states than alone"
[ "$(states "$shared/1")" = "$(states "$shared/batch/000001")" ] || fail "side by side: the batch has other states"

echo "kills: $count kills with seed $seed, $failed failures"
[ "$failed" = 0 ]
