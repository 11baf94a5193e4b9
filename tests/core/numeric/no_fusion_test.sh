#!/bin/bash
# no_fusion_test.sh OBJDUMP LIBRARY...: fails if machine code multiplies and adds with one rounding,
# on x86-64 or 64-bit ARM. Processors with and without such instructions would give different bits.
# The compiler is instructed not to fuse, but the intrinsics of Eigen's products on ARM still fuse.
set -uo pipefail
objdump=$1
shift
failed=0
for library in "$@"; do
  code=$("$objdump" --disassemble --no-show-raw-insn --demangle "$library") || exit 2
  # A function's name precedes its code; the instruction is between two tabs or after one.
  found=$(awk '
    /^[0-9a-f]+ </ { name = $0; ++functions }
    /\t(vfn?m(add|sub)|fml[as]|fn?m(add|sub))/ { print name }
    END { if (functions == 0) print "no function found" }' <<<"$code" | uniq)
  if [[ -n $found ]]; then
    printf '%s fuses products and sums in\n%s\n' "$library" "$found" >&2
    failed=1
  fi
done
exit $failed
