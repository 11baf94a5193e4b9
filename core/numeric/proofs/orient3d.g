# The sign of det[b - a, c - a, d - a], the sum of six products of three factors. c is one of them
# as computed up to its inner product times the difference outside: P (1 + d1) ... (1 + d4) for the
# exact P. The inner difference, the outer product and the first sum add d5, d6 and d7, the last sum
# d8. The permanent accumulates the same |c| by an inner sum, an outer product and at most two sums,
# d9 to d12, and the product with the factor F rounds once more, d13.
#
# By hand, as in the plane: the last sum preserves the sign, and by the triangle inequality over the
# six products it suffices to show `needed` <= F for one of them.

value = (1 + d5) * (1 + d6) * (1 + d7);
exact = 1 / ((1 + d1) * (1 + d2) * (1 + d3) * (1 + d4));
needed = (value - exact) * (1 + d8) / ((1 + d9) * (1 + d10) * (1 + d11) * (1 + d12) * (1 + d13));

{ |d1| <= kUnitRoundoff /\ |d2| <= kUnitRoundoff /\ |d3| <= kUnitRoundoff /\ |d4| <= kUnitRoundoff
  /\ |d5| <= kUnitRoundoff /\ |d6| <= kUnitRoundoff /\ |d7| <= kUnitRoundoff
  /\ |d8| <= kUnitRoundoff /\ |d9| <= kUnitRoundoff /\ |d10| <= kUnitRoundoff
  /\ |d11| <= kUnitRoundoff /\ |d12| <= kUnitRoundoff /\ |d13| <= kUnitRoundoff
  -> |needed| <= kOrient3dErrorFactor }

# Refused: kOrient3dErrorFactor - 1 step
