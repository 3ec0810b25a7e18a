# Processor time of a cycle with M varied segments over that with one (the paper's Section 3.2): @scene@. The ratio
# follows what a wall query costs beside a solution: the published wall took as long as the solution of M = 1.
set grid lc rgb '#dddddd'
set key top left Left reverse
set xlabel 'varied segments M'
set ylabel 't_M/t_1'
set xrange [0.8:5.2]
set yrange [0:6]
set xtics 1
$published << END
@for published@@m@,@ratio@
@end@END
plot $published using 1:2 with linespoints pt 7 ps 1.4 dt 2 lw 2 lc rgb 'black' title 'published: 1.52, 2.67, 4.83', \
     @for walls@'< grep "^@wall@," cost.csv' using 2:6 with linespoints pt @point@ lw 2 lc rgb '@colour@' title '@wall@'@end@
