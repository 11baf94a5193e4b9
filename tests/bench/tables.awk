# Makes the tables of the pages from the rows of results/: awk -v table=NAME -v machine=MACHINE -f
# tables.awk. See tables.sh.

# read_rows(FILE): reads the rows of a file, by the names in its header: cell[workload, library,
# column].
function read_rows(file,   path, line, fields, names, count, i, key) {
  path = "results/" file ".csv"
  while ((getline line < path) > 0) {
    count = split_row(line, fields)
    if (!(file in seen)) {
      seen[file] = 1
      for (i = 1; i <= count; i++) names[i] = fields[i]
      continue
    }
    key = names[2] == "library" || names[2] == "transport" ? fields[1] SUBSEP fields[2] : fields[1]
    if (names[3] == "server") key = key SUBSEP fields[3]
    for (i = 1; i <= count; i++) cell[key, names[i]] = fields[i]
    order[++rows] = key
  }
  if (!(file in seen)) unreadable(path)
  cite(file)
}

# For files with rows identified by position only: next_row(FILE, FIELDS) reads the next row after
# the header. Returns false after the last, then starts over.
function next_row(file, fields,   path, line) {
  path = "results/" file ".csv"
  if (!(file in opened) && (getline line < path) <= 0) unreadable(path)
  opened[file] = 1
  cite(file)
  if ((getline line < path) > 0) return split_row(line, fields)
  close(path)
  delete opened[file]
  return 0
}

function unreadable(path) {
  print "tables.awk: cannot read " path > "/dev/stderr"
  exit 1
}

# Cites the file and its origin below the table (measured), without repetition.
function cite(file,   link, origin) {
  link = "[`" file ".csv`](" results file ".csv)"
  if (index(files, link) > 0) return
  files = files (files == "" ? "" : ", ") link
  origin = origin_of(file)
  if (origin == "") origin = usual_origin()
  if (index(origins, origin) == 0) origins = origins (origins == "" ? "" : ", and ") origin
}

# Returns the processor and the compiler named by the first row of a file; empty if it names none.
function origin_of(file,   command, line, names, fields, count, i, cpu, compiler) {
  command = "head -2 results/" file ".csv"
  if ((command | getline line) > 0) count = split_row(line, names)
  if ((command | getline line) > 0) split_row(line, fields)
  close(command)
  for (i = 1; i <= count; i++) {
    if (names[i] == "cpu") cpu = fields[i]
    if (names[i] == "compiler") compiler = fields[i]
  }
  sub(/\(virtual; /, "(", cpu)
  return cpu == "" ? "" : "a virtual " cpu ", " compiler
}

# The origin of rows that name none: that of the hull rows, without the CPU generation, which may
# differ.
function usual_origin(   origin) {
  origin = origin_of("hull_build_" machine)
  sub(/ family [0-9]+ model [0-9]+/, "", origin)
  return origin
}

# Splits at commas outside quotes.
function split_row(line, fields,   count, text, quoted, i, c) {
  count = 1
  text = ""
  for (i = 1; i <= length(line); i++) {
    c = substr(line, i, 1)
    if (c == "\"") { quoted = !quoted; continue }
    if (c == "," && !quoted) { fields[count++] = text; text = ""; continue }
    text = text c
  }
  fields[count] = text
  return count
}

function head(text,   part, count, i) {
  print text
  count = split(text, part, "|")
  for (i = 2; i < count; i++) printf "|---"
  print "|"
}

# Prints the origin of the rows above.
function measured() { printf "\n*Measured on %s; rows in %s.*\n", origins, files }

# Returns nanoseconds, or "-".
function short(value) {
  if (value == "") return "-"
  value += 0
  if (value < 999.5) return sprintf("%.0f", value)
  if (value < 99950) return sprintf("%.1fk", value / 1e3)
  if (value < 999500) return sprintf("%.0fk", value / 1e3)
  return sprintf("%.1fM", value / 1e6)
}
function three(x) { x += 0; return x < 1 ? sprintf("%.2f", x) : x < 100 ? sprintf("%.3g", x) : sprintf("%d", x) }
# At least three digits, and no exponent.
function digits(x) { x += 0; return x < 1000 ? sprintf("%.3g", x) : sprintf("%d", x) }
function times(x) { x += 0; return x < 100 ? sprintf("%.2g", x) : sprintf("%.0f", x) }
function million(x) { x += 0; return (x < 2e6 ? sprintf("%.2f", x / 1e6) : sprintf("%.1f", x / 1e6)) " million/s" }
# Returns a time in a suitable unit.
function unit(ns) {
  ns += 0
  if (ns < 999.5) return sprintf("%.3g ns", ns)
  if (ns < 999500) return sprintf("%.3g us", ns / 1e3)
  if (ns < 999.5e6) return sprintf("%.3g ms", ns / 1e6)
  return sprintf("%.3g s", ns / 1e9)
}

function hulls(   n, i, part, at, missing) {
  read_rows("hull_build_" machine)
  head("| points | number | vertices | hulld, ms | qhull, ms | CGAL, ms | qhull / hulld | CGAL / hulld |")
  n = split("ball:1000=ball|ball:10000=ball|ball:100000=ball|ball:1000000=ball|cube:1000000=cube|" \
            "sphere:10000=sphere|sphere:100000=sphere|sphere:1000000=sphere|" \
            "mesh:stanford-bunny.obj=Stanford bunny|mesh:rocker-arm.obj=rocker arm|mesh:spot.obj=spot|" \
            "lattice:50=lattice, rotated", list, "|")
  for (i = 1; i <= n; i++) {
    split(list[i], part, "=")
    at = part[1] SUBSEP
    missing = cell[at "qhull", "vertices_missing_or_extra"]
    printf "| %s | %d | %d | %s | %s%s | %s | %s | %s |\n", part[2], cell[at "hulld", "points"], cell[at "hulld", "vertices"],
           digits(cell[at "hulld", "milliseconds"]), digits(cell[at "qhull", "milliseconds"]),
           (missing > 0 ? " (" missing " vertices missing)" : ""), digits(cell[at "cgal", "milliseconds"]),
           times(cell[at "qhull", "milliseconds"] / cell[at "hulld", "milliseconds"]),
           times(cell[at "cgal", "milliseconds"] / cell[at "hulld", "milliseconds"])
  }
  measured()
}

function stream(   n, i, key, part) {
  read_rows("hull_stream_" machine)
  head("| points | number | library | us a point | p50 | p99 | p99.9 | max |")
  n = split("ball:100000,sphere:100000,ball:1000000,sphere:1000000", list, ",")
  for (i = 1; i <= n; i++) {
    split(list[i], part, ":")
    for (j = 1; j <= 2; j++) {
      key = list[i] SUBSEP (j == 1 ? "hulld one at a time" : "cgal delaunay one at a time")
      if (!((key, "points") in cell)) continue
      printf "| %s | %d | %s | %.3g | %.3g | %.3g | %.3g | %.3g |\n", part[1], part[2], j == 1 ? "hulld" : "CGAL Delaunay",
             cell[key, "milliseconds"] * 1000 / part[2], cell[key, "p50_us"], cell[key, "p99_us"], cell[key, "p999_us"],
             cell[key, "max_us"]
    }
  }
  measured()
}

# Omits clouds that cost as much as another cloud.
function extremes(   n, i, part, a, b) {
  read_rows("hull_extremes_" machine)
  head("| points | number | vertices | at once, ms | times generic | one by one, ms | times generic |")
  n = split("scale_5e_324=ball of multiples of 5e-324|scale_1e_300=ball of radius 1e-300|" \
            "scale_1e300_sphere=sphere of radius 1e300|scale_largest=cube up to the largest double|" \
            "offset_1e15_few_ulps=sphere of 16 units in the last place at 1e15|" \
            "ulp_box_faces=box, its faces jittered by an ulp|ulp_rotated_lattice=lattice, rotated|" \
            "cospherical=integer points on a sphere|sliver_needle=ball squeezed to 1 : 1e-12 : 1e-12, rotated|" \
            "mixed_1e300=coordinates of 1e-300 to 1e300|" \
            "mixed_tiny_clusters=clusters 1e-9 wide on a cube's corners|order_sorted=sphere, sorted along x|" \
            "order_growing_shells=shells, each outside all before|" \
            "order_rising_apexes=a circle, then rising apexes|duplicates_of_sphere=500 points over and over", list, "|")
  for (i = 1; i <= n; i++) {
    split(list[i], part, "=")
    a = part[1] SUBSEP "hulld"
    b = part[1] SUBSEP "hulld one at a time"
    printf "| %s | %d | %d | %s | %s | %s | %s |\n", part[2], cell[a, "points"], cell[a, "vertices"],
           three(cell[a, "milliseconds"]), three(cell[a, "times_generic"]),
           three(cell[b, "milliseconds"]), three(cell[b, "times_generic"])
  }
  measured()
}

function set_name(set) {
  if (set == "ur5") return "UR5, 72 to 220"
  if (sub(/^mating:/, "", set)) return set ", face on face"
  sub(/^sphere:/, "", set)
  return set
}
# A short set_name, for tables that state the vertices elsewhere; for a scene, "N of SET".
function set_label(set) {
  sub(/of sphere:64/, "of 64 vertices", set)
  sub(/of ur5/, "UR5 links", set)
  sub(/^sphere:/, "", set)
  sub(/^ur5/, "UR5", set)
  return set
}
function peer_names() {
  name["FCL libccd"] = "FCL, libccd"; name["FCL indep"] = "FCL, own"; name["SAT double"] = "SAT, plain double"
  name["SAT perturbed"] = "SAT, perturbed by 1e-9"; name["GJK double"] = "GJK, plain double"; name["GJK float"] = "GJK, float"
}
function named(library) { return library in name ? name[library] : library }

function relation(   s, p, r, key, text, n) {
  read_rows("query_relation_" machine)
  head("| vertices | hulld | FCL, libccd | FCL, own | libccd MPR | libccd GJK | Bullet | SAT, plain double |")
  split("sphere:8,sphere:64,sphere:512,sphere:10000,ur5", sets, ",")
  n = split("hulld,FCL libccd,FCL indep,libccd MPR,libccd GJK,Bullet,SAT double", peers, ",")
  split("far,close,gap,graze,deep", regimes, ",")
  for (s = 1; s <= 5; s++) {
    printf "| %s |", set_name(sets[s])
    for (p = 1; p <= n; p++) {
      text = ""
      for (r = 1; r <= 5; r++) {
        key = sets[s] " " regimes[r] SUBSEP peers[p]
        text = text (r > 1 ? " / " : "") short(cell[key, "ns"])
        if (cell[key, "wrong"] > 0) text = text " (" share(cell[key, "wrong"], cell[key, "queries"]) " wrong)"
      }
      printf " %s |", p == 1 ? "**" text "**" : text
    }
    print ""
  }
  measured()
}

function touching(   s, p, n, key) {
  read_rows("query_relation_" machine)
  head("| vertices | hulld | FCL, libccd | FCL, own | libccd MPR | libccd GJK | Bullet |")
  split("sphere:8,sphere:64,sphere:512,sphere:10000,ur5,mating:8,mating:64", sets, ",")
  n = split("hulld,FCL libccd,FCL indep,libccd MPR,libccd GJK,Bullet", peers, ",")
  for (s = 1; s <= 7; s++) {
    # Not measured before these sets existed.
    if (!((sets[s] " contact" SUBSEP "hulld", "ns") in cell)) continue
    printf "| %s |", set_name(sets[s])
    for (p = 1; p <= n; p++) {
      key = sets[s] " contact" SUBSEP peers[p]
      printf " %s (%s) |", short(cell[key, "ns"]), share(cell[key, "wrong"], cell[key, "queries"])
    }
    print ""
  }
  measured()
}

# Returns percent of all, or "0".
function share(part, all) { return part == "" ? "not counted" : part == 0 ? "0" : sprintf("%.2g %%", 100 * part / all) }

function lengths(query,   s, p, n, m, key) {
  read_rows("query_" query "_" machine)
  head("| hulls | hulld | FCL, libccd | FCL, own | libccd GJK | Bullet |")
  m = split(query == "contact" ? "sphere:64 deep,sphere:512 deep,ur5 graze,ur5 deep" \
                                  : "sphere:64 close,sphere:512 close,ur5 far,ur5 close,ur5 gap", sets, ",")
  n = split("hulld,FCL libccd,FCL indep,libccd GJK,Bullet", peers, ",")
  for (s = 1; s <= m; s++) {
    printf "| %s |", set_label(sets[s])
    for (p = 1; p <= n; p++) {
      key = sets[s] SUBSEP peers[p]
      if ((key, "ns") in cell) printf " %s (%.0e) |", short(cell[key, "ns"]), cell[key, "largest_error"]
      else printf " - |"
    }
    print ""
  }
  measured()
}

function motion(   s, r, at) {
  read_rows("query_motion_" machine)
  head("| vertices | close, warm | cold | gap, warm | cold | deep, warm | cold | touching, warm | cold |")
  split("sphere:8,sphere:64,sphere:512,sphere:10000,ur5,mating:8,mating:64", sets, ",")
  split("close,gap,deep,contact", regimes, ",")
  for (s = 1; s <= 7; s++) {
    printf "| %s |", set_name(sets[s])
    for (r = 1; r <= 4; r++) {
      at = sets[s] " " regimes[r]
      printf " %s | %s |", short(cell[at " warm" SUBSEP "hulld", "ns"]), short(cell[at " cold" SUBSEP "hulld", "ns"])
    }
    print ""
  }
  measured()
}

# Returns nanoseconds of a method by passage, "-" without rows.
function passages(kind, method,   r, key, text) {
  for (r = 1; r <= split("hit,graze,near miss,miss", passage, ","); r++) {
    key = kind " " passage[r] SUBSEP method
    if (!((key, "ns") in cell)) return "-"
    text = text (r > 1 ? " / " : "") short(cell[key, "ns"])
  }
  return text
}

function first_contact(   k, v, m, n, kinds, sizes, methods, kind, text) {
  read_rows("motions/first_contact_" machine)
  head("| motion, vertices | hulld | FCL, libccd | Bullet | Bullet, scaled | Bullet, cast | 10 poses | 100 poses | 1000 poses |")
  split("translation,rotation", kinds, ",")
  split("8,64,512,10000", sizes, ",")
  n = split("hulld,FCL,Bullet,Bullet scaled,Bullet cast,10 poses,100 poses,1000 poses", methods, ",")
  for (k = 1; k <= 2; k++) {
    for (v = 1; v <= 4; v++) {
      kind = kinds[k] ":" sizes[v]
      printf "| %s, %d |", kinds[k], sizes[v]
      for (m = 1; m <= n; m++) {
        text = passages(kind, methods[m])
        printf " %s |", m == 1 ? "**" text "**" : text
      }
      print ""
    }
  }
  measured()
}

# Sums over sizes and passages.
function first_contact_faults(   i, k, m, n, key, part, kinds, methods, missed, invented, error, asked) {
  read_rows("motions/first_contact_" machine)
  head("| method | translations: missed | false contacts | error of time | rotations: missed | false contacts | error of time |")
  split("translation,rotation", kinds, ",")
  peer_names()
  name["FCL"] = name["FCL libccd"]; name["Bullet scaled"] = "Bullet, scaled"; name["Bullet cast"] = "Bullet, cast"
  n = split("hulld,FCL,FCL indep,Bullet,Bullet scaled,Bullet cast,10 poses,100 poses,1000 poses", methods, ",")
  for (i = 1; i <= rows; i++) {
    key = order[i]
    split(key, part, /:|\034/)
    m = part[1] SUBSEP part[3]
    asked[m] += cell[key, "queries"]
    missed[m] += cell[key, "missed"]
    invented[m] += cell[key, "false_contacts"]
    if (cell[key, "time_error"] + 0 > error[m]) error[m] = cell[key, "time_error"] + 0
  }
  for (i = 1; i <= n; i++) {
    printf "| %s |", named(methods[i])
    for (k = 1; k <= 2; k++) {
      m = kinds[k] SUBSEP methods[i]
      if (m in asked) printf " %d | %d | %s |", missed[m], invented[m], (error[m] > 0 ? sprintf("%.0e", error[m]) : "0")
      else printf " - | - | - |"
    }
    print ""
  }
  measured()
}

function first_contact_resolution(   m, n, r, methods, labels, key, open, widest) {
  read_rows("motions/first_contact_" machine)
  head("| resolution | hit / graze / near miss / miss, ns | open | widest bracket |")
  n = split("hulld 1e-2,hulld 1e-4,hulld 1e-6,hulld", methods, ",")
  split("1e-2,1e-4,1e-6,defaults", labels, ",")
  for (m = 1; m <= n; m++) {
    open = widest = 0
    for (r = 1; r <= split("hit,graze,near miss,miss", passage, ","); r++) {
      key = "rotation:64 " passage[r] SUBSEP methods[m]
      open += cell[key, "open"]
      if (cell[key, "bracket"] + 0 > widest) widest = cell[key, "bracket"] + 0
    }
    printf "| %s | %s | %d | %.0e |\n", labels[m], passages("rotation:64", methods[m]), open, widest
  }
  measured()
}

function rays(   fields) {
  head("| length of a ray | library | hits | rays a second | cores of the server |")
  while (next_row("motions/first_contact_rays_" machine, fields)) {
    printf "| %s | %s | %d | %s | %s |\n", fields[1], fields[2], fields[5], short(fields[7]),
           (fields[2] == "Bullet" ? "-" : fields[8])
  }
  measured()
}

function scenes(   s, n, ours, theirs) {
  read_rows("query_scene_" machine)
  head("| scene | colliding pairs | hulld, ms | FCL, tree, ms | FCL / hulld |")
  n = split("1000 of sphere:64,10000 of sphere:64,1000 of ur5,10000 of ur5", sets, ",")
  for (s = 1; s <= n; s++) {
    ours = cell[sets[s] SUBSEP "hulld", "ns"]
    theirs = cell[sets[s] SUBSEP "FCL tree", "ns"]
    printf "| %s | %s | %.3g | %.3g | %.1f |\n", set_label(sets[s]), cell[sets[s] SUBSEP "hulld", "pairs"], ours / 1e6, theirs / 1e6, theirs / ours
  }
  measured()
}

function accuracy(   i, key) {
  read_rows("query_accuracy")
  peer_names()
  head("| library | wrong | open | collisions missed | collisions invented |")
  for (i = 1; i <= rows; i++) {
    key = order[i]
    printf "| %s | %s | %s | %s | %s |\n", named(key), cell[key, "wrong"], cell[key, "open"], cell[key, "missed_collisions"],
           cell[key, "invented_collisions"]
  }
  printf "\n*Counts of %s queries, the same on every machine; rows in %s.*\n", cell[key, "queries"], files
}

function trade(   i, key) {
  read_rows("query_trade_" machine)
  peer_names()
  head("| method | ordinary | wrong | open | within 1e-6 of contact | wrong | open | depth | largest error of depth |")
  for (i = 1; i <= rows; i++) {
    key = order[i]
    printf "| %s | %s | %d | %d | %s | %d | %d | %s | %s |\n", named(key), unit(cell[key, "ordinary_ns"]),
           cell[key, "ordinary_wrong"], cell[key, "ordinary_open"], unit(cell[key, "near_contact_ns"]),
           cell[key, "near_contact_wrong"], cell[key, "near_contact_open"],
           cell[key, "depth_ns"] == "" ? "-" : unit(cell[key, "depth_ns"]),
           cell[key, "depth_ns"] == "" ? "-" : sprintf("%.0e", cell[key, "depth_largest_relative_error"])
  }
  measured()
}

function network(   n, i, part, key, over_unix, text) {
  read_rows("remote_" machine)
  head("| | hulld over TCP | of the floor | of the floor, unix sockets | of core in one process |")
  n = split("check 1 client=CheckCollision, one client: p50|check 8 clients=CheckCollision, eight clients: p50|" \
            "stream 1 pair=StreamCollisions, one pair: p50|batch ur5 close=batch, close pairs of UR5 links|" \
            "batch ur5 deep=batch, deep pairs of UR5 links|" \
            "batch ur5 close, two placements a pair=close pairs, two placements of its own for each|" \
            "batch ur5 close, two packed placements a pair=the same, packed|" \
            "scene 10000 ur5 links=scene of 10000 UR5 links|scene 10000 ur5 links, packed=the same, packed|" \
            "ingest ball, doubles=points of a ball into one hull, on disk|ingest ball, floats=the same, as floats", list, "|")
  for (i = 1; i <= n; i++) {
    split(list[i], part, "=")
    key = part[1] SUBSEP "tcp" SUBSEP (part[1] ~ /^ingest/ ? "hulld durable" : "hulld")
    over_unix = key
    sub(SUBSEP "tcp" SUBSEP, SUBSEP "unix" SUBSEP, over_unix)
    if (part[2] ~ /p50/) {
      printf "| %s | %s | %.2f | %.2f | - |\n", part[2], unit(cell[key, "p50_us"] * 1000), cell[key, "p50_of_floor"],
             cell[over_unix, "p50_of_floor"]
      continue
    }
    text = part[1] ~ /^scene/ ? sprintf("%.0f scenes/s", cell[key, "per_second"]) : million(cell[key, "per_second"])
    printf "| %s | %s | %.2f | %.2f | %.2f |\n", part[2], text, cell[key, "of_floor"], cell[over_unix, "of_floor"],
           cell[key, "of_in_process"]
  }
  measured()
}

function start(   i, key) {
  read_rows("server_start_" machine)
  head("| hulls of 64 vertices | listens after | first answer after | resident | on disk |")
  for (i = 1; i <= rows; i++) {
    key = order[i]
    printf "| %d | %.0f ms | %.0f ms | %.0f MiB | %.1f MiB |\n", key, cell[key, "listens_ms"], cell[key, "answers_ms"],
           cell[key, "resident_mib"], cell[key, "store_mib"]
  }
  measured()
}

function overload(   fields) {
  head("| clients that send batches | CheckCollision: p50 | p99 | p99.9 | p99 / idle | pairs of batches |")
  while (next_row("server_overload_" machine, fields)) {
    printf "| %d | %.0f us | %.0f us | %.1f ms | %.1f | %s |\n", fields[2], fields[4], fields[5], fields[6] / 1000, fields[8],
           (fields[9] > 0 ? million(fields[9]) : "-")
  }
  measured()
}

# One row per workload and size, for some of them: hulld's step, Bullet's, and hulld's speedup.
function live(   fields, key, order_of, i, n, part) {
  head("| a step | vertices | hulld: p50 | p99 | Bullet: p50 | with its box | hulld faster | with its box |")
  while (next_row("query_live_" machine, fields)) {
    if (fields[3] !~ /^(64|10000|1000000)$/ || fields[1] ~ /cold|, 30 /) continue
    key = fields[1] SUBSEP fields[3]
    if (fields[2] == "hulld") order_of[++n] = key
    step[key, fields[2]] = fields[4]
    slowest[key, fields[2]] = fields[5]
    boxed[key, fields[2]] = fields[9]
  }
  for (i = 1; i <= n; i++) {
    key = order_of[i]
    split(key, part, SUBSEP)
    printf "| %s | %d | %s | %s | %s | %s | %s | %s |\n", part[1], part[2], unit(1000 * step[key, "hulld"]),
           unit(1000 * slowest[key, "hulld"]), unit(1000 * step[key, "Bullet"]), unit(1000 * boxed[key, "Bullet"]),
           times(step[key, "Bullet"] / step[key, "hulld"]), times(boxed[key, "Bullet"] / boxed[key, "hulld"])
  }
  measured()
}

# Three sizes only; omits queries about another hull or server.
function live_service(   fields, reader) {
  head("| vertices | query | p50 | p99 | p50 / at rest | p99 / at rest | chunks of the writer |")
  while (next_row("server_live_" machine, fields)) {
    if (fields[1] !~ /^(64|10000|1000000)$/ || fields[2] ~ /^another/) continue
    reader = fields[4] != ""
    printf "| %d | %s | %s | %s | %s | %s | %s |\n", fields[1], fields[2], (reader ? unit(1000 * fields[4]) : "-"),
           (reader ? unit(1000 * fields[5]) : "-"), (reader ? sprintf("%.2f", fields[6]) : "-"),
           (reader ? sprintf("%.2f", fields[7]) : "-"), (fields[8] > 0 ? sprintf("%.0f/s", fields[8]) : "-")
  }
  measured()
}

# Omits p99 if too few times exist.
function live_work(   fields, enough) {
  head("| work | | p50 | p99 | p50 / first | p99 / first | a second |")
  while (next_row("server_live_work_" machine, fields)) {
    enough = fields[3] + 0 >= 20
    printf "| %s | %s | %s | %s | %.2f | %s | %s |\n", fields[1], fields[2], unit(1000 * fields[4]),
           (enough ? unit(1000 * fields[5]) : "-"), fields[6], (enough ? sprintf("%.2f", fields[7]) : "-"),
           sprintf(fields[8] + 0 < 100 ? "%.3g" : "%.0f", fields[8])
  }
  measured()
}

# One row of the summary; times in nanoseconds. wrong: errors of hulld and the peer.
function compare(what, ours, peer, theirs, wrong) {
  printf "| %s | %s | %s: %s | %s | %s |\n", what, unit(ours), peer, unit(theirs), times(theirs / ours), wrong
}
function hull(what, cloud) {
  compare(what, 1e6 * cell[cloud, "hulld", "milliseconds"], "qhull", 1e6 * cell[cloud, "qhull", "milliseconds"],
          cell[cloud, "hulld", "vertices_missing_or_extra"] " / " cell[cloud, "qhull", "vertices_missing_or_extra"])
}
function pair(what, set,   peers, n, i, best) {
  peer_names()
  n = split("FCL libccd,FCL indep,libccd MPR,libccd GJK,Bullet", peers, ",")
  for (i = 1; i <= n; i++) {
    if (best == "" || cell[set, peers[i], "ns"] + 0 < cell[set, best, "ns"] + 0) best = peers[i]
  }
  compare(what, cell[set, "hulld", "ns"], named(best), cell[set, best, "ns"],
          share(cell[set, "hulld", "wrong"], cell[set, "hulld", "queries"]) " / " \
          share(cell[set, best, "wrong"], cell[set, best, "queries"]))
}
# One point and one query of a growing hull.
function grown(vertices,   fields, step) {
  while (next_row("query_live_" machine, fields)) {
    if (fields[1] == "1 point, 1 query" && fields[3] == vertices) step[fields[2]] = 1000 * fields[4]
  }
  compare("add a point, then query, hull of " vertices, step["hulld"], "Bullet", step["Bullet"], "-")
}
# Over PostgreSQL: returns the name of a row of results/postgres/.
function store_name(row) {
  sub(/^rocksdb/, "RocksDB", row)
  sub(/ bounded$/, ", BOUNDED", row)
  sub(/ linearizable$/, ", LINEARIZABLE", row)
  sub(/^one/, "one server", row)
  sub(/^many/, "many servers", row)
  sub(/^libpq as one$/, "libpq alone, as one server", row)
  sub(/^libpq as many$/, "libpq alone, as many servers", row)
  sub(/^libpq query$/, "libpq alone, the query of LINEARIZABLE", row)
  sub(/^gRPC and libpq as one$/, "gRPC alone, then libpq alone, as one", row)
  sub(/^gRPC and libpq as many$/, "gRPC alone, then libpq alone, as many", row)
  return row
}
function micro(value) { return value + 0 > 0 ? digits(value) " us" : "-" }

function postgres_commit(   i, key, floor, both) {
  read_rows("postgres/commit_" machine)
  head("| a chunk of one point | p50 | p99 | p50 / libpq | p50 / gRPC, then libpq | CPU of hulld | of the database |")
  for (i = 1; i <= rows; i++) {
    key = order[i]
    floor = key ~ /(^| )one$/ ? "libpq as one" : key ~ /many/ ? "libpq as many" : ""
    both = "gRPC and " floor
    printf "| %s | %s | %s | %s | %s | %s | %s |\n", store_name(key), micro(cell[key, "p50_us"]), micro(cell[key, "p99_us"]),
           floor == "" ? "-" : sprintf("%.2f", cell[key, "p50_us"] / cell[floor, "p50_us"]),
           floor == "" || key ~ /libpq/ || !((both, "p50_us") in cell) ? "-" : sprintf("%.2f", cell[key, "p50_us"] / cell[both, "p50_us"]),
           micro(cell[key, "cpu_us"]), floor == "" ? "-" : micro(cell[key, "database_cpu_us"])
  }
  measured()
}

function postgres_queries(   i, key) {
  read_rows("postgres/queries_" machine)
  head("| a query | p50 | p99 | a second | CPU of hulld | of RocksDB | CPU of the database |")
  for (i = 1; i <= rows; i++) {
    key = order[i]
    printf "| %s | %s | %s | %d | %s | %s | %s |\n", store_name(key), micro(cell[key, "p50_us"]), micro(cell[key, "p99_us"]),
           cell[key, "per_second"], micro(cell[key, "cpu_us"]),
           cell[key, "peer"] == "" ? "-" : sprintf("%.2f", cell[key, "cpu_of_peer"]),
           key ~ /rocksdb|gRPC/ ? "-" : micro(cell[key, "database_cpu_us"])
  }
  measured()
}

function summary(   one) {
  read_rows("hull_build_" machine)
  read_rows("hull_stream_" machine)
  read_rows("query_relation_" machine)
  read_rows("query_scene_" machine)
  head("| task, on one thread | hulld | fastest peer | times | wrong: hulld / peer |")
  hull("hull of 100000 points in a ball", "ball:100000")
  hull("hull of 100000 points on a sphere", "sphere:100000")
  one = "sphere:100000"
  # 100000 points, milliseconds: 10 ns per point for each.
  compare("add a point, mean over 100000 on a sphere", 10 * cell[one, "hulld one at a time", "milliseconds"], "CGAL Delaunay",
          10 * cell[one, "cgal delaunay one at a time", "milliseconds"],
          cell[one, "hulld one at a time", "vertices_missing_or_extra"] " / " \
          cell[one, "cgal delaunay one at a time", "vertices_missing_or_extra"])
  grown(1000)
  grown(100000)
  pair("pair of 64 vertices, far apart", "sphere:64 far")
  pair("pair of 64 vertices, 1 to 5 % apart", "sphere:64 close")
  pair("pair of 64 vertices, 1e-6 apart", "sphere:64 gap")
  pair("pair of 64 vertices, deep", "sphere:64 deep")
  pair("pair of 64 vertices, touching", "sphere:64 contact")
  pair("pair of 10000 vertices, 1 to 5 % apart", "sphere:10000 close")
  pair("two UR5 links, 1 to 5 % apart", "ur5 close")
  compare("all colliding pairs of 10000 UR5 links", cell["10000 of ur5", "hulld", "ns"], "FCL, tree",
          cell["10000 of ur5", "FCL tree", "ns"], cell["10000 of ur5", "hulld", "wrong"] " / " cell["10000 of ur5", "FCL tree", "wrong"])
  measured()
}

BEGIN {
  if (table == "hulls") hulls()
  else if (table == "stream") stream()
  else if (table == "extremes") extremes()
  else if (table == "relation") relation()
  else if (table == "touching") touching()
  else if (table == "accuracy") accuracy()
  else if (table == "depth") lengths("contact")
  else if (table == "distance") lengths("distance")
  else if (table == "motion") motion()
  else if (table == "first-contact") first_contact()
  else if (table == "first-contact-faults") first_contact_faults()
  else if (table == "first-contact-resolution") first_contact_resolution()
  else if (table == "rays") rays()
  else if (table == "scenes") scenes()
  else if (table == "trade") trade()
  else if (table == "network") network()
  else if (table == "start") start()
  else if (table == "postgres-commit") postgres_commit()
  else if (table == "postgres-queries") postgres_queries()
  else if (table == "overload") overload()
  else if (table == "live") live()
  else if (table == "live-service") live_service()
  else if (table == "live-work") live_work()
  else if (table == "summary") summary()
  else {
    print "tables.awk: no table " table > "/dev/stderr"
    exit 1
  }
}
