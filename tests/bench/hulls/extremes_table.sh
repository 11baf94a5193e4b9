#!/bin/bash
# Prints the README's table of extremes from hull_extremes_MACHINE.csv of tests/bench/results/.
#
#   bash tests/bench/hulls/extremes_table.sh [MACHINE]
set -euo pipefail

rows=$(dirname "${BASH_SOURCE[0]}")/../results/hull_extremes_${1:-epyc_gcc12}.csv

# The rows of the table: a name among Extremes(), and what it is.
meanings() {
  cat <<'END'
scale_5e_324|ball of multiples of 5e-324
scale_1e_310|ball of radius 1e-310
scale_1e_300|ball of radius 1e-300
scale_1e300|ball of radius 1e300
scale_1e300_sphere|sphere of radius 1e300
scale_largest|cube up to the largest double
offset_1e15|ball of radius 100 at 1e15
offset_1e15_few_ulps|sphere of 16 units in the last place at 1e15
ulp_tilted_plane|tilted plane, each point rounded
ulp_one_point_off_plane|integer plane, one point an ulp off
ulp_box_faces|box, its faces jittered by an ulp
ulp_rotated_lattice|lattice, rotated
cospherical|integer points on a sphere
cocircular_drum|two integer circles, prism
sliver_pancake|ball squeezed to 1 : 1 : 1e-12, rotated
sliver_needle|ball squeezed to 1 : 1e-12 : 1e-12, rotated
mixed_1e60|coordinates of 1e-60 to 1e60
mixed_1e300|coordinates of 1e-300 to 1e300
mixed_tiny_clusters|clusters 1e-9 wide on a cube's corners
order_sorted|sphere, sorted along x
order_spiral|sphere, as a spiral
order_growing_shells|shells, each outside all before
order_plane_first|a plane first, then a ball
order_rising_apexes|a circle, then rising apexes
duplicates_of_cube|8 points over and over
duplicates_of_sphere|500 points over and over
END
}

echo "| points | n | vertices | at once, ms | times generic | one by one, ms | times generic |"
echo "|---|---|---|---|---|---|---|"
awk -F'|' -v rows="$rows" '
  function three(x) { return x < 1 ? sprintf("%.2f", x) : x < 100 ? sprintf("%.3g", x) : sprintf("%d", x) }
  BEGIN {
    FS = ","
    while ((getline < rows) > 0) {
      if ($1 == "workload") { for (i = 1; i <= NF; ++i) column[$i] = i; continue }
      place = $2 == "hulld" ? 1 : 2
      points[$1] = $column["points"]; vertices[$1] = $column["vertices"]
      ms[$1, place] = $column["milliseconds"]; times[$1, place] = $column["times_generic"]
    }
    FS = "|"
  }
  { split($0, part, "|"); name = part[1] }
  name in points {
    printf "| %s | %d | %d | %s | %s | %s | %s |\n", part[2], points[name], vertices[name],
           three(ms[name, 1]), three(times[name, 1]), three(ms[name, 2]), three(times[name, 2])
  }
' <(meanings)
