#!/bin/bash
# tests/long.sh [FRAMES [IMAGES]]: whether memory grows in long runs: FRAMES (1000000) frames with a command each and no images,
# IMAGES (100000) with one each of 128 x 128, which takes 1 GB of the temporary folder, and FRAMES of two environments of Python.
# The slope is that of a line through the resident size of the second half of a run but its last second, in which the score takes
# a Fourier transform of all speeds; fewer frames than 500000 measure how the commands are read. A run keeps the tip's speed of
# each frame for the score's smoothness, from the first motion until the target is reached, for 262144 frames at most: more than
# 4 bytes a frame are a failure in longer runs, and in the one with images, all of which lies within them, more than 24: their
# array doubles, and is there twice while it does.
set -euo pipefail
cd "$(dirname "$0")/.."
frames=${1:-1000000}
images=${2:-100000}
./app/setup.sh python
./app/build.sh release seldinger python
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
program=$PWD/build/release/bin/seldinger

# The resident size of a command, each half second; then a line of what it did. Fails where more than LIMIT bytes a frame are kept.
watch() {
    local name=$1 count=$2 limit=$3
    shift 3
    "$@" >"$folder/out" 2>"$folder/error" &
    local process=$!
    : >"$folder/sizes"
    while kill -0 "$process" 2>/dev/null; do
        awk '/VmRSS/ { print $2 }' "/proc/$process/status" 2>/dev/null >>"$folder/sizes" || true
        sleep 0.5
    done
    local code=0
    wait "$process" || code=$?
    [ "$code" -le 1 ] || { cat "$folder/error" >&2; exit 2; }
    local made
    made=$(sed -n 's/.*: \([0-9]*\) frames.*/\1/p' "$folder/out")
    [ "${made:-0}" -ge "$count" ] || { printf 'long: expected %d frames, found %s\n' "$count" "${made:-none}" >&2; exit 2; }
    awk -v name="$name" -v count="$count" -v limit="$limit" '
        { size[NR] = $1 }
        END {
            for (k = int(NR / 2) + 1; k <= NR - 2; ++k) { ++n; x += k; y += size[k]; xx += k * k; xy += k * size[k] }
            slope = n > 2 ? (n * xy - x * y) / (n * xx - x * x) * NR / count * 1024 : 0
            printf "%s: %d frames, %.1f s, resident %.1f MB in the middle, %.1f MB at the end, %.2f bytes a frame\n",
                   name, count, NR / 2, size[int(NR / 2) + 1] / 1024, size[NR] / 1024, slope
            exit slope > limit
        }' "$folder/sizes"
}

# To and fro, so that the target is never reached.
script() {
    printf '0 beam on\n'
    for ((k = 0; k < $1; k += 200)); do
        printf '%d..%d advance 0.1 mm\n%d..%d withdraw 0.1 mm\n' "$k" $((k + 99)) $((k + 100)) $((k + 199))
    done
}
script "$frames" >"$folder/frames.gw"
script "$images" >"$folder/images.gw"
watch "run without images" "$frames" 4 "$program" run straight --commands "$folder/frames.gw" --out "$folder/frames" --frames none \
    --set time_limit_s=100000 --cache "$folder/cache"
watch "run with images" "$images" 24 "$program" run straight --commands "$folder/images.gw" --out "$folder/images" \
    --set c_arm.pixels=128 --set time_limit_s=100000 --cache "$folder/cache"
PYTHONPATH=$PWD/build/python watch "two environments of Python" "$frames" 4 /usr/bin/python3 -c "
import sys, numpy as np, seldinger.gym as gym
env = gym.make_vec('seldinger/Renal-v1', 2, cache=sys.argv[1])
env.reset(seed=1)
for k in range(int(sys.argv[2]) // 2):
    env.step(env.action_space.sample())
print('two environments:', 2 * (k + 1), 'frames')
" "$folder/cache" "$frames"
