# The same by tube: the median time after which the farthest joint stays within a distance of rest. Dotted: 16.7 ms,
# 60 frames a second. A line ends where less than half of the pushes get nearer.@vessels@
set multiplot layout @deep@,@columns@
set logscale xy
set format x '10^{%L}'
set format y '10^{%L}'
set grid lc rgb '#dddddd'
set datafile missing NaN
set key off
set xlabel 'processor time of a push, median [ms]'
set ylabel 'farthest joint from rest [mm]'
set xrange [0.02:3000]
set yrange [1e-6:1.8]
set arrow from @frame_ms@,graph 0 to @frame_ms@,graph 1 nohead lc rgb '#666666' dt 3
@for panels@set title '@vessel@'
plot @for methods@'pareto_curves.csv' skip 1 using (strcol(1) eq '@vessel@' && strcol(2) eq '@method@' ? $4 : NaN):($3) with lines @look@@end@
@end@unset logscale
unset title
unset xlabel
unset ylabel
unset tics
unset border
unset grid
unset arrow
unset label
set yrange [0:1]
set xrange [0:1]
set key center center font ',11'
plot @for methods@-1 with lines @look@ title '@method@'@end@, \
     -1 notitle
unset multiplot
