# Mean and rms of the lateral deviation of each joint in @realisations@ realisations (the paper's Fig. 17), in both
# tubes. @where@.
set grid lc rgb '#dddddd'
set multiplot layout 1,2
set xlabel 'joint i'
set ylabel 'deviation d_i [µm]'
set key top left
@for tubes@set title '@tube@'
plot 'wall_variation_joints.csv' skip 1 using (strcol(1) eq '@tube@' ? $2 : 1/0):(1000*$3) with lines lw 1.5 lc rgb '#009E73' title 'mean', \
     '' skip 1 using (strcol(1) eq '@tube@' ? $2 : 1/0):(1000*$4) with lines lw 1.5 lc rgb '#D55E00' title 'rms'
@end@unset multiplot
