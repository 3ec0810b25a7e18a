# The wire at rest in @coarse@ and in @fine@ segments and the artery's wall (the paper's Fig. 13a), the place where
# they are farthest apart but for the free end, and their separation along the wire. The tube of Fig. 13b, smooth.
set multiplot
set size ratio -1
set origin 0,0
set size 0.48,1
set xlabel 'x [mm]'
set ylabel 'y [mm]'
set key top left Left reverse
set object 9 rectangle from @left:.3f@,@low:.3f@ to @right:.3f@,@high:.3f@ front fs empty border rgb 'black' lw 2
plot 'resolution_wire.csv' skip 1 using (strcol(1) eq 'left wall' ? $2 : 1/0):3 with lines lw 1.5 lc rgb '#999999' title 'wall', \
     'resolution_wire.csv' skip 1 using (strcol(1) eq 'right wall' ? $2 : 1/0):3 with lines lw 1.5 lc rgb '#999999' notitle, \
     'resolution_wire.csv' skip 1 using (strcol(1) eq 'coarse' ? $2 : 1/0):3 with linespoints pt 7 ps 0.01 lw 2 lc rgb '#0072B2' title '@coarse@ segments', \
     'resolution_wire.csv' skip 1 using (strcol(1) eq 'fine' ? $2 : 1/0):3 with lines lw 1.2 lc rgb '#D55E00' title '@fine@ segments'
unset object 9
set key off
set origin 0.5,0.42
set size 0.48,0.58
set xrange [@left:.3f@:@right:.3f@]
set yrange [@low:.3f@:@high:.3f@]
set title 'the box: joint @joint@, @apart:.3f@ mm apart'
plot 'resolution_wire.csv' skip 1 using (strcol(1) eq 'left wall' ? $2 : 1/0):3 with lines lw 1.5 lc rgb '#999999' title 'wall', \
     'resolution_wire.csv' skip 1 using (strcol(1) eq 'right wall' ? $2 : 1/0):3 with lines lw 1.5 lc rgb '#999999' notitle, \
     'resolution_wire.csv' skip 1 using (strcol(1) eq 'coarse' ? $2 : 1/0):3 with linespoints pt 7 ps 0.9 lw 2 lc rgb '#0072B2' title '@coarse@ segments', \
     'resolution_wire.csv' skip 1 using (strcol(1) eq 'fine' ? $2 : 1/0):3 with lines lw 1.2 lc rgb '#D55E00' title '@fine@ segments'
set size noratio
set origin 0.49,0
set size 0.51,0.42
set autoscale
set grid lc rgb '#dddddd'
set title 'separation along the wire'
set xlabel 'joint of the coarse wire'
set ylabel 'separation [mm]'
set y2label 'bend [rad]'
set ytics nomirror
set y2tics
set yrange [0:*]
set y2range [0:*]
set key top right
plot 'resolution_separation.csv' skip 1 using 1:3 axes x1y2 with filledcurves y2=0 fc rgb '#dddddd' title 'bend', \
     '' skip 1 using 1:2 with lines lw 1.5 lc rgb '#0072B2' title 'separation', \
     0.027 with lines dt 2 lc rgb 'black' title 'published mean'
unset multiplot
