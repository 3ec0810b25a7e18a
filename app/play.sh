#!/bin/sh
# Sets up, builds, and opens the room. Arguments go to `seldinger play` (for example: renal --record my.gw).
set -eu
cd "$(dirname "$0")/.."
./app/setup.sh run
./app/build.sh release seldinger
exec build/release/bin/seldinger play "$@"
