#!/bin/sh
# tests/tree.sh: the commit itself: no marks of a merge, no blanks at the ends of lines, and file names that every system
# and terminal takes. Says what it finds and fails.
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
exit $failed
