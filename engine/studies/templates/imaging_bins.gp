set logscale y
set yrange [1e-5:0.2]
set grid y
set style data histogram
set style histogram cluster gap 1
set style fill solid noborder
set xtics rotate by -30
set key top left horizontal
set ylabel 'largest error of transmission at 74 kV'
plot 'imaging_bins_largest.csv' skip 1 using 2:xtic(1) title 'one energy' linecolor '#999999', \
     '' skip 1 using 3 title 'four of equal signal' linecolor '#E69F00', \
     '' skip 1 using 4 title 'four Gauss nodes' linecolor '#0072B2', \
     0.005 with lines linecolor 'black' dashtype 2 title 'figure to reach'
