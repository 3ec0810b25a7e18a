unset logscale
set logscale y
set title 'Wild hands: time of a frame'
unset colorbox
set xlabel ''
set ylabel 'processor time [ms]'
set offsets 0.6,0.6,0,0
set autoscale x
set bmargin 9
set yrange [0.05:*]
set xtics rotate by -60 noenhanced font ',9'
plot 'robustness_hands.csv' skip 1 using 0:23:xtic(1) with points pt 9 ps 1.4 lc rgb '#D55E00' title 'longest', \
     '' skip 1 using 0:22 with points pt 7 ps 1.4 lc rgb '#E69F00' title '99 %', \
     '' skip 1 using 0:21 with points pt 5 ps 1.4 lc rgb '#0072B2' title 'median'
