# Lateral deviation of joint @joint@ against relaxation cycles (the paper's @figure@): @scene@.
set grid lc rgb '#dddddd'
set key outside right top
set xlabel 'relaxation cycles'
set ylabel 'lateral deviation d_{@joint@} [mm]'
set xrange [0:@cycles@]
plot @for methods@'@table@.csv' skip 1 using (strcol(1) eq '@method@' ? $2 : 1/0):3 with lines @look@ title '@method@'@end@
