# Energies of bending and of the wall by themselves (Eqs. 6 to 8 and 16), medians of the offsets. The wall's falls
# and bending's rises by more: Eq. 40 holds for their sum. Same tube and wire as Fig. 13b.
set grid lc rgb '#dddddd'
set key outside right center Left reverse
set xlabel 'resolution η = N''/N'
set ylabel 'change of energy over U [%]'
set xrange [1:3]
plot 'resolution_parts.csv' skip 1 using 1:2 with lines lw 2 lc rgb '#0072B2' title 'bending, smooth tube', \
     '' skip 1 using 1:4 with lines lc rgb '#56B4E9' title 'bending, in pieces', \
     '' skip 1 using 1:3 with lines lw 2 lc rgb '#D55E00' title 'wall, smooth tube', \
     '' skip 1 using 1:5 with lines lc rgb '#E69F00' title 'wall, in pieces', \
     100*@eq_8@*(1-1/x**2) with lines dt 2 lw 2 lc rgb 'black' title 'Eq. 8, its own constant', \
     100*@upsilon@*(1-1/x) with lines dt 3 lw 2 lc rgb 'black' title 'Eq. 16, fitted'
