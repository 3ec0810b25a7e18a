#!/bin/sh
# Runs clang-tidy with the checks of .clang-tidy over all files. Arguments are regular expressions of paths. It reads the
# files as they are compiled together in Release, without compiling them: headers are then read once for eight files.
set -eu
cd "$(dirname "$0")/.."
./app/setup.sh develop
mkdir -p build
cmake --preset release -B build/tidy >build/tidy.log
exec run-clang-tidy -quiet -p build/tidy "$@" 2>build/tidy.log
