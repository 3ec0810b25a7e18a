# Left: each random tube by the wire's EI and the wall's stiffness, its colour the slowest push, a cross where
# anything came about that should not. Right: processor time of a frame under a wild hand.
set multiplot layout 1,2
set bmargin 9
set grid lc rgb '#dddddd'
set logscale xyz
set logscale cb
set title 'Random tubes: slowest push'
set xlabel 'EI [N·mm²]'
set ylabel 'k [N/mm]'
set cblabel 'processor time [ms]'
set xrange [4:2500]
set yrange [0.8:1250]
set palette defined (0 '#0072B2', 1 '#56B4E9', 2 '#F0E442', 3 '#E69F00', 4 '#D55E00')
set key below
plot 'robustness_tubes.csv' skip 1 using 4:5:(0.4+$2/3):22 with points pt 7 ps variable lc palette title 'a tube; the larger, the wider', \
     '' skip 1 using ($9+$10+$11+$12+$13+$15 > 0 ? $4 : 1/0):5 with points pt 2 ps 2 lw 2 lc rgb 'black' title 'with an incident'
@hands@unset multiplot
