# y . (a x b) for rounded differences y, a, b of which none exceeds 1, the unit.

y1 = fl(p1 - o1); y2 = fl(p2 - o2); y3 = fl(p3 - o3);
a1 = fl(v1 - o1); a2 = fl(v2 - o2); a3 = fl(v3 - o3);
b1 = fl(w1 - o1); b2 = fl(w2 - o2); b3 = fl(w3 - o3);
value = fl(y1 * (a2 * b3 - a3 * b2) + y2 * (a3 * b1 - a1 * b3) + y3 * (a1 * b2 - a2 * b1));

Y1 = p1 - o1; Y2 = p2 - o2; Y3 = p3 - o3;
A1 = v1 - o1; A2 = v2 - o2; A3 = v3 - o3;
B1 = w1 - o1; B2 = w2 - o2; B3 = w3 - o3;
exact = Y1 * (A2 * B3 - A3 * B2) + Y2 * (A3 * B1 - A1 * B3) + Y3 * (A1 * B2 - A2 * B1);

# The computed largest size is below the exact one by at most u; so the bound, of three of them,
# rounds six times.
bound = kTripleProductErrorFactor * s;

{ |Y1| <= 1 /\ |Y2| <= 1 /\ |Y3| <= 1 /\ |A1| <= 1 /\ |A2| <= 1 /\ |A3| <= 1
  /\ |B1| <= 1 /\ |B2| <= 1 /\ |B3| <= 1 /\ s in [0x0.ffffffffffffp0, 1]
  -> |(value - exact) / bound| <= 1 }

# Refused: kTripleProductErrorFactor * 0.6
