# How near to rest each method ends on each wall after @cycles@ cycles, the global relaxer after all its steps; N =
# @segments@. Below the dotted line a wire counts as balanced.
set multiplot layout 1,2
set logscale y
set format y '10^{%L}'
set grid lc rgb '#dddddd'
set style data points
set ylabel '|gradient| over C at the end'
set yrange [1e-15:1]
set xrange [-0.7:@last@.7]
set xtics rotate by -50 left (@walls@'round' @last@)
set bmargin 11
set key at screen 0.5, screen 0.02 center bottom horizontal maxrows 1
set arrow 1 from graph 0, first @balanced:g@ to graph 1, first @balanced:g@ nohead dt 3 lc rgb '#333333'
@for tubes@at(row) = row == @last@ ? @last@ : (row % 3) * @fine@ + row / 3
set title '@tube@: @what@'
plot @for methods@'triangle_walls.csv' skip 1 using (strcol(1) eq '@tube@' ? at(int($0)/@count@ - @before@) : 1/0):(strcol(4) eq '@method@' ? $7 : 1/0) pt @shape@ ps 1.3 lw 2 lc rgb '@colour@' title '@method@'@end@
unset key
@end@unset multiplot
