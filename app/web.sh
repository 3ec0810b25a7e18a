#!/bin/sh
# app/web.sh: builds the page, build/web: the room for any browser, to be served by any static server. tests/web.sh tries
# it. --engine: its engine alone, without vessels and patients.
set -eu
cd "$(dirname "$0")/.."
./app/setup.sh web
toolchain=/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake
log=build/web.log
mkdir -p build/web
. ./app/step.sh
# Where Debian has acorn, which Emscripten looks for beside itself.
export NODE_PATH=/usr/share/nodejs
[ -f build/web-engine/build.ninja ] || printf 'web: building the engine for browsers (some minutes the first time)\n'
step cmake -S app/web -B build/web-engine -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_TOOLCHAIN_FILE="$toolchain"
step cmake --build build/web-engine
cp build/web-engine/seldinger.js build/web-engine/seldinger.wasm build/web/
printf 'web: %s bytes in build/web/seldinger.wasm, %s compressed\n' "$(stat -c %s build/web/seldinger.wasm)" \
    "$(gzip -9 -c build/web/seldinger.wasm | wc -c)"
[ "${1:-}" != --engine ] || exit 0
./app/build.sh release seldinger
node app/web/bundles.js build/release/bin/seldinger . build/web
printf 'web: try it by "python3 -m http.server --directory build/web 8000" at http://localhost:8000\n'
