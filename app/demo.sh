#!/bin/sh
# Sets up, builds, and runs the demo: a guidewire from the left groin into the left renal artery.
set -eu
cd "$(dirname "$0")/.."
./app/setup.sh run
./app/build.sh release seldinger
out=${1:-out/renal}
code=0
build/release/bin/seldinger run renal --commands assets/scripts/renal.gw --out "$out" || code=$?
if [ -f "$out/score.json" ] && [ "$code" -le 1 ]; then
    printf 'frames:        %s\ncontact sheet: %s\nscore:         %s\nrecording:     %s\n' \
        "$out/frames/" "$out/sheet.png" "$out/score.json" "$out/run.gw"
fi
exit "$code"
