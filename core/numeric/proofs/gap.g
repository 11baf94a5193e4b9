# The gap between two hulls along a computed normal n that errs by at most h per component: the
# difference of n . b and n . a. Units: |n| = 1, S = 1. `tilt` is the effect of the normal's error,
# in units of h, over exact components of at most 4 S; `shift` the effect of position errors, d in
# total, in units of d = kMinkowskiErrorFactor S; `rounding` that of the products.
#
# By hand: positions are at most sqrt(3) (M_A + M_B) + |t| <= sqrt(3) S, of which A has the part P;
# 1.74 covers that and their errors.

tilt = h1 * w1 + h2 * w2 + h3 * w3;
shift = n1 * s1 + n2 * s2 + n3 * s3;
a1 = P * x1; a2 = P * x2; a3 = P * x3;
b1 = (1 - P) * y1; b2 = (1 - P) * y2; b3 = (1 - P) * y3;
at_a = fl(n1 * a1 + n2 * a2 + n3 * a3);
at_b = fl(n1 * b1 + n2 * b2 + n3 * b3);
gap = fl(at_b - at_a);
rounding = gap - ((n1 * b1 + n2 * b2 + n3 * b3) - (n1 * a1 + n2 * a2 + n3 * a3));

{ P in [0, 1] /\ |h1| <= 1 /\ |h2| <= 1 /\ |h3| <= 1 /\ |w1| <= 4 /\ |w2| <= 4 /\ |w3| <= 4
  /\ |n1| <= 1 /\ |n2| <= 1 /\ |n3| <= 1 /\ |s1| <= 1 /\ |s2| <= 1 /\ |s3| <= 1
  /\ |x1| <= 1.74 /\ |x2| <= 1.74 /\ |x3| <= 1.74 /\ |y1| <= 1.74 /\ |y2| <= 1.74 /\ |y3| <= 1.74
  -> |tilt| / (1 - 1b-50) <= kGapNormalFactor
  /\ |shift + rounding / kMinkowskiErrorFactor| / (1 - 1b-50) <= kGapPositionFactor }

rounding -> (gap - (at_b - at_a))
  + (at_b - (n1 * b1 + n2 * b2 + n3 * b3)) - (at_a - (n1 * a1 + n2 * a2 + n3 * a3));
$ P in 8;

# Refused: kGapNormalFactor * 0.95
# Refused: kGapPositionFactor * 0.75
