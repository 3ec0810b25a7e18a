#!/bin/sh
# tests/fuzz/run.sh MINUTES [READER...]: fuzzes each reader for so long, from the seeds and from what earlier runs have
# learnt. What breaks a reader is left in build/fuzz/broken/READER; moved to tests/fuzz/found/READER it is a test.
set -eu
cd "$(dirname "$0")/../.."
minutes=${1:?tests/fuzz/run.sh MINUTES [READER...]}
shift
./app/setup.sh develop
mkdir -p build
./app/build.sh fuzz fuzz
[ $# -gt 0 ] || set -- $(SELDINGER_READER=? build/fuzz/bin/fuzz 2>&1 | sed 's/.*://')
failed=0
for reader in "$@"; do
    learnt=build/fuzz/corpus/$reader
    broken=build/fuzz/broken/$reader
    mkdir -p "$learnt" "$broken"
    printf 'fuzz: %s for %s minutes\n' "$reader" "$minutes"
    more=""
    for folder in tests/fuzz/seeds/$reader tests/fuzz/found/$reader; do [ -d "$folder" ] && more="$more $folder"; done
    SELDINGER_READER=$reader build/fuzz/bin/fuzz -max_total_time=$((minutes * 60)) -timeout=60 -rss_limit_mb=3000 \
        -max_len=1048576 -print_final_stats=1 -artifact_prefix="$broken/" "$learnt" $more >"build/fuzz/$reader.log" 2>&1 || {
        failed=1
        printf 'fuzz: %s broke: see build/fuzz/%s.log and %s\n' "$reader" "$reader" "$broken"
    }
    sed -n 's/^stat::number_of_executed_units: */fuzz: runs: /p' "build/fuzz/$reader.log"
done
exit $failed
