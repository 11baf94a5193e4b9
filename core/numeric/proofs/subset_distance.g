# The distance |p - (s e + t f)| for rounded differences p, e, f, in units of |p| + |e| + |f|, with
# parts P, (1 - P) Q and (1 - P) (1 - Q). s and t are weights with a sum of at most 1; an exact sum
# above that by u moves the point by at most 2 u.
#
# By hand: sqrt(3) turns components into lengths; the norm, of at most sqrt(3), errs by 8 u of
# itself.

A = P * x; B = (1 - P) * Q * y; C = (1 - P) * (1 - Q) * z;
p = A * (1 + d1); e = B * (1 + d2); f = C * (1 + d3);
component = fl(p - (s * e + t * f));
at_computed = p - (s * e + t * f);
exact = A - (s * B + t * C);
# The distance D is at least 0, so the bound's term for it covers 8 u D.
total = 0x1.bb67bp0 * (component - exact) + 2b-53 * m;
bound = kSubsetDistanceErrorFactor * (1 - 1b-49);
norm = 8b-53 / bound;

{ P in [0, 1] /\ Q in [0, 1] /\ |x| <= 1 /\ |y| <= 1 /\ |z| <= 1 /\ s in [0, 1] /\ t in [0, 1]
  /\ |d1| <= kUnitRoundoff /\ |d2| <= kUnitRoundoff /\ |d3| <= kUnitRoundoff /\ |m| <= 1
  -> |total / bound| <= 1 /\ norm <= 1 }

component - exact -> (component - at_computed) + (A * d1 - (s * B * d2 + t * C * d3));
$ P in 4, Q in 4;

# Refused: kSubsetDistanceErrorFactor * 0.2
