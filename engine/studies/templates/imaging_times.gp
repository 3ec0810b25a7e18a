set multiplot layout 1,2
set style data histogram
set style histogram rowstacked
set style fill solid noborder
set boxwidth 0.7
set grid y
set yrange [0:*]
set title 'A frame at a cached pose [ms]'
set key top left reverse Left
set xlabel 'pixels'
plot 'imaging_frame_ms.csv' skip 1 using 2:xtic(1) title 'bare image' linecolor '#999999', \
     'imaging_frame_ms.csv' skip 1 using 3:xtic(1) title 'wire' linecolor '#000000', \
     'imaging_frame_ms.csv' skip 1 using 4:xtic(1) title 'contrast' linecolor '#CC79A7', \
     'imaging_frame_ms.csv' skip 1 using 5:xtic(1) title 'quanta' linecolor '#0072B2', \
     'imaging_frame_ms.csv' skip 1 using 6:xtic(1) title 'scintillator' linecolor '#56B4E9', \
     'imaging_frame_ms.csv' skip 1 using 7:xtic(1) title 'electronics' linecolor '#009E73', \
     'imaging_frame_ms.csv' skip 1 using 8:xtic(1) title 'display' linecolor '#E69F00'
set title 'A new pose [ms], by pixels'
set xlabel 'triangles [1000]'
set xtics rotate by -30
plot 'imaging_pose_ms.csv' skip 1 using 5:xtic(sprintf('%.0f, %d', $2/1000, int($4))) title 'path lengths' linecolor '#0072B2', \
     'imaging_pose_ms.csv' skip 1 using 6:xtic(sprintf('%.0f, %d', $2/1000, int($4))) title 'beam and display' linecolor '#E69F00', \
     'imaging_pose_ms.csv' skip 1 using 7:xtic(sprintf('%.0f, %d', $2/1000, int($4))) title 'frame' linecolor '#999999', \
     'imaging_pose_ms.csv' skip 1 using 8:xtic(sprintf('%.0f, %d', $2/1000, int($4))) title 'contrast matrix' linecolor '#CC79A7'
unset multiplot
