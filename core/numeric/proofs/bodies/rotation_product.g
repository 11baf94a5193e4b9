# Counterpart of rotation.g for a q that is the product of two quaternions, each component rounded
# once (c).
#
# By hand: a component is computed from exact products in double-double arithmetic, so beyond its
# rounding it errs by less than 64 u^2 |q|, which the slack covers: it moves an entry by less than
# 2^10 u^2. A sum of positive terms errs as its terms do, so half of a numerator has twice the
# component's error, and so does the squared norm.

a = P * x; b = (1 - P) * y;
exact = a - b;
half_a = a * (1 + e1) * (1 + e2) * (1 + c1) * (1 + c2);
half_b = b * (1 + e3) * (1 + e4) * (1 + c3) * (1 + c4);
difference = fl(half_a - half_b);
inverse = 1 / ((1 + d1) * (1 + d2) * (1 + d3) * (1 + c5) * (1 + c6));
entry = (1 + i) * (1 + d4) * difference * (1 + d5);

{ P in [0, 1] /\ |x| <= 1 /\ |y| <= 1 /\ |i| <= 0x5.000001p-53
  /\ |d1| <= kUnitRoundoff /\ |d2| <= kUnitRoundoff /\ |d3| <= kUnitRoundoff
  /\ |d4| <= kUnitRoundoff /\ |d5| <= kUnitRoundoff
  /\ |e1| <= kUnitRoundoff /\ |e2| <= kUnitRoundoff /\ |e3| <= kUnitRoundoff
  /\ |e4| <= kUnitRoundoff
  /\ |c1| <= kUnitRoundoff /\ |c2| <= kUnitRoundoff /\ |c3| <= kUnitRoundoff
  /\ |c4| <= kUnitRoundoff /\ |c5| <= kUnitRoundoff /\ |c6| <= kUnitRoundoff
  -> |inverse - 1| <= 0x5.000001p-53 /\ |entry - exact| <= kRotationEntryError }

difference - exact -> (difference - (half_a - half_b))
  + (a * ((1 + e1) * (1 + e2) * (1 + c1) * (1 + c2) - 1)
     - b * ((1 + e3) * (1 + e4) * (1 + c3) * (1 + c4) - 1));
entry - exact -> (1 + i) * (1 + d4) * (1 + d5) * (difference - exact)
  + ((1 + i) * (1 + d4) * (1 + d5) - 1) * exact;
$ P in 16;

# Refused: kRotationEntryError * 0.7
