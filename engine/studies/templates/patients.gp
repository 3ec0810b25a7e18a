# Drawn vessels against published ones: means and spreads, what consecutive seeds have in common, and the patients'
# ages.
set multiplot
set datafile separator ','
set grid
set size 1,0.58
set origin 0,0.42
set bmargin 14
set lmargin 14
set title 'Dimensions of 100 patients over the published mean: bars are ± 1 standard deviation'
set xtics rotate by 60 right font ',7'
set xrange [-1:]
set yrange [0.4:1.6]
set key top right horizontal
plot 'dimensions.csv' skip 1 using ($0-0.15):(1):($5/$4):xtic(strcol(1).': '.strcol(2)) with yerrorbars pointtype 7 pointsize 0.4 linecolor '#999999' title 'published', \
     '' skip 1 using ($0+0.15):($6/$4):($7/$4) with yerrorbars pointtype 7 pointsize 0.5 linecolor '#0072B2' title 'drawn'
set bmargin 3
set lmargin 8
set size 0.5,0.42
set origin 0,0
unset xtics
set xtics norotate font ',10'
set title 'Correlation of a dimension between consecutive seeds'
set xrange [-1:*]
set yrange [-1:1]
set xlabel 'dimension' offset 0,0.5
set key bottom right
plot 'dimensions.csv' skip 1 using 0:9 with points pointtype 7 pointsize 0.7 linecolor '#D55E00' title 'drawn', 0.25 linecolor '#999999' title '±0.25', -0.25 linecolor '#999999' notitle
set origin 0.5,0
set title 'Ascending aorta [mm] and age [years]'
set xlabel
set xrange [*:*]
set yrange [*:*]
set key top left
plot 'patients.csv' skip 1 using (strcol(2) eq 'f' ? $3 : 1/0):6 with points pointtype 7 linecolor '#CC79A7' title 'women', \
     '' skip 1 using (strcol(2) eq 'm' ? $3 : 1/0):6 with points pointtype 5 linecolor '#0072B2' title 'men'
unset multiplot
