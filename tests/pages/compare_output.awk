# Compares the output of a command with the output in a page: compare_output.awk EXPECTED ACTUAL. In
# the page, "..." stands for any part of a line or, alone on a line, for any number of lines. Times,
# durations, random IDs, and the server's port may differ. Prints the first difference and fails.
function normal(line) {
  gsub(/[0-9][0-9][0-9][0-9]-[0-9][0-9]-[0-9][0-9]T[0-9:.]+\+00:00/, "<time>", line)
  gsub(/[0-9][0-9][0-9][0-9]-[0-9][0-9]-[0-9][0-9]T[0-9:.]+Z/, "<time>", line)
  gsub(/127\.0\.0\.1:[0-9]+/, "<address>", line)
  gsub(/[0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f]+/,
       "<random>", line)
  gsub(/[0-9.]+ (ns|us|ms|s)( |$)/, "<duration> ", line)
  sub(/ +$/, "", line)
  # Column widths depend on the values.
  gsub(/  +/, "  ", line)
  return line
}

# Returns true if the parts between the dots occur in order, the first and the last at the ends.
function matches(pattern, text,   parts, count, i, at) {
  count = split(pattern, parts, /\.\.\./)
  if (count == 1) return pattern == text
  if (substr(text, 1, length(parts[1])) != parts[1]) return 0
  text = substr(text, length(parts[1]) + 1)
  for (i = 2; i < count; i++) {
    at = index(text, parts[i])
    if (!at) return 0
    text = substr(text, at + length(parts[i]))
  }
  if (length(text) < length(parts[count])) return 0
  return substr(text, length(text) - length(parts[count]) + 1) == parts[count]
}

# Compares as they are, too: the digits of a number may look like a random ID.
function agree(expected, actual) {
  return matches(expected, actual) || matches(normal(expected), normal(actual))
}

FILENAME == ARGV[1] { expected[++expected_count] = $0; next }
{ actual[++actual_count] = $0 }

END {
  j = 1
  for (i = 1; i <= expected_count; i++) {
    if (expected[i] == "...") {
      if (i == expected_count) exit 0
      while (j <= actual_count && !agree(expected[i + 1], actual[j])) j++
      continue
    }
    if (j > actual_count || !agree(expected[i], actual[j])) {
      printf "  the page says: %s\n  it printed:    %s\n", expected[i], (j > actual_count ? "(nothing more)" : actual[j])
      exit 1
    }
    j++
  }
  if (j <= actual_count) {
    printf "  the page does not say: %s\n", actual[j]
    exit 1
  }
}
