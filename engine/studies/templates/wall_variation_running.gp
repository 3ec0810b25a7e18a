# Mean and rms of the lateral deviation against the number of realisations (the paper's Fig. 16), in both tubes.
# @where@.
set grid lc rgb '#dddddd'
set multiplot layout 3,2 columnsfirst
set ylabel 'd [µm]'
set key top right
set yrange [*:*]
@for panels@set title '@tube@, joint @joint@'
set xlabel '@label@'
plot 'wall_variation_running.csv' skip 1 using (strcol(1) eq '@tube@' && $2 == @joint@ ? $3 : 1/0):(1000*$4) with lines lw 1.5 lc rgb '#009E73' title 'mean', \
     '' skip 1 using (strcol(1) eq '@tube@' && $2 == @joint@ ? $3 : 1/0):(1000*$5) with lines lw 1.5 lc rgb '#D55E00' title 'rms'
@end@unset multiplot
