# Mean turn of the updates of each cycle with M = 2, from the centreline, N = @segments@: on planes it stays at a
# level that finer facets lower, on smooth walls it keeps falling.
set multiplot layout 1,2
set logscale y
set format y '10^{%L}'
set grid lc rgb '#dddddd'
set style data lines
set xlabel 'cycles'
set ylabel 'mean turn of an update'
set yrange [1e-11:1]
set key bottom left
@for tubes@set title '@tube@: @what@'
plot @for walls@'triangle_walls_cycles.csv' skip 1 using (strcol(1) eq '@tube@' ? $4 : 1/0):(strcol(2) eq '@kind@' && strcol(3) eq '@facets@' ? $5 : 1/0) lw 2 @look@ title '@title@'@end@
unset key
@end@unset multiplot
