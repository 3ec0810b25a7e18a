# Density of the wall's stiffness in @realisations@ realisations (the paper's Fig. 15): G = @terms@ terms, Ω =
# @pieces@.
set grid lc rgb '#dddddd'
set style fill solid 0.8 noborder
set xlabel 'K/k'
set ylabel 'density'
set xrange [0:2]
set yrange [0:*]
set key top left Left reverse
set arrow 1 from 0.5, graph 0 to 0.5, graph 0.7 nohead dt 2
set arrow 2 from 1.5, graph 0 to 1.5, graph 0.7 nohead dt 2
set label 1 'published: 96.6 % between' at 1.98, graph 0.76 right
plot 'wall_variation_stiffness.csv' skip 1 using 1:2 with boxes lc rgb '#56B4E9' title 'measured', \
     exp(-0.5*((x-1.0012)/0.236)**2)/(0.236*sqrt(2*pi)) with lines lw 2 lc rgb 'black' title 'normal, published mean and deviation'
