# Left: error of the chain of segments against the exact wire (helix and arc are looked at far from the ends, where
# both rules are the same). Right: the wire through the bent tube, a point for each λ, from 4 mm at the left of a
# line halved from point to point; the global method to rest, the paper's methods with the paper's clamp for
# @cycles@ cycles. Down and to the left is better.
set multiplot layout 1,2
set logscale xy
set format y '10^{%L}'
set grid lc rgb '#cccccc'
set bmargin 18
set key below left Left reverse maxrows 8 samplen 3 width -2
set title 'Error against the length of the segments'
set xlabel 'λ [mm]'
set ylabel 'error over what is exact, of places over the length of the wire'
set xrange [0.08:5]
set yrange [3e-9:1]
set xtics (0.1, 0.2, 0.5, 1, 2, 4)
plot @for cases@'accuracy.csv' skip 1 using (strcol(1) eq '@case@' && strcol(2) eq '@quantity@' && strcol(3) eq '@clamp@' ? $5 : 1/0):8 with linespoints @look@ @points@ @title@@end@, \
     (x > 0.3 && x < 3 ? 4e-8*x**2 : 1/0) with lines lc rgb 'black' title 'full lines: half cells; black ∝ λ²', \
     (x > 0.3 && x < 3 ? 0.2*x : 1/0) with lines lc rgb 'black' dt '- ' title 'broken: clamp of the paper; black ∝ λ'
set title 'Wire through a bent tube: error against processor time'
set xlabel 'processor time from the axis of the tube to where the method stops [s]'
set ylabel 'farthest joint from the exact curve [mm]'
set format x '10^{%L}'
set xtics auto
set autoscale x
set yrange [2e-5:10]
plot @for methods@'accuracy_cost.csv' skip 1 using (strcol(1) eq '@method@' ? $6 : 1/0):7 with linespoints @look@ ps 0.9 title '@method@'@end@, \
     'accuracy_cost.csv' skip 1 using (strcol(1) eq '@first@' ? $6 : 1/0):7:(sprintf('%g mm', $4)) with labels left offset 0.8,0.4 font ',9' notitle
unset multiplot
