# A rational number or a root truncated to 60 bits or more, and then rounded to a double, in terms
# of the double: (1 + c) (1 + d) of it. The computed bound has one rounding, too.

needed = 1 / ((1 + c) * (1 + d)) - 1;
bound = kRoundedRelativeError * (1 + d2);

# The distance of a plane in units of the exact one, for its offset and components within 2^-52: by
# hand, because squares are positive, |n|^2 times a component's factor twice, and roundings of a
# square and two sums. `apart` is the largest difference of two equal distances, the larger of which
# is 1 as computed, with the rounding of their difference.
key = (1 + h) / (sqrt((1 + e) * (1 + e) * (1 + d3) * (1 + d4) * (1 + d5)) * (1 + d6)) * (1 + d7);
apart = 2 * (1 / key - 1) + d8 * (1 + kDepthKeyErrorFactor);
slack = kDepthKeyErrorFactor * (1 + d9);

{ |c| <= 1b-60 /\ |d| <= kUnitRoundoff /\ |d2| <= kUnitRoundoff
  /\ |h| <= 1b-52 /\ |e| <= 1b-52 /\ |d3| <= kUnitRoundoff /\ |d4| <= kUnitRoundoff
  /\ |d5| <= kUnitRoundoff /\ |d6| <= kUnitRoundoff /\ |d7| <= kUnitRoundoff
  /\ |d8| <= kUnitRoundoff /\ |d9| <= kUnitRoundoff
  -> |needed / bound| <= 1 /\ |apart / slack| <= 1 }

# Refused: kRoundedRelativeError * 0.5
# Refused: kDepthKeyErrorFactor * 0.0018
