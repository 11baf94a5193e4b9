#!/bin/bash
# Plots query_live_MACHINE.csv of tests/bench/results/ as query_live_MACHINE.svg, with gnuplot: the
# time of a step of a growing hull, one point and one query, against its size.
#
#   bash tests/bench/live/plot_live.sh [MACHINE] [png]
#
# With `png`, writes a PNG for viewing instead, in the same folder.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../results"

rows=query_live_${1:-epyc_gcc12}.csv
format=${2:-svg}
case $format in
  svg) terminal="svg size 640,440 font 'Helvetica,13' background 'white'" ;;
  png) terminal="pngcairo size 640,440 font 'Helvetica,11'" ;;
  *)
    echo "plot_live.sh: unknown format $format; pass svg or png" >&2
    exit 2
    ;;
esac

# Prints vertices and microseconds of a library: a column of its rows of a workload.
series() {
  sed -n 's/^"1 point, 1 query",/"1",/p' "$rows" |
    awk -F, -v library="$1" -v column="$2" '$2 == library { print $3, $column }'
  echo e
}

{
  cat <<END
set terminal $terminal
set output '${rows%.csv}.$format'
set logscale xy
set xrange [40:1.6e6]
set yrange [0.5:2e6]
set format x '10^{%T}'
set format y '10^{%T}'
set xlabel 'vertices'
set ylabel 'microseconds'
set title 'a point is added, then a query asked'
set grid lc rgb '#dddddd'
set key top left Left reverse samplen 2 spacing 1.1
set style line 1 lc rgb '#0b5394' lw 2.5 pt 7 ps 0.7
set style line 2 lc rgb '#3d9ad1' lw 2.5 pt 6 ps 0.7
set style line 3 lc rgb '#cc4125' lw 1.5 pt 5 ps 0.6
set style line 4 lc rgb '#e69138' lw 1.5 pt 4 ps 0.6
plot '-' title "hulld, median" with linespoints ls 1, \\
     '-' title "hulld, 99 of 100 steps" with linespoints ls 2, \\
     '-' title "Bullet, median" with linespoints ls 3, \\
     '-' title "Bullet with its box, median" with linespoints ls 4
END
  series hulld 4
  series hulld 5
  series Bullet 4
  series Bullet 9
} | gnuplot
