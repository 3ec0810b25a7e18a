# Double relaxations at every pair of segments of a wire on its way to rest (the paper's Section 2.3.1, drawn there
# as Fig. 3): @scene@.
set multiplot layout 2,1
set grid lc rgb '#dddddd'
set xrange [1:@farthest@]
set object 1 rectangle from 10, graph 0 to 20, graph 1 behind fc rgb '#e8f3ec' fs noborder
set label 1 'best separations published' at 15, graph 0.06 center tc rgb '#2d6a4f'
set title 'energy released by two segments together, over that of each alone'
set ylabel 'synergy'
set yrange [0:*]
set key bottom right
plot 'pair_relaxation.csv' skip 1 using 1:2 with linespoints pt 7 ps 0.6 lw 2 lc rgb '#0072B2' title 'measured', \
     1 with lines dt 2 lc rgb 'black' title 'independent', \
     0.5 with lines dt 3 lc rgb 'black' title 'the second adds nothing'
unset label 1
set title 'how the two turn'
set xlabel 'separation δ = j − i [segments]'
set yrange [-1.05:1.05]
set ylabel 'cosine; share'
set key top right
plot 'pair_relaxation.csv' skip 1 using 1:3 with linespoints pt 7 ps 0.6 lw 2 lc rgb '#D55E00' title 'cosine between ε_i and ε_j: 1 alike, −1 against each other', \
     '' skip 1 using 1:4 with linespoints pt 5 ps 0.6 lw 2 lc rgb '#009E73' title 'interaction over the own term of i'
unset multiplot
