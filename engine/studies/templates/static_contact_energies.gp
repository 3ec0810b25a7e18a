# Energy of one joint at depth x in the wall (the paper's Fig. 12): k = @stiffness:g@ N/mm, a wire that bends as a
# spring of @bending:g@ N/mm and would have the joint at @at:g@ mm. The minimum of the second order does not depend
# on x_0; that of the first overshoots to either side.
set multiplot layout 2,2
set grid lc rgb '#dddddd'
set xlabel 'x [mm], > 0 in the wall'
set ylabel 'energy [N·mm]'
set xrange [-0.04:0.14]
set key top left
set arrow 1 from 0, graph 0 to 0, graph 0.62 nohead lc rgb '#999999'
set title '(a) wall alone'
set yrange [-0.05:0.45]
plot 'static_contact_energies.csv' skip 1 using 1:2 with lines lw 2 lc rgb '#D55E00' title 'second order', \
     '' skip 1 using 1:3 with lines lw 2 lc rgb '#009E73' title 'first order, x_0 small', \
     '' skip 1 using 1:4 with lines lw 2 lc rgb '#0072B2' title 'first order, x_0 large'
set yrange [*:*]
set yrange [0:0.8]
set title '(b) second order'
set arrow 2 from @second:.6f@, graph 0 to @second:.6f@, graph 0.62 nohead dt 2 lc rgb '#D55E00'
plot 'static_contact_energies.csv' skip 1 using 1:5 with lines lc rgb '#CC79A7' title 'bending alone', \
     '' skip 1 using 1:6 with lines lw 2 lc rgb '#D55E00' title 'bending and wall', \
     -1 with lines dt 2 lc rgb '#D55E00' title 'where the model has its minimum'
unset arrow 2
unset arrow 3
set title '(c) first order from a small x_0'
set arrow 2 from @first_near:.6f@, graph 0 to @first_near:.6f@, graph 0.62 nohead dt 2 lc rgb '#009E73'
set arrow 3 from @near:.6f@, graph 0 to @near:.6f@, graph 0.62 nohead dt 3 lc rgb 'black'
plot 'static_contact_energies.csv' skip 1 using 1:5 with lines lc rgb '#CC79A7' title 'bending alone', \
     '' skip 1 using 1:7 with lines lw 2 lc rgb '#009E73' title 'bending and wall', \
     -1 with lines dt 2 lc rgb '#009E73' title 'where the model has its minimum', \
     -1 with lines dt 3 lc rgb 'black' title 'x_0'
unset arrow 2
unset arrow 3
set title '(d) first order from a large x_0'
set arrow 2 from @first_deep:.6f@, graph 0 to @first_deep:.6f@, graph 0.62 nohead dt 2 lc rgb '#0072B2'
set arrow 3 from @deep:.6f@, graph 0 to @deep:.6f@, graph 0.62 nohead dt 3 lc rgb 'black'
plot 'static_contact_energies.csv' skip 1 using 1:5 with lines lc rgb '#CC79A7' title 'bending alone', \
     '' skip 1 using 1:8 with lines lw 2 lc rgb '#0072B2' title 'bending and wall', \
     -1 with lines dt 2 lc rgb '#0072B2' title 'where the model has its minimum', \
     -1 with lines dt 3 lc rgb 'black' title 'x_0'
unset arrow 2
unset arrow 3
unset multiplot
