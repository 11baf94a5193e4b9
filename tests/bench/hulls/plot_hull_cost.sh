#!/bin/bash
# Plots hull_cost_MACHINE.csv of tests/bench/results/ as hull_cost_MACHINE.svg, with gnuplot: the
# time of a whole hull against the number of points, for a ball and a sphere.
#
#   bash tests/bench/hulls/plot_hull_cost.sh [MACHINE] [png]
#
# With `png`, writes a PNG for viewing instead, in the same folder.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../results"

rows=hull_cost_${1:-epyc_gcc12}.csv
format=${2:-svg}
case $format in
  svg) terminal="svg size 960,440 font 'Helvetica,13' background 'white'" ;;
  png) terminal="pngcairo size 960,440 font 'Helvetica,11'" ;;
  *)
    echo "plot_hull_cost.sh: unknown format $format; pass svg or png" >&2
    exit 2
    ;;
esac

# Prints points and milliseconds of a shape and library, by the names of the columns.
series() {
  awk -F, -v shape="$1:" -v library="$2" '
    NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
    index($1, shape) == 1 && $2 == library { print $column["points"], $column["milliseconds"] }
  ' "$rows" | sort -n
}

panel() {
  local shape=$1 title=$2
  cat <<END
set title "$title"
plot '-' title "hulld, at once" with linespoints ls 1, \\
     '-' title "hulld, one at a time" with linespoints ls 2, \\
     '-' title "qhull" with linespoints ls 3, \\
     '-' title "CGAL" with linespoints ls 4, \\
     '-' title "CGAL Delaunay, one at a time" with linespoints ls 5
END
  local library
  for library in "hulld" "hulld one at a time" "qhull" "cgal" "cgal delaunay one at a time"; do
    series "$shape" "$library"
    echo e
  done
}

{
  cat <<END
set terminal $terminal
set output '${rows%.csv}.$format'
set multiplot layout 1,2
set logscale xy
set xrange [70:1.5e6]
set yrange [0.01:2e6]
set format x '10^{%T}'
set format y '10^{%T}'
set xlabel 'points'
set ylabel 'milliseconds'
set grid lc rgb '#dddddd'
set key top left Left reverse samplen 2 spacing 1.1
set style line 1 lc rgb '#0b5394' lw 2.5 pt 7 ps 0.7
set style line 2 lc rgb '#3d9ad1' lw 2.5 pt 6 ps 0.7
set style line 3 lc rgb '#cc4125' lw 1.5 pt 5 ps 0.6
set style line 4 lc rgb '#6aa84f' lw 1.5 pt 9 ps 0.7
set style line 5 lc rgb '#b7950b' lw 1.5 pt 8 ps 0.7
END
  panel ball "points in a ball"
  panel sphere "points on a sphere: all are vertices"
} | gnuplot
