# Stated against true errors of the random tubes of study_tests: gnuplot -e "csv='FILE'; out='FILE.png'" tip-error.gp
set terminal pngcairo size 1100,560 font "DejaVu Sans,11"
set output out
set datafile separator ","
set multiplot layout 1,2
set logscale xy
set format xy "10^{%T}"
set tics out nomirror
set grid linecolor rgb "#dddddd"
set key bottom right samplen 2
twice = "#0072B2"
fourfold = "#D55E00"
shown(x) = (abs(x) > 1e-6) ? abs(x) : 1e-6
do for [k = 0:1] {
    set title k == 0 ? "Tip" : "Largest force of a length λ"
    set xlabel k == 0 ? "stated error [mm]" : "stated error [N]"
    set ylabel k == 0 ? "true error [mm]" : "true error [N]"
    if (k == 0) { set xrange [1e-6:10]; set yrange [1e-6:10] } else { set xrange [1e-6:1]; set yrange [1e-6:1] }
    plot csv skip 1 using (shown(column(2 + 2 * k))):(shown(column(3 + 2 * k))) \
             with points pointtype 7 pointsize 0.35 linecolor rgb "#666666" title "a tube", \
         x with lines linecolor rgb "black" title "equal", \
         2 * x with lines linecolor rgb twice title "twice", x / 2 with lines linecolor rgb twice notitle, \
         4 * x with lines linecolor rgb fourfold dashtype 2 title "four times", \
         x / 4 with lines linecolor rgb fourfold dashtype 2 notitle
}
unset multiplot
