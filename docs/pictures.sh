#!/bin/sh
# docs/pictures.sh: makes the pictures that are put together of others: the labelled room and the four pages of the room; and the
# frame of cine and the map of views, by the program, and the chart of stated against true errors, by the study.
# Needs chromium, gnuplot and cwebp (package webp). The pictures that it takes are photographs of the window of `seldinger play`,
# 1280 x 800 pixels.
set -eu
cd "$(dirname "$0")/pictures"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
picture() { # PAGE OUT
    HOME=$scratch chromium --headless=new --no-sandbox --disable-gpu --hide-scrollbars --window-size=1280,800 \
        --screenshot="$scratch/page.png" "file://$PWD/$1" >/dev/null 2>&1
    cwebp -quiet -q 85 "$scratch/page.png" -o "$2"
}
../../build/release/bin/seldinger render coronary_lad --commands solution --frame 12 --mode cine --lao -30 --cranial -20 \
    --out "$scratch/cine.png"
cwebp -quiet -q 90 "$scratch/cine.png" -o cine.webp
../../build/release/bin/seldinger views renal --no-pictures --out "$scratch/views" >/dev/null
cwebp -quiet -q 90 "$scratch/views/views.png" -o views-map.webp
TIP_ERROR_CSV=$scratch/tip-error.csv ../../build/release/bin/study_tests \
    --gtest_filter='DiscretisationErrorStudy.AThousandRandomTubesAgainstFarShorterSegments' >/dev/null
gnuplot -e "csv='$scratch/tip-error.csv'; out='$scratch/tip-error.png'" tip-error.gp
cwebp -quiet -lossless "$scratch/tip-error.png" -o tip-error.webp
picture room-labels.html room-labels.webp
picture room-pages.html ../../assets/pictures/room-pages.webp
