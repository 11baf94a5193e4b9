# Splits a page into the steps for run_page.sh, each in files of the directory `out`:
#
#   NNN.file      line 1: the name of a file; the rest: its contents
#   NNN.command   a command of a console block; NNN.expected contains its output in the page
#   NNN.script    a block of sh
#   NNN.skipped   line 1: the reason a block is not run
#
# An HTML comment on the line before a block marks special blocks: <!-- file: NAME --> and <!-- not
# run: REASON -->. NNN.place contains the page's name and the line of the step.
function open_step(kind) {
  step = sprintf("%s/%03d", out, ++steps)
  printf "%s:%d\n", FILENAME, FNR > (step ".place")
  close(step ".place")
  target = step "." kind
}
function put(text, file) { print text > file }

/^<!-- (file|not run): .* -->$/ && !inside {
  directive = $0
  sub(/^<!-- /, "", directive)
  sub(/ -->$/, "", directive)
  next
}

/^ *```/ && !inside {
  inside = 1
  language = $0
  sub(/^ *```/, "", language)
  mode = "ignored"
  if (directive ~ /^file: /) {
    mode = "copied"
    open_step("file")
    put(substr(directive, 7), target)
  } else if (directive ~ /^not run: /) {
    open_step("skipped")
    put(substr(directive, 10), target)
    close(target)
  } else if (language == "console") {
    mode = "console"
  } else if (language == "sh") {
    mode = "copied"
    open_step("script")
  }
  directive = ""
  next
}

/^ *```/ {
  inside = 0
  if (mode != "ignored") close(target)
  if (mode == "console") close(step ".expected")
  next
}

{ if (!inside) directive = "" }

mode == "copied" && inside { put($0, target) }

mode == "console" && inside {
  if (continued) {
    put($0, step ".command")
  } else if (/^\$ /) {
    if (step != "") close(step ".expected")
    open_step("command")
    put(substr($0, 3), target)
  } else {
    put($0, step ".expected")
  }
  continued = (continued || /^\$ /) && /\\$/
  if (!continued) close(step ".command")
}
