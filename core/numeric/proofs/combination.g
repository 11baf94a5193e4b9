# Points of A - B as sums of weighted Minkowski vertices, in units of S: components of at most 4,
# each within kMinkowskiErrorFactor, weights of at least 0.
#
# combination: weights that sum to 1 within 8 u, which moves the point by at most that times 4.
#
# near: p + s (q - p) + t (r - p) with weights s and t; an exact sum above 1 by 2 u moves the point
# by 2 u times 8.
#
# By hand: errors of vertices are averaged with the weights, so they do not grow; sqrt(3) turns
# components into lengths; the length of the point, at most 7, errs by 8 u of itself.

l1 = P * Q; l2 = P * (1 - Q); l3 = 1 - P;
p1 = 4 * x1; p2 = 4 * x2; p3 = 4 * x3;
sum = fl(l1 * p1 + l2 * p2 + l3 * p3);
Sum = l1 * p1 + l2 * p2 + l3 * p3;
combination = 0x1.bb67bp0 * (kMinkowskiErrorFactor * e1 + (sum - Sum) + 4 * 8b-53 * e2)
  + 7 * 8b-53 * e3;

edge = fl(p2 - p1); other = fl(p3 - p1);
near = fl(p1 + l2 * edge + l3 * other);
at_computed = p1 + l2 * edge + l3 * other;
Near = p1 + l2 * (p2 - p1) + l3 * (p3 - p1);
near_total = 0x1.bb67bp0 * (kMinkowskiErrorFactor * e1 + (near - Near) + 2b-53 * 8 * e2)
  + 7 * 8b-53 * e3;

{ P in [0, 1] /\ Q in [0, 1] /\ |x1| <= 1 /\ |x2| <= 1 /\ |x3| <= 1
  /\ |e1| <= 1 /\ |e2| <= 1 /\ |e3| <= 1
  -> |combination| <= kCombinationErrorFactor /\ |near_total| <= kNearPointErrorFactor }

near - Near -> (near - at_computed) + l2 * (edge - (p2 - p1)) + l3 * (other - (p3 - p1));
$ P in 4, Q in 4;

# Refused: kCombinationErrorFactor * 0.75
# Refused: kNearPointErrorFactor * 0.5
