#!/bin/bash
# Plots the summary of tables.sh as the charts of the first page, with gnuplot:
#
#   bash tests/bench/plot_summary.sh [MACHINE]       writes client/pictures/summary_MACHINE{,_dark}.svg
#   bash tests/bench/plot_summary.sh [MACHINE] png   writes PNGs for viewing into the same folder
#   bash tests/bench/plot_summary.sh [MACHINE] check   fails if a chart lacks a label of the summary
#
# One bar per library and task on a logarithmic axis of time. The share of wrong answers is written
# on the bar.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
machine=${1:-epyc_gcc12}
format=${2:-svg}

# rows: prints a line per task: nanoseconds of hulld and of the peer, labels of both bars, the wrong
# answers of the peer, and the task, separated by tabs.
rows() {
  bash tables.sh summary "$machine" | awk -F' *[|] *' '
    function nanoseconds(text,   part) {
      split(text, part, " ")
      return part[1] * (part[2] == "us" ? 1e3 : part[2] == "ms" ? 1e6 : part[2] == "s" ? 1e9 : 1)
    }
    NR > 2 && NF > 5 {
      split($4, peer, ": ")
      split($6, wrong, " / ")
      printf "%s\t%s\t%s\t%s: %s\t%s\t%s\n", nanoseconds($3), nanoseconds(peer[2]), $3, peer[1], peer[2],
             wrong[2] ~ /%/ ? wrong[2] " wrong" : " ", $2
    }'
}

if [[ $format == check ]]; then
  for chart in ../../client/pictures/summary_"$machine"{,_dark}.svg; do
    rows | cut -f 3- | tr '\t' '\n' | grep -v '^ *$' | while IFS= read -r label; do
      grep -qF ">$label<" "$chart" || { echo "$chart lacks \"$label\"; run plot_summary.sh"; exit 1; }
    done
  done
  exit
fi

# plot NAME INK GRID OURS PEER WRONG BACKGROUND
plot() {
  local terminal tasks
  case $format in
    svg) terminal="svg size 860,540 font 'Helvetica,13'" ;;
    png) terminal="pngcairo size 860,540 font 'Helvetica,10' background '$7'" ;;
    *)
      echo "plot_summary.sh: unknown format $format; pass svg, png, or check" >&2
      exit 2
      ;;
  esac
  tasks=$(rows | wc -l)
  gnuplot <<END
set terminal $terminal
set output '../../client/pictures/$1.$format'
\$rows <<EOD
$(rows)
EOD
set datafile separator '\t'
set logscale x
set lmargin at screen 0.36
set rmargin at screen 0.98
set xrange [5:3e11]
set yrange [$tasks - 0.3:-0.7]
set xtics ('10 ns' 1e1, '100 ns' 1e2, '1 us' 1e3, '10 us' 1e4, '100 us' 1e5, '1 ms' 1e6, \\
           '10 ms' 1e7, '100 ms' 1e8) textcolor rgb '$2' scale 0
set grid xtics lt 1 lw 0.6 lc rgb '$3'
set border 0
set ytics scale 0 textcolor rgb '$2'
set key at graph 0.995, graph 0.595 right top samplen 1.2 textcolor rgb '$2'
set style fill solid 1 noborder
plot \$rows using (\$1):0:(5):1:(\$0 - 0.34):(\$0 - 0.03):ytic(6) with boxxyerror lc rgb '$4' title 'hulld', \\
     '' using (\$2):0:(5):2:(\$0 + 0.03):(\$0 + 0.34) with boxxyerror lc rgb '$5' title 'fastest of qhull, CGAL, Bullet, FCL, libccd', \\
     '' using 1:(\$0 - 0.185):(strcol(3)) with labels left offset 0.6,0 font ',12' textcolor rgb '$2' notitle, \\
     '' using 2:(\$0 + 0.185):(strcol(4)) with labels left offset 0.6,0 font ',12' textcolor rgb '$2' notitle, \\
     '' using (\$2 * 600):(\$0 + 0.185):5 with labels left offset 0.6,0 font ',12' textcolor rgb '$6' notitle
END
}

plot "summary_$machine" '#24292f' '#d0d7de' '#0969da' '#afb8c1' '#cf222e' white
plot "summary_${machine}_dark" '#e6edf3' '#30363d' '#58a6ff' '#6e7681' '#ff7b72' '#0d1117'
