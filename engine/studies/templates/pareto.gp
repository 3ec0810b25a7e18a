# From the centreline to rest: the farthest joint's distance from rest [mm] against processor time [s]. Down and to
# the left is better. The rivals have no wall for meshes.@vessels@
set multiplot layout @deep@,@columns@
set logscale xy
set format x '10^{%L}'
set format y '10^{%L}'
set grid lc rgb '#dddddd'
set datafile missing NaN
set key off
set xlabel 'processor time [s]'
set ylabel 'farthest joint from rest [mm]'
set yrange [1e-7:30]
@for panels@set title '@vessel@'
plot @for methods@'pareto.csv' skip 1 using (strcol(1) eq '@vessel@' && strcol(2) eq '@method@' ? $4 : NaN):(column(5) > 1e-7 ? column(5) : 1e-7) with lines @look@@end@
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
