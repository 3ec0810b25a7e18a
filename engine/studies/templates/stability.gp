# What breaks which method: outcome, energy at the end, farthest joint from the reference, processor time. The scene
# of each case, with N, λ, EI and k, is in stability.md.
set title 'What breaks which method: energy, farthest joint from the reference, processor time' font ',14'
unset key
unset colorbox
set tics scale 0
set border 0
set palette maxcolors 7
set palette defined (0 '#009E73', 1 '#F0E442', 2 '#E69F00', 3 '#56B4E9', 4 '#D55E00', 5 '#999999', 6 '#CC79A7')
set cbrange [-0.5:6.5]
unset xtics
set xrange [-0.5:@last_method@.5]
set x2range [-0.5:@last_method@.5]
set yrange [@last_case@.5:-0.5]
set x2tics @methods@ font ',12'
set ytics @cases@ font ',12'
plot 'stability.csv' skip 1 using 2:1:(0.485):(0.47):6 with boxxyerror fillstyle solid noborder palette, \
     '' skip 1 using 2:($1-0.26):5 with labels font ',12', \
     '' skip 1 using 2:($1+0.04):16 with labels font ',9', \
     '' skip 1 using 2:($1+0.29):17 with labels font ',9'
