# The wire at the start and at rest, and the joints that are followed (the paper's Fig. 4): @scene@.
set size ratio -1
set xtics 25
set ytics 10
set xlabel 'x [mm]'
set ylabel 'y [mm]'
set key outside right top
plot 'varied_segments_wires.csv' skip 1 using (strcol(1) eq 'right wall' ? $2 : 1/0):3 with lines lc rgb '#999999' title 'wall', \
     'varied_segments_wires.csv' skip 1 using (strcol(1) eq 'left wall' ? $2 : 1/0):3 with lines lc rgb '#999999' notitle, \
     'varied_segments_wires.csv' skip 1 using (strcol(1) eq 'initial' ? $2 : 1/0):3 with lines lc rgb '#009E73' title 'initial wire', \
     'varied_segments_wires.csv' skip 1 using (strcol(1) eq 'at rest' ? $2 : 1/0):3 with lines lc rgb '#0072B2' lw 1.5 title 'wire at rest', \
     @for joints@'varied_segments_wires.csv' skip 1 using (strcol(1) eq 'joint @joint@' ? $2 : 1/0):3 with points pt @shape@ ps 1.6 lc rgb '#D55E00' title 'joint @joint@'@end@
