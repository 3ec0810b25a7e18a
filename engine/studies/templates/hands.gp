# Every size of the study in its published range, shaded. A point beyond an end of the axis is as far or farther
# out. Rows without a point have no published size, or did not appear.
$sizes << EOD
@sizes@EOD
set datafile separator whitespace
set grid lt 1 lc rgb '#dddddd'
set xrange [-0.7:1.7]
set yrange [0.3:@top@]
set ytics noenhanced (@tics@)
set xtics ('low end' 0, 'high end' 1)
set xlabel 'size in its published range'
set object 1 rectangle from 0, graph 0 to 1, graph 1 fc rgb '#009E73' fs transparent solid 0.15 noborder behind
set key outside center bottom vertical maxrows 2
set bmargin 8
set title 'What devices do in hands, beside published sizes'
plot $sizes using ($3 == 0 ? $1 : 1/0):2 with points pt 7 ps 1.8 lc rgb '#0072B2' title 'of this kind of course', $sizes using ($3 == 1 ? $1 : 1/0):2 with points pt 6 ps 1.8 lw 2 lc rgb '#D55E00' title 'of another course: not counted'
