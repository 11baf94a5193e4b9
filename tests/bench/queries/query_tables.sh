#!/bin/bash
# Prints the README's tables of queries from tests/bench/results/.
#
#   bash tests/bench/queries/query_tables.sh [MACHINE]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../results"
machine=${1:-epyc_gcc12}

# Reads rows of CSV by the names in the head: ns[workload, library] and so on.
read -r -d '' library <<'AWK' || true
FNR == 1 { for (i = 1; i <= NF; i++) column[$i] = i; next }
{
  key = $1 SUBSEP $2
  ns[key] = $column["ns"]
  wrong[key] = "wrong" in column ? $column["wrong"] : ""
  largest[key] = "largest_error" in column ? $column["largest_error"] : ""
  pairs[key] = "pairs" in column ? $column["pairs"] : ""
}
function short(value) {
  if (value == "") return "-"
  if (value < 999.5) return sprintf("%.0f", value)
  if (value < 99950) return sprintf("%.1fk", value / 1e3)
  if (value < 999500) return sprintf("%.0fk", value / 1e3)
  return sprintf("%.1fM", value / 1e6)
}
function head(text,   i, n, part) {
  print text
  n = split(text, part, "|")
  for (i = 2; i < n; i++) printf "|---"
  print "|"
}
AWK

echo "Far / close / gap / deep, nanoseconds:"
echo
awk -F, "$library"'
END {
  head("| hulls | hulld | FCL, libccd | FCL, own | libccd MPR | libccd GJK | Bullet | SAT, plain double |")
  split("sphere:8,sphere:64,sphere:512,sphere:10000,ur5", sets, ",")
  split("hulld,FCL libccd,FCL indep,libccd MPR,libccd GJK,Bullet,SAT double", names, ",")
  split("far,close,gap,deep", regimes, ",")
  for (s = 1; s <= 5; s++) {
    printf "| %s |", sets[s]
    for (n = 1; n <= 7; n++) {
      text = ""
      for (r = 1; r <= 4; r++) {
        key = sets[s] " " regimes[r] SUBSEP names[n]
        text = text (r > 1 ? " / " : "") short(ns[key])
        if (wrong[key] > 0) text = text " (" wrong[key] " wrong)"
      }
      gsub(/ /, "\\&nbsp;", text)
      gsub(/&nbsp;\/&nbsp;/, " / ", text)
      printf " %s |", n == 1 ? "**" text "**" : text
    }
    print ""
  }
}' "query_relation_$machine.csv"

echo
echo "Contact, exact: a vertex on a vertex; nanoseconds (wrong of 128):"
echo
awk -F, "$library"'
END {
  head("| hulls | hulld | FCL, libccd | FCL, own | libccd MPR | libccd GJK | Bullet |")
  split("sphere:8,sphere:64,sphere:512,sphere:10000,ur5", sets, ",")
  split("hulld,FCL libccd,FCL indep,libccd MPR,libccd GJK,Bullet", names, ",")
  for (s = 1; s <= 5; s++) {
    printf "| %s |", sets[s]
    for (n = 1; n <= 6; n++) {
      key = sets[s] " contact" SUBSEP names[n]
      printf " %s (%s) |", short(ns[key]), wrong[key]
    }
    print ""
  }
}' "query_relation_$machine.csv"

for question in contact distance; do
  echo
  echo "The $question, nanoseconds (largest error):"
  echo
  awk -F, -v question="$question" "$library"'
  END {
    head("| hulls | hulld | FCL, libccd | FCL, own | libccd GJK | Bullet |")
    split(question == "contact" ? "sphere:64 deep,sphere:512 deep,ur5 graze,ur5 deep" \
                                : "sphere:64 close,sphere:512 close,ur5 far,ur5 close,ur5 gap", sets, ",")
    split("hulld,FCL libccd,FCL indep,libccd GJK,Bullet", names, ",")
    for (s = 1; s in sets; s++) {
      printf "| %s |", sets[s]
      for (n = 1; n <= 5; n++) {
        key = sets[s] SUBSEP names[n]
        if (key in ns) {
          printf " %s (%.0e) |", short(ns[key]), largest[key]
        } else {
          printf " - |"
        }
      }
      print ""
    }
  }' "query_${question}_$machine.csv"
done

echo
echo "Following a motion, nanoseconds:"
echo
awk -F, "$library"'
END {
  head("| hulls | close, warm | cold | gap, warm | cold | deep, warm | cold |")
  split("sphere:8,sphere:64,sphere:512,sphere:10000,ur5", sets, ",")
  split("close,gap,deep", regimes, ",")
  for (s = 1; s <= 5; s++) {
    printf "| %s |", sets[s]
    for (r = 1; r <= 3; r++) {
      at = sets[s] " " regimes[r]
      printf " %s | %s |", short(ns[at " warm" SUBSEP "hulld"]), short(ns[at " cold" SUBSEP "hulld"])
    }
    print ""
  }
}' "query_motion_$machine.csv"

echo
echo "Scenes, milliseconds:"
echo
awk -F, "$library"'
END {
  head("| scene | colliding pairs | hulld | FCL, tree | times FCL |")
  split("1000 of sphere:64,10000 of sphere:64,1000 of ur5,10000 of ur5", sets, ",")
  for (s = 1; s <= 4; s++) {
    ours = ns[sets[s] SUBSEP "hulld"]
    theirs = ns[sets[s] SUBSEP "FCL tree"]
    if (ours == "") continue
    printf "| %s | %s | %.3g | %.3g | %.1f |\n", sets[s], pairs[sets[s] SUBSEP "hulld"], ours / 1e6, theirs / 1e6, theirs / ours
  }
}' "query_scene_$machine.csv"

echo
echo "Wrong of 4640:"
echo
awk -F, 'NR == 1 { print "| library | wrong | open | collisions missed | invented |"; print "|---|---|---|---|---|"; next }
{ printf "| %s | %s | %s | %s | %s |\n", $1, $3, $4, $5, $6 }' query_accuracy.csv
