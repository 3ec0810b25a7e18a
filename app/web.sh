#!/bin/sh
# app/web.sh: builds the engine for browsers, as build/web/seldinger.wasm with the JavaScript that loads it. There is no
# page yet; tests/web.sh says what is proved of it.
set -eu
cd "$(dirname "$0")/.."
./app/setup.sh web
toolchain=/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake
log=build/web.log
mkdir -p build
. ./app/step.sh
[ -f build/web/build.ninja ] || printf 'web: building the engine for browsers (some minutes the first time)\n'
step cmake -S app/web -B build/web -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_TOOLCHAIN_FILE="$toolchain"
step cmake --build build/web
printf 'web: %s bytes in build/web/seldinger.wasm\n' "$(stat -c %s build/web/seldinger.wasm)"
