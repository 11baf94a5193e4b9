# n . (a - b) over all vertices against the support functions about the centers, with n the computed
# difference of the centers, which errs by e kMinkowskiErrorFactor S per component. Units: |n| = 1,
# S = 1; |n| itself is N = sqrt(3) S at most (by hand), so n . n = N (y . y) in this unit. The
# supports are at most 4 in total.

tilt = kMinkowskiErrorFactor * (y1 * e1 + y2 * e2 + y3 * e3);
square = fl(y1 * y1 + y2 * y2 + y3 * y3);
own = N * (square - (y1 * y1 + y2 * y2 + y3 * y3));
# The sum of the supports and the bound, and the bound's own products.
sums = (a + b) * (d1 + d2 + d1 * d2);
bound = kCenterSupportFactor * (1 + d3) * (1 + d4) * (1 + d5);

{ |y1| <= 1 /\ |y2| <= 1 /\ |y3| <= 1 /\ |e1| <= 1 /\ |e2| <= 1 /\ |e3| <= 1
  /\ N in [0, 0x1.bb67bp0] /\ |a| <= 4 /\ |b| <= 4
  /\ |d1| <= kUnitRoundoff /\ |d2| <= kUnitRoundoff /\ |d3| <= kUnitRoundoff
  /\ |d4| <= kUnitRoundoff /\ |d5| <= kUnitRoundoff
  -> |(tilt + own + sums) / bound| <= 1 }

# Refused: kCenterSupportFactor * 0.75
