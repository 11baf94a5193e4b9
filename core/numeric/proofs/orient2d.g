# The sign of det = (b - a) x (c - a) in the plane. left and right are its computed products: either
# is P (1 + d1) (1 + d2) (1 + d3), by two differences and a product, with P exact. The computed
# determinant is (left - right) (1 + d4), the bound F (|left| + |right|) (1 + d5) (1 + d6).
#
# By hand: if the computed determinant exceeds the bound, |left - right| is above F (|left| +
# |right|) (1 + d5) (1 + d6) / (1 + d4), and det differs from left - right by at most `error`
# (|left| + |right|). The sign is therefore correct if `error` is at most F times the factors.

error = 1 - 1 / ((1 + d1) * (1 + d2) * (1 + d3));
needed = error * (1 + d4) / ((1 + d5) * (1 + d6));

{ |d1| <= kUnitRoundoff /\ |d2| <= kUnitRoundoff /\ |d3| <= kUnitRoundoff /\ |d4| <= kUnitRoundoff
  /\ |d5| <= kUnitRoundoff /\ |d6| <= kUnitRoundoff
  -> |needed| <= kOrient2dErrorFactor }

# Refused: kOrient2dErrorFactor - 1 step
