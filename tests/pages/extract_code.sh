#!/bin/bash
# Prints the N-th code block in a language of a page, the first by default:
#
#   bash tests/pages/extract_code.sh PAGE LANGUAGE [N]
set -euo pipefail
awk -v language="$2" -v wanted="${3:-1}" '
  /^ *```/ { if (inside) { inside = 0; exit_after = found } else if ($0 ~ "```" language "$" && ++count == wanted) inside = found = 1
             if (exit_after) exit
             next }
  inside
  END { exit !found }
' "$1"
