#!/bin/sh
# tests/tree.sh: the commit itself: no marks of a merge, no blanks at the ends of lines, file names that every system and
# terminal takes, and no algorithm that the page's C++ library lacks. Says what it finds and fails.
set -eu
cd "$(dirname "$0")/.."
git rev-parse --git-dir >/dev/null 2>&1 || { echo "tree: not a git checkout, so nothing is checked"; exit 0; }
failed=0
# Against the empty tree every line of the commit is a new one.
git diff --check "$(git hash-object -t tree /dev/null)" HEAD || failed=1
names=$(git -c core.quotePath=true ls-tree -r --name-only HEAD | grep -v -E '^[A-Za-z0-9._/-]+$' || true)
if [ -n "$names" ]; then
    printf 'tree: expected file names of A-Z a-z 0-9 . _ / -, found:\n%s\n' "$names"
    failed=1
fi
# Emscripten's library has no std::ranges; what the page's sources use of it is in the stand-in, or ./app/web.sh fails.
lacking=$(git ls-files 'engine/*' 'physics/*' 'render/*' 'app/web/*' | grep -E '\.(cpp|h)$' |
    grep -v -E '^engine/(studies/|patient/dicom_)' | xargs grep -ho 'std::ranges::[a-z_]*' | sed 's/.*:://' | sort -u |
    grep -vx -E 'less|greater|equal_to' | while read -r name; do
        grep -qE "(^|[ *&])$name\(" app/web/stand_in/libcxx13.h || echo "std::ranges::$name"
    done)
if [ -n "$lacking" ]; then
    printf 'tree: expected these in app/web/stand_in/libcxx13.h, for the page, found them only in the sources:\n%s\n' "$lacking"
    failed=1
fi
exit $failed
