# Lateral deviation of joint @joint@ against relaxation cycles for M = 1 and for two and three varied segments at a
# fixed separation δ (the paper's Fig. 5). Solid: the separations that the paper calls best, 10 to 20. @scene@.
set multiplot layout 2,1
set grid lc rgb '#dddddd'
set key outside right top
set logscale y
set format y '10^{%L}'
set yrange [1e-4:3]
set xrange [0:@cycles@]
set ylabel '|d_{@joint@}| [mm]'
set label 1 '0.1 mm' at @cycles@,0.13 right tc rgb '#666666'
set arrow 1 from 0,0.1 to @cycles@,0.1 nohead dt 3 lc rgb '#666666'
set title '(a) two varied segments'
set xlabel ''
plot 'separation.csv' skip 1 using (strcol(1) eq 'M = 1' ? $2 : 1/0):(abs($3)) with lines lw 2 lc rgb '#999999' title 'M = 1', \
     @for two@'separation.csv' skip 1 using (strcol(1) eq '@run@' ? $2 : 1/0):(abs($3)) with lines @look@ lc rgb '@colour@' title 'δ = @separation@'@end@
set title '(b) three varied segments'
set xlabel 'relaxation cycles'
plot 'separation.csv' skip 1 using (strcol(1) eq 'M = 1' ? $2 : 1/0):(abs($3)) with lines lw 2 lc rgb '#999999' title 'M = 1', \
     @for three@'separation.csv' skip 1 using (strcol(1) eq '@run@' ? $2 : 1/0):(abs($3)) with lines @look@ lc rgb '@colour@' title 'δ = @separation@'@end@
unset multiplot
