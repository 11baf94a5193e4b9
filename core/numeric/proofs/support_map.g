# The guarantees of a support map, in a hull's own frame. Units: the hull's largest coordinate, or
# the largest extent of the set, is 1.
#
# blur: n . v with components of n of at most sqrt(3) (by hand: n has been rotated), |v| <= 1. Two
# values that differ by more than twice the error of a value compare correctly.
#
# lead: the lead of a point over another at the best corner of a square of directions (s, t, 1) with
# half sides S and T. By hand: |s| + S and |t| + T are at most 1 + 2^-20, and taking the absolute
# value of the differences is exact.

value = fl(n1 * v1 + n2 * v2 + n3 * v3);
exact = n1 * v1 + n2 * v2 + n3 * v3;
blur = 2 * (value - exact);

a = A * (1 + d1); b = B * (1 + d2); c = C * (1 + d3);
lead = fl((c + (s * a + t * b)) + (S * abs(a) + T * abs(b)));
at_computed = (c + (s * a + t * b)) + (S * |a| + T * |b|);
# The effect of the differences' own errors.
shift = C * d3 + s * A * d1 + t * B * d2 + S * x * d1 + T * y * d2;

{ |n1| <= 0x1.bb67bp0 /\ |n2| <= 0x1.bb67bp0 /\ |n3| <= 0x1.bb67bp0
  /\ |v1| <= 1 /\ |v2| <= 1 /\ |v3| <= 1
  /\ |A| <= 1 /\ |B| <= 1 /\ |C| <= 1 /\ |x| <= 1 /\ |y| <= 1
  /\ |d1| <= kUnitRoundoff /\ |d2| <= kUnitRoundoff /\ |d3| <= kUnitRoundoff
  /\ |s| <= 0x1.00001p0 /\ |t| <= 0x1.00001p0 /\ S in [0, 0x1.00001p0] /\ T in [0, 0x1.00001p0]
  -> |blur| <= kSupportBlurFactor
  /\ |(lead - at_computed) + shift| / (1 - 1b-50) <= kLeadErrorFactor }

# Refused: kSupportBlurFactor * 0.75
# Refused: kLeadErrorFactor * 0.2
