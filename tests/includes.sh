#!/bin/sh
# tests/includes.sh [REGEX]: reads every source file by itself, with warnings as errors, without making code. The other
# builds compile sixteen files together, so that one which includes too little, or shadows a name, passes there. REGEX
# selects paths, and is by default everything but the tests.
set -eu
cd "$(dirname "$0")/.."
./app/setup.sh develop
mkdir -p build
cmake --preset debug -B build/includes -DSELDINGER_WERROR=ON >build/includes.log
ninja -C build/includes -t commands all benchmarks state_fuzz |
    sed -nE 's/ -MD -MT .* -c ([^ ]+\.cpp)$/ -fsyntax-only \1/p' |
    grep -E "${1:-/main.cpp\$|/(physics|render|engine|app|benchmarks)/[^ ]*\.cpp\$}" |
    { [ $# -gt 0 ] && cat || grep -v "$PWD/tests/[^b]"; } >build/includes.txt
failed=$(mktemp)
trap 'rm -f "$failed"' EXIT
printf 'includes: %d files\n' "$(wc -l <build/includes.txt)"
xargs -d '\n' -P "$(nproc)" -I '{}' sh -c "cd build/includes && {} || echo x >>'$failed'" <build/includes.txt
printf 'includes: %d files failed\n' "$(wc -l <"$failed")"
[ ! -s "$failed" ]
