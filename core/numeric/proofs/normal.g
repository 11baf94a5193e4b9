# A component of the cross product of two computed edges, e2 f3 - e3 f2, with ends that err by at
# most d: an edge errs by 2.1 d as in differences.g. In units of e + f + 3 d, with e and f the
# edges' largest components and d = (1 - e - f) / 3. u f is at most d / 32, because f <= 4 S.
#
# By hand: the cross product's own rounding is bilinear, `rounding` e f; by the range of f that is
# at most `rounding` / u times e d / 32. Its sign is arbitrary, so its size is added.

cross = fl(a2 * b3 - a3 * b2);
rounding = cross - (a2 * b3 - a3 * b2);
d = (1 - e - f) / 3;
# The exact edges are e x - d v and f y - d w.
change = (v2 * (f * y3) - v3 * (f * y2)) + ((e * x2 - d * v2) * w3 - (e * x3 - d * v3) * w2);
total = change + c * e / 32;

{ |a2| <= 1 /\ |a3| <= 1 /\ |b2| <= 1 /\ |b3| <= 1 /\ |c| <= 0x4.00001p0
  /\ e in [0, 1] /\ f in [0, 1] /\ d in [0, 1]
  /\ |v2| <= 2.1 /\ |v3| <= 2.1 /\ |w2| <= 2.1 /\ |w3| <= 2.1
  /\ |x2| <= 1 /\ |x3| <= 1 /\ |y2| <= 1 /\ |y3| <= 1
  -> |rounding| <= 0x4.00001p-53 /\ |total| <= kNormalErrorFactor }
$ e in 16, f in 16;

# Refused: kNormalErrorFactor * 0.8
