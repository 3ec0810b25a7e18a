# Processor time of a relaxation cycle, the mean of the first ten, beside the paper's Table 1, which is of another
# machine: @scene@. In all but the last every joint that moves is asked, as in the paper; there only those that may
# have come to touch. 4M × 4M: solved as the paper prints it, else in 2M tangents.
set multiplot layout 1,@panels@
set style data histograms
set style histogram rowstacked
set boxwidth 0.7
set style fill solid 0.8 noborder
set grid y lc rgb '#dddddd'
set yrange [0:@top:.3f@]
set key top left
set xlabel 'varied segments M'
set ylabel 'processor time of a cycle [s]'
set datafile missing NaN
$published << END
1,@wall1@,@solution1@
2,@wall2@,@solution2@
3,@wall3@,@solution3@
END
set title 'published (Table 1)'
plot $published using 2:xtic(1) lc rgb '#E69F00' title 'wall', '' using 3 lc rgb '#56B4E9' title 'solution'
set ylabel ''
@for walls@set title '@wall@'
plot '< grep "^@wall@," cost.csv' using 3:xtic(2) lc rgb '#D55E00' title 'wall', \
     '' using 4 lc rgb '#0072B2' title 'solution'
@end@unset multiplot
