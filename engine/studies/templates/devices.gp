# Friction and torsion. Above: the capstan against its closed form, and a wire pushed in and drawn back in the
# sinuous scene. Below: how a curved tip in a bend of 30 mm follows its hub, by the shaft's stiffness against
# torsion, and the processor time of half a segment's push at N = 100 and more, alone and with a catheter over the
# wire. Last: shafts that twist segment by segment: one pressed on a wall, which friction holds back, a precurved
# rod in a bend, and two precurved tubes in each other, which snap where they are too long.
set multiplot layout 4,2
set grid lc rgb '#dddddd'
set key default top left
set title 'Capstan: force of the hand round a bend'
set xlabel 'bend [deg]'
set ylabel 'force [N]'
set xrange [40:200]
set yrange [0:*]
plot @for capstans@'devices_capstan.csv' skip 1 using 1:($2 == @friction@ ? $4 : 1/0) with linespoints pt 0 lc rgb '@colour@' title 'μ = @friction@, closed form', '' skip 1 using 1:($2 == @friction@ ? $3 : 1/0) with points pt 7 lc rgb '@colour@' title 'wire'@end@
set key at graph 0.27,0.43
set title 'Pushed in and drawn back'
set xlabel 'inserted [mm]'
set ylabel 'force of the hand [N]'
set xrange [*:*]
set yrange [*:*]
plot @for loops@'devices_loop.csv' skip 1 using ($1 == @friction@ ? $2 : 1/0):3 with lines lw 2 lc rgb '@colour@' title 'μ = @friction@'@end@
set key default top left
set title 'The tip follows, lags or whips'
set xlabel 'hub [deg]'
set ylabel 'tip [deg]'
set xtics 90
set ytics 90
set xrange [0:360]
plot @for whips@'devices_whip.csv' skip 1 using ($1 == @curve@ ? $3 : 1/0):4 with lines lw 2 lc rgb '@colour@' title '@shaft@'@end@
set title 'What a push costs'
set xlabel ''
set ylabel 'processor time [ms]'
set logscale y
set style fill solid 0.85 noborder
set boxwidth 0.35
unset xrange
set xrange [-0.6:6.6]
set ytics auto
set yrange [0.05:*]
set xtics ('none' 0, 'friction' 1, 'torsion' 2, 'both' 3, 'segments' 4, 'catheter' 5, 'all' 6)
set key default top left
plot 'devices_cost.csv' skip 1 using ($0 - 0.2):5 with boxes lc rgb '#0072B2' title 'median', '' skip 1 using ($0 + 0.2):6 with boxes lc rgb '#E69F00' title '99 %'
unset logscale
set title 'A pressed shaft is held back along its length'
set xlabel 'hub [deg]'
set ylabel 'end [deg]'
set xtics 60
set ytics 60
set xrange [0:*]
set yrange [-10:*]
set key default top left
plot @for held@'devices_held.csv' skip 1 using ($1 == @value@ ? $2 : 1/0):3 with lines lw 2 lc rgb '@colour@' title 'μ = @value@', '' skip 1 using ($1 == @value@ ? $2 : 1/0):($2 > $4 ? $2 - $4 : 1/0) with lines dt 2 lc rgb '#555555' @exact@@end@
set xtics 90
set ytics 90
set xrange [0:360]
set yrange [0:360]
set ylabel 'tip [deg]'
set title 'A curved rod in a curved tube'
plot @for rods@'devices_snap.csv' skip 1 using ($1 == @value@ ? $2 : 1/0):3 with points pt 7 ps 0.4 lc rgb '@colour@' title 'L = @value@ mm', '' skip 1 using ($1 == @value@ ? $4 : 1/0):3 with lines dt 2 lc rgb '#555555' @exact@@end@
set title 'Curved tubes in each other'
plot @for tubes@'devices_tubes.csv' skip 1 using ($1 == @value@ ? $2 : 1/0):3 with points pt 7 ps 0.4 lc rgb '@colour@' title 'L√c = @value@', '' skip 1 using ($1 == @value@ ? $4 : 1/0):3 with lines dt 2 lc rgb '#555555' @exact@@end@
unset multiplot
