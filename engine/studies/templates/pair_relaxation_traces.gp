# Size of the two second-order terms along a wire at rest: R ≫ A, most of all for small i (the paper's Section 3.3,
# which gives a mean ratio of 22.7 and 18.0 between the first and the last R): @scene@.
set grid lc rgb '#dddddd'
set logscale y
set xlabel 'segment i'
set ylabel 'trace [N·mm]'
set key bottom left
plot 'pair_relaxation_traces.csv' skip 1 using 1:2 with steps lw 2 lc rgb '#D55E00' title 'Tr R_{(i,N)}, the wall', \
     '' skip 1 using 1:3 with lines lw 2 lc rgb '#0072B2' title 'Tr A_i, bending'
