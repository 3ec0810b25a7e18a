# How long each joint of a wire at rest touches the wall, and the mean size of an update (the paper's Fig. 11):
# @scene@, M = 1. In (a) joints that touch never leave, in (b) they bounce.
set multiplot layout 2,1
set style fill solid 0.7 noborder
set boxwidth 0.9
set yrange [0:105]
set ylabel 'in contact [% of updates]'
set y2label 'mean |ε_i|'
set logscale y2
set ytics nomirror
set y2tics format '10^{%L}'
set key outside top horizontal
set xrange [0:@beyond_last@]
set title '(a) with A and R'
set xlabel ''
plot 'static_contact.csv' skip 1 using (strcol(1) eq 'a' ? $2 : 1/0):3 with boxes lc rgb '#D55E00' title 'in contact', \
     '' skip 1 using (strcol(1) eq 'a' && $4 > 0 ? $2 : 1/0):4 axes x1y2 with lines lc rgb 'black' title 'mean |ε_i|'
set title '(b) without A and R'
set xlabel 'joint i'
plot 'static_contact.csv' skip 1 using (strcol(1) eq 'b' ? $2 : 1/0):3 with boxes lc rgb '#D55E00' title 'in contact', \
     '' skip 1 using (strcol(1) eq 'b' && $4 > 0 ? $2 : 1/0):4 axes x1y2 with lines lc rgb 'black' title 'mean |ε_i|'
unset multiplot
