# Mean size of an update with the second order (a) over that without (b), against the cycles that the wire has made
# before (Fig. 11 gives about 1e-7 for a wire in equilibrium, which Section 3 takes to be reached after 200 cycles):
# @scene@.
set grid lc rgb '#dddddd'
set logscale y
set format y '10^{%L}'
set xlabel 'cycles made before'
set ylabel 'mean |ε|, (a) over (b)'
set key top right
set yrange [1e-13:1]
set object 1 rectangle from graph 0,first 1e-8 to graph 1,first 1e-6 behind fc rgb '#e8f3ec' fs noborder
plot 'static_contact_ratio.csv' skip 1 using ($1 == 1 ? $2 : 1/0):($3/$4) with linespoints pt 7 lw 2 lc rgb '#E69F00' title 'M = 1 before', \
     '' skip 1 using ($1 == 2 ? $2 : 1/0):($3/$4) with linespoints pt 5 lw 2 lc rgb '#0072B2' title 'M = 2 before', \
     1e-7 with lines dt 2 lc rgb 'black' title 'published, about 10^{-7}', \
     '+' using (@usual_cycles@):(1e-7) every ::::0 with points pt 6 ps 2 lc rgb 'black' title 'what the paper calls equilibrium'
