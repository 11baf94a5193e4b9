# Lengths along a computed unit direction with an exact length within 8 u of 1. Units: S = 1.
#
# reach: the largest value V along it is at most 7, found within kSupportErrorFactor; V / (1 + l)
# plus the added bound must not be below the exact reach, after rounding.
value = V + kSupportErrorFactor * e;
high = (value + kReachErrorFactor * (1 + d1)) * (1 + d2);
reach = V / (1 + l);

# triangle: the least n . p over the corners of a computed triangle. By hand: n . z for the error z
# of a vertex is at most sqrt(3) kMinkowskiErrorFactor, and every partial sum of n . p at most 7.
computed = N + 0x1.bb67bp0 * kMinkowskiErrorFactor * (1 + l) * e + r;
low = (computed - kTriangleDistanceErrorFactor * (1 + d1)) * (1 + d2);
distance = N / (1 + l);

{ |V| <= 7 /\ |N| <= 7 /\ |l| <= 8b-53 /\ |e| <= 1 /\ |r| <= 0x1cp-53
  /\ |d1| <= kUnitRoundoff /\ |d2| <= kUnitRoundoff
  -> high - reach >= 0 /\ distance - low >= 0 }

high - reach -> V * ((l + d2 + l * d2) / (1 + l))
  + (kSupportErrorFactor * e + kReachErrorFactor * (1 + d1)) * (1 + d2) { 1 + l <> 0 };
distance - low -> N * (-(l + d2 + l * d2) / (1 + l))
  - (0x1.bb67bp0 * kMinkowskiErrorFactor * (1 + l) * e + r
     - kTriangleDistanceErrorFactor * (1 + d1)) * (1 + d2) { 1 + l <> 0 };

# Refused: kReachErrorFactor * 0.85
# Refused: kTriangleDistanceErrorFactor * 0.8
