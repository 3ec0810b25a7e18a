# A joint @from_axis:g@ mm from the axis of the sharp tube of radius @radius:g@ mm, @facets@ facets, as it passes an
# edge: on planes the push jumps from one side to the other, and is nowhere zero.
set multiplot layout 2,2
set grid lc rgb '#dddddd'
set xrange [-0.25:0.25]
set style data lines
set key top center
set title 'round the vessel: energy'
set ylabel '10^{-3} N·mm'
plot 'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'around' ? $2 : 1/0):(1000*$3) lw 3 lc rgb '#D55E00' title 'plane', \
     'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'around' ? $2 : 1/0):(1000*$4) lw 2 lc rgb '#0072B2' title 'closest', \
     'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'around' ? $2 : 1/0):(1000*$5) lw 2 lc rgb '#009E73' title 'field', \
     'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'around' ? $2 : 1/0):(1000*$6) lw 2 dt 2 lc rgb '#666666' title 'round'
unset key
set title 'along a bend: energy'
set ylabel '10^{-3} N·mm'
plot 'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'along' ? $2 : 1/0):(1000*$3) lw 3 lc rgb '#D55E00' title 'plane', \
     'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'along' ? $2 : 1/0):(1000*$4) lw 2 lc rgb '#0072B2' title 'closest', \
     'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'along' ? $2 : 1/0):(1000*$5) lw 2 lc rgb '#009E73' title 'field', \
     'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'along' ? $2 : 1/0):(1000*$6) lw 2 dt 2 lc rgb '#666666' title 'round'
unset key
set xlabel 'place from the edge [mm]'
set title 'round the vessel: push along the way'
set ylabel 'N'
plot 'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'around' ? $2 : 1/0):(1*$7) lw 3 lc rgb '#D55E00' title 'plane', \
     'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'around' ? $2 : 1/0):(1*$8) lw 2 lc rgb '#0072B2' title 'closest', \
     'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'around' ? $2 : 1/0):(1*$9) lw 2 lc rgb '#009E73' title 'field', \
     'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'around' ? $2 : 1/0):(1*$10) lw 2 dt 2 lc rgb '#666666' title 'round'
unset key
set title 'along a bend: push along the way'
set ylabel 'N'
plot 'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'along' ? $2 : 1/0):(1*$7) lw 3 lc rgb '#D55E00' title 'plane', \
     'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'along' ? $2 : 1/0):(1*$8) lw 2 lc rgb '#0072B2' title 'closest', \
     'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'along' ? $2 : 1/0):(1*$9) lw 2 lc rgb '#009E73' title 'field', \
     'triangle_walls_edge.csv' skip 1 using (strcol(1) eq 'along' ? $2 : 1/0):(1*$10) lw 2 dt 2 lc rgb '#666666' title 'round'
unset key
unset multiplot
