set logscale xy
set grid
set key top left
set xlabel 'facet over radius, h/r'
set ylabel 'mean error of path length [% of radius]'
set xtics (0.02, 0.05, 0.1, 0.2, 0.5)
set xrange [0.02:0.8]
set yrange [0.01:20]
plot 1 linecolor '#999999' dashtype 2 title 'figure to reach', \
     8*x*x linecolor '#bbbbbb' title '∝ h²', \
     'imaging_closed_forms.csv' skip 1 using 3:(strcol(1) eq 'sphere' ? $4 : 1/0) with linespoints pointtype 7 linecolor '#0072B2' title 'sphere', \
     'imaging_closed_forms.csv' skip 1 using 3:(strcol(1) eq 'cylinder' ? $4 : 1/0) with linespoints pointtype 7 linecolor '#D55E00' title 'cylinder', \
     'imaging_closed_forms.csv' skip 1 using 3:(strcol(1) eq 'torus' ? $4 : 1/0) with linespoints pointtype 7 linecolor '#009E73' title 'torus'
