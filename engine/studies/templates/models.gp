# Error of the tip over all frames of a solution against the time of a frame, a mark for each exercise and model
# (@exercises@ exercises). "All on" is against half of its λ, all others are against "all on"; what is below 1e-4 mm
# is drawn there.
set logscale xy
set xlabel 'processor time of a frame over that of "all on" [-]'
set ylabel 'rms error of the tip [mm]'
set key outside right top font ',12' spacing 1.3
set grid lc rgb '#DDDDDD'
set xrange [0.2:8]
set yrange [1e-4:40]
set xtics (0.25, 0.5, 1, 2, 4, 8)
set format y '10^{%L}'
plot @for models@'models.csv' skip 1 using ($2==@number@ ? $10 : 1/0):($6 < 1e-4 ? 1e-4 : $6) with points pt @mark@ ps 1 lw 1.2 lc rgb '@colour@' notitle@end@, \
     @for models@'models_median.csv' skip 1 every ::@row@::@row@ using 5:2 with points pt @mark@ ps 3.2 lw 3 lc rgb '@colour@' title '@model@'@end@
