# What a tube has of the paper's Fig. 13 against what it has of its Fig. 18, for the same wire of 175 segments: a
# wall as soft as Section 3.3 implies moves the wire too far for Fig. 18 where it has Fig. 13. Only walls ten times
# as stiff and more lie in the green field, where both hold.
set grid lc rgb '#dddddd'
set logscale xy
set xlabel 'ΔU/U at η = 3 [%], Fig. 13'
set ylabel '|d| that 95 % of all joints and walls stay below [µm], Fig. 18'
set key top left Left reverse
set xrange [0.01:10]
set yrange [0.1:1000]
set object 1 rectangle from @low:.4f@,0.1 to @high:.4f@,5 behind fc rgb '#cfe8d5' fs noborder
set label 1 'published: both' at @published:.4f@,0.2 center tc rgb '#2d6a4f'
set arrow 1 from 0.01,5 to 10,5 nohead dt 3 lc rgb '#2d6a4f'
set arrow 2 from @published:.4f@,0.1 to @published:.4f@,1000 nohead dt 3 lc rgb '#2d6a4f'
plot 'paper_tubes.csv' skip 1 using (strcol(1) eq 'bends wider' ? 100*$4 : 1/0):(1000*$9) with linespoints pt 7 lw 2 lc rgb '#D55E00' title 'scene coronary, bends 0.95 to 6 times as wide', \
     'paper_tubes.csv' skip 1 using (strcol(1) eq 'wall stiffer' ? 100*$4 : 1/0):(1000*$9) with linespoints pt 5 lw 2 lc rgb '#0072B2' title 'tube of Fig. 13, wall 0.1 to 100 times as stiff', \
     'paper_tubes.csv' skip 1 using (strcol(1) eq 'wall stiffer in sinuous' ? 100*$4 : 1/0):(1000*$9) with linespoints pt 9 lw 2 lc rgb '#009E73' title 'scene sinuous, wall 0.1 to 10 times as stiff', \
     'paper_tubes.csv' skip 1 using (strcol(1) eq 'bends tighter and wall stiffer' ? 100*$4 : 1/0):(1000*$9) with points pt 4 lw 2 lc rgb '#56B4E9' title 'scene coronary, bends 0.75 to 0.95 and wall 3 to 30 times', \
     'paper_tubes.csv' skip 1 using (strcol(1) eq 'scene' ? 100*$4 : 1/0):(1000*$9) with points pt 6 ps 1.6 lw 2 lc rgb '#CC79A7' title 'coronary-tight, sharp, tube of Fig. 13 in pieces'
