#!/bin/sh
# tests/web.sh: plays the solutions that ship by the program, and replays the recordings in the page's engine, under node:
# each state must have the same bits. Then the page itself in chromium (tests/web/page_test.js) and in Firefox; pictures of it are in
# build/web-pictures. Not part of tests/run.sh: it builds the engine once more, with Emscripten.
set -eu
cd "$(dirname "$0")/.."
./app/setup.sh run web browser
./app/build.sh release seldinger
./app/web.sh
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for file in assets/scripts/*.gw; do
    name=$(basename "$file" .gw)
    [ -f "assets/scenarios/$name.toml" ] || continue
    # 1: a solution that does not reach is none of this test's.
    ./build/release/bin/seldinger run "$name" --commands solution --frames none --out "$work/runs/$name" \
        --cache "$work/cache" >"$work/said" 2>&1 || [ $? = 1 ] || { cat "$work/said" >&2; exit 2; }
done
# Debian's loader takes fetch() for a browser's.
node --no-experimental-fetch tests/web/replay.js build/web-engine/seldinger.js assets "$work/cache" "$work/runs"
node --no-experimental-fetch tests/web/attack.js build/web-engine/seldinger.js assets
node tests/web/page_test.js build/web build/release/bin/seldinger build/web-pictures
/usr/bin/python3 tests/web/firefox.py build/web build/release/bin/seldinger build/web-pictures
