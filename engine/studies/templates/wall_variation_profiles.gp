# The first of the random walls, stiffness along the artery (the paper's Fig. 14); shaded, ± 50 %: @where@.
set grid lc rgb '#dddddd'
set xlabel 'piece of artery ω'
set ylabel 'K/k'
set yrange [0:2]
set key outside right top
set object 1 rectangle from graph 0,first 0.5 to graph 1,first 1.5 behind fc rgb '#f2f2f2' fs noborder
plot @for examples@'wall_variation_profiles.csv' skip 1 using ($1 == @number@ ? $2 : 1/0):3 with lines lw 1.5 lc rgb '@colour@' title 'realisation @number@'@end@
