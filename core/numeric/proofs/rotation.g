# Entries of R(q) / |q|^2, with |q| = 1 as the unit. An entry is the sum of products of q's
# components with absolute values that sum to at most 1: P x + (1 - P) y. On the diagonal it is (ww
# + xx) - (yy + zz), with two roundings before the difference; off it 2 (x y - w z), with one.
#
# By hand: each square has one rounding and the sum of four positive ones two more, so the computed
# |q|^2 is within (1 + d1) (1 + d2) (1 + d3) of the exact one; `inverse` is the error of its
# reciprocal.

a = P * x; b = (1 - P) * y;
exact = a - b;
half_a = a * (1 + e1) * (1 + e2);
half_b = b * (1 + e3) * (1 + e4);
difference = fl(half_a - half_b);
inverse = 1 / ((1 + d1) * (1 + d2) * (1 + d3));
entry = (1 + i) * (1 + d4) * difference * (1 + d5);

{ P in [0, 1] /\ |x| <= 1 /\ |y| <= 1 /\ |i| <= 0x3.000001p-53
  /\ |d1| <= kUnitRoundoff /\ |d2| <= kUnitRoundoff /\ |d3| <= kUnitRoundoff
  /\ |d4| <= kUnitRoundoff /\ |d5| <= kUnitRoundoff
  /\ |e1| <= kUnitRoundoff /\ |e2| <= kUnitRoundoff /\ |e3| <= kUnitRoundoff
  /\ |e4| <= kUnitRoundoff
  -> |inverse - 1| <= 0x3.000001p-53 /\ |entry - exact| <= kRotationEntryError }

difference - exact -> (difference - (half_a - half_b))
  + (a * (e1 + e2 + e1 * e2) - b * (e3 + e4 + e3 * e4));
entry - exact -> (1 + i) * (1 + d4) * (1 + d5) * (difference - exact)
  + ((1 + i) * (1 + d4) * (1 + d5) - 1) * exact;
$ P in 16;

# Refused: kRotationEntryError * 0.45
