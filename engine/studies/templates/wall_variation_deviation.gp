# Density of the lateral deviation of all joints in @realisations@ realisations (the paper's Fig. 18): the tube that
# has Fig. 13's energies moves its wire further than published, a gently bent one less. @where@.
set grid lc rgb '#dddddd'
set xlabel 'lateral deviation d [µm]'
set ylabel 'density [1/µm]'
set logscale y
set format y '10^{%L}'
set yrange [1e-5:*]
set key top right
set object 1 rectangle from -5, graph 0 to 5, graph 1 behind fc rgb '#e3e3e3' fs noborder
set label 1 'published: ± 5 µm or less' at 7, graph 0.94 left
plot @for tubes@'wall_variation_deviation.csv' skip 1 using (strcol(1) eq '@tube@' && $3 > 0 ? 1000*$2 : 1/0):($3/1000) with steps lw 2 lc rgb '@colour@' title '@tube@'@end@
