# How often Algorithm 2 chooses each separation in @cycles@ cycles (the paper's Fig. 9): @scene@. The bars at 5 and
# at 25 also hold what would lie beyond them; published: δ1 = 5 somewhat above 25 and a fall between, δ2 = 5 large.
set multiplot layout 3,1
set grid y lc rgb '#dddddd'
set style fill solid 0.85 noborder
set boxwidth 0.26
set xtics 5,1,25
set xrange [4.4:25.6]
set yrange [0:*]
set key top center
set ylabel 'chosen [%]'
set title 'M = 2'
set xlabel ''
plot 'separation_frequency.csv' skip 1 using ($1 == 2 && $2 == 1 ? $3 + 0 : 1/0):4 with boxes lc rgb '#0072B2' title 'δ_1'
set title 'M = 3'
set xlabel ''
plot 'separation_frequency.csv' skip 1 using ($1 == 3 && $2 == 1 ? $3 + -0.14 : 1/0):4 with boxes lc rgb '#0072B2' title 'δ_1', \
     'separation_frequency.csv' skip 1 using ($1 == 3 && $2 == 2 ? $3 + 0.14 : 1/0):4 with boxes lc rgb '#E69F00' title 'δ_2'
set title 'M = 4'
set xlabel 'separation δ [segments]'
plot 'separation_frequency.csv' skip 1 using ($1 == 4 && $2 == 1 ? $3 + -0.28 : 1/0):4 with boxes lc rgb '#0072B2' title 'δ_1', \
     'separation_frequency.csv' skip 1 using ($1 == 4 && $2 == 2 ? $3 + 0 : 1/0):4 with boxes lc rgb '#E69F00' title 'δ_2', \
     'separation_frequency.csv' skip 1 using ($1 == 4 && $2 == 3 ? $3 + 0.28 : 1/0):4 with boxes lc rgb '#009E73' title 'δ_3'
unset multiplot
