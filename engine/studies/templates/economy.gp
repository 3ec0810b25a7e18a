# Segments, processor time and deviation of wires with half the chosen λ, with the chosen λ, and adaptive from
# either; economy.md lists λ and N of each.@scenes@
set multiplot layout 1,4
set style fill solid noborder
set boxwidth 0.9
set logscale y
unset key
set xtics scale 0 rotate by -25 font ',11'
set bmargin 6
set xtics (@tics@)
set xrange [-1:@right@]
@for panels@set title '@title@'
plot @for bars@'economy.csv' skip 1 using ($2==@variant@ ? 5*$1+@variant@ : 1/0):@column@ with boxes lc rgb '@colour@'@end@
@end@unset logscale
unset title
unset tics
unset border
set xrange [0:1]
set yrange [0:1]
set key center center reverse Left font ',12'
plot @keys@
unset multiplot
