set multiplot layout 1,2
set grid
set title 'Noise power over that at frequency 0'
set xlabel 'frequency [1/mm]'
set yrange [0:1.3]
set key top right
plot 'imaging_noise_spectrum.csv' skip 1 using 3:(strcol(1) eq 'quanta' && $2 == 0.586 ? $4 : 1/0) with points pointtype 7 pointsize 0.6 linecolor '#0072B2' title 'pixel 0.586 mm', \
 '' skip 1 using 3:(strcol(1) eq 'quanta' && $2 == 0.586 ? $5 : 1/0) with lines linecolor '#0072B2' notitle, \
 'imaging_noise_spectrum.csv' skip 1 using 3:(strcol(1) eq 'quanta' && $2 == 0.293 ? $4 : 1/0) with points pointtype 7 pointsize 0.6 linecolor '#D55E00' title '0.293 mm', \
 '' skip 1 using 3:(strcol(1) eq 'quanta' && $2 == 0.293 ? $5 : 1/0) with lines linecolor '#D55E00' notitle, \
 'imaging_noise_spectrum.csv' skip 1 using 3:(strcol(1) eq 'quanta' && $2 == 0.15 ? $4 : 1/0) with points pointtype 7 pointsize 0.6 linecolor '#009E73' title '0.15 mm', \
 '' skip 1 using 3:(strcol(1) eq 'quanta' && $2 == 0.15 ? $5 : 1/0) with lines linecolor '#009E73' notitle, \
 'imaging_noise_spectrum.csv' skip 1 using 3:(strcol(1) eq 'electronic' && $2 == 0.293 ? $4 : 1/0) with points pointtype 7 pointsize 0.6 linecolor '#999999' title 'electronic, 0.293 mm', \
 '' skip 1 using 3:(strcol(1) eq 'electronic' && $2 == 0.293 ? $5 : 1/0) with lines linecolor '#999999' notitle
set title 'Variance over that of a Poisson count'
set xlabel 'mean quanta'
set logscale x
set xrange [0.7:7000]
set yrange [0.98:1.02]
unset key
plot 'imaging_noise.csv' skip 1 using 1:2:(2*sqrt((2+1/$1)/$4)) with yerrorbars pointtype 7 linecolor '#0072B2', 1.01 with lines linecolor '#999999' dashtype 2, 0.99 with lines linecolor '#999999' dashtype 2
unset multiplot
