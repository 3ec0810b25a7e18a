# @caption@
set logscale xy
set format x '10^{%L}'
set format y '10^{%L}'
set grid lc rgb '#dddddd'
set datafile missing NaN
set key off
set xlabel 'processor time of a push, median [ms]' font ',14'
set ylabel 'farthest joint from rest [mm]' font ',14'
set tics font ',12'
set xrange [0.02:60000]
set yrange [@bottom@:@top@]
set lmargin 11
set rmargin 3
set format x '%g'
set xtics (0.1, 1, 10, 100, 1000)
set arrow from @frame_ms@,graph 0 to @frame_ms@,graph 1 nohead lc rgb '#666666' dt 3 lw 1.5
set label '16.7 ms: 60 frames/s' at @frame_ms@,graph 0.03 left offset 0.6,0 tc rgb '#666666'
@labels@@lines@
