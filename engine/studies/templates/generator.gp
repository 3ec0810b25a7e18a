# Time to generate each vessel preset, and how far its triangles lie from the vessel meant. No wire.
set multiplot layout 1,2
set style fill solid 0.8
set boxwidth 0.7
unset key
set grid y
set xtics rotate by -40
set yrange [0:*]
set title 'Time to generate [s]'
plot 'generator.csv' skip 1 using 0:3:xtic(int($0)%2 == 0 ? strcol(1) : '') with boxes linecolor '#0072B2'
set title 'Distance of triangles from the vessel [µm]: half, 99 %, all within'
set key top right
plot 'generator.csv' skip 1 using 0:(1000*$9):xtic(int($0)%2 == 0 ? strcol(1) : '') with boxes linecolor '#D55E00' title 'all', \
     '' skip 1 using 0:(1000*$8) with boxes linecolor '#E69F00' title '99 %', \
     '' skip 1 using 0:(1000*$7) with boxes linecolor '#F0E442' title 'half'
unset multiplot
