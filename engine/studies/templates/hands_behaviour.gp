# @behaviour@: @measure@. @manipulation@. @note@
set multiplot layout 1,2 title '@behaviour@: @measured:.3g@@unit@ (@range@)' noenhanced
set grid lt 1 lc rgb '#dddddd'
set key noenhanced
set xlabel '@x_label@'
set ylabel '@y_label@'
set title 'What the hand does and feels' noenhanced
@band@set key off
plot 'hands_curves.csv' skip 1 using (@mine@ && $@part@ >= @first@ && $@part@ <= @last@ ? $@x@ : 1/0):@y@ with lines lw 2 lc rgb '#0072B2'
unset object 1
unset label 1
set key on outside right top vertical noenhanced
set size ratio -1
set xlabel '@across@ [mm]'
set ylabel '@up@ [mm]'
set title '@scenario@, @devices@' noenhanced
@drawing_range@plot 'hands_vessels.csv' skip 1 using (@mine@ ? $@vessel_x@ : 1/0):@vessel_y@:5 with circles fc rgb '#e9d8d4' fs solid noborder title 'vessels', \
     @for paths@'hands_paths.csv' skip 1 using (@mine@ && strcol(2) eq '@moment@' && strcol(3) eq '@device@' ? $@path_x@ : 1/0):@path_y@ with lines lw @width@ lc rgb '@colour@' title '@device@, @moment@'@end@
unset multiplot
