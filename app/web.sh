#!/bin/sh
# app/web.sh [--patients N]: builds the page, build/web: the room for any browser, to be served by any static server or
# opened as a file. tests/web.sh tries it. N: other patients of each exercise that come with it, 1 by default.
# --engine: its engine alone, without vessels and patients. --page: patients are those of the last time.
set -eu
cd "$(dirname "$0")/.."
others=1
wanted=all
while [ $# -gt 0 ]; do
    case $1 in
        --engine | --page) wanted=$1 ;;
        --patients) others=${2:-} && shift ;;
        *) others= ;;
    esac
    case $others in '' | *[!0-9]*) printf 'web: expected --engine, --page or --patients and a number\n' >&2 && exit 2 ;; esac
    shift
done
./app/setup.sh web
toolchain=/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake
engine=build/web-engine
log=build/web.log
mkdir -p build/web
. ./app/step.sh
# Where Debian has acorn, which Emscripten looks for beside itself.
export NODE_PATH=/usr/share/nodejs
[ -f $engine/build.ninja ] || printf 'web: building the engine for browsers (some minutes the first time)\n'
step cmake -S app/web -B $engine -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_TOOLCHAIN_FILE="$toolchain"
step cmake --build $engine
printf 'web: %s bytes in %s/seldinger.wasm, %s compressed\n' "$(stat -c %s $engine/seldinger.wasm)" $engine \
    "$(gzip -9 -c $engine/seldinger.wasm | wc -c)"
case $wanted in
    --engine) exit 0 ;;
    --page) node app/web/bundles.js - . $engine build/web --keep ;;
    all)
        ./app/build.sh release seldinger
        node app/web/bundles.js build/release/bin/seldinger . $engine build/web --patients "$others"
        ;;
esac
printf 'web: open build/web/index.html, or run "python3 -m http.server --directory build/web 8000" for http://localhost:8000\n'
