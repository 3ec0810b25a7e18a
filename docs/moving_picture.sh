#!/bin/sh
# docs/moving_picture.sh [PROGRAM]: makes assets/pictures/renal.webp, the moving picture of README.md, from the solution of
# the exercise `renal`: every second frame of the screen of the room, 7.5 a second as in real time; first
# the last one for 2 s, which is what a viewer without animations shows.
# Needs cwebp and webpmux, from the package webp.
set -eu
cd "$(dirname "$0")/.."
program=${1:-build/release/bin/seldinger}
for tool in cwebp webpmux; do
    command -v $tool >/dev/null || { echo "moving_picture: $tool was not found: apt-get install webp" >&2; exit 2; }
done
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"$program" run renal --commands assets/scripts/renal.gw --out "$scratch" --panel --every 2
set --
for frame in "$scratch"/panel/*.png; do
    cwebp -quiet -resize 800 640 -q 45 "$frame" -o "${frame%.png}.webp"
    set -- "$@" -frame "${frame%.png}.webp" +133+0+0+0-b
done
webpmux -frame "${frame%.png}.webp" +2000+0+0+0-b "$@" -loop 0 -o assets/pictures/renal.webp
