# Energy at rest against the number of segments (the paper's Fig. 13b): scene coronary, lumen radius 1 mm, the
# artery in straight pieces of @piece:.3g@ mm, a wire of @coarse@ mm, λ = @coarse@ mm/N', EI = 50 N·mm², k =
# @stiffness:.3g@ N/mm a joint. The tube was chosen by c1 and the value at η = 3, its scatter was not.
set grid lc rgb '#dddddd'
set key bottom right Left reverse box lc rgb '#dddddd' opaque
set xlabel 'resolution η = N''/N'
set ylabel 'ΔU/U [%]'
set xrange [1:3]
set yrange [-0.2:3.2]
plot 'resolution.csv' skip 1 using 2:5:7 with filledcurves fc rgb '#f6d9c4' title 'offsets of the pieces, a tenth to nine tenths', \
     '' skip 1 using 2:4 with points pt 7 ps 0.45 lc rgb '#D55E00' title 'one offset, N'' = @coarse@ to @finest@', \
     '' skip 1 using 2:8 with lines lw 2 lc rgb '#0072B2' title 'smooth tube', \
     100*(@c1@*(1-1/x) + @c2@*(1-1/x**2)) with lines lw 2 lc rgb 'black' title 'fit: c_1 = @c1:.4f@, c_2 = @c2:.4f@ (medians)', \
     100*(@published_c1@*(1-1/x) + @published_c2@*(1-1/x**2)) with lines lw 2 dt 2 lc rgb 'black' title 'published: c_1 = @published_c1@, c_2 = @published_c2@', \
     2.5 with lines dt 3 lc rgb '#666666' title 'published: less than 2.5 %'
