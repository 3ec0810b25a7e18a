# Mean lateral deviation on the way to rest against the separation: which separation is fastest. Shaded: the best
# separations published (Section 3.1). @scene@.
set multiplot layout 1,2
set grid lc rgb '#dddddd'
set xlabel 'separation δ [segments]'
set ylabel 'mean |d| over @counted@ cycles [mm]'
set xrange [0:32]
set yrange [0:*]
set key bottom right
set object 1 rectangle from 10, graph 0 to 20, graph 1 behind fc rgb '#e8f3ec' fs noborder
set label 1 'published: best' at 15, graph 0.95 center tc rgb '#2d6a4f'
set title '@usual@'
plot @single:.6f@ with lines lw 2 lc rgb '#999999' title 'M = 1', \
     'separation_means.csv' skip 1 using ($1 == 1 && $3 == 2 ? $4 : 1/0):5 with linespoints pt 7 lw 2 lc rgb '#0072B2' title 'M = 2', \
     'separation_means.csv' skip 1 using ($1 == 1 && $3 == 3 ? $4 : 1/0):5 with linespoints pt 5 lw 2 lc rgb '#009E73' title 'M = 3'
set title 'M = 2 in other settings'
set key top right
unset label 1
plot 'separation_means.csv' skip 1 using ($1 == 1 && $3 == 2 ? $4 : 1/0):5 with linespoints pt 4 lw 2 lc rgb '#0072B2' title '@usual@', \
     'separation_means.csv' skip 1 using ($1 == 2 && $3 == 2 ? $4 : 1/0):5 with linespoints pt 5 lw 2 lc rgb '#E69F00' title '@coarse@', \
     'separation_means.csv' skip 1 using ($1 == 3 && $3 == 2 ? $4 : 1/0):5 with linespoints pt 6 lw 2 lc rgb '#CC79A7' title '@wide@', \
     'separation_means.csv' skip 1 using ($1 == 4 && $3 == 2 ? $4 : 1/0):5 with linespoints pt 7 lw 2 lc rgb '#D55E00' title '@sharp@'
unset multiplot
