// Checks the certificate of a motion by exact arithmetic, as certificate.js does for a pair at
// rest. The C++ client has the same check in client/verify/motion_check.h.
import {areFinite, checkExactly, checkPlacement, checkRelation, differences, gapSign, holdsOriginInside, holdsOriginOnBoundary, lengthsOf, MAX_PAIRS, placedHull, problemOf, readDirection, require} from 'hulld/proof/certificate.js';
import {combination, commonExponent, rotationForm, toInteger, toIntegers} from 'hulld/proof/exact.js';
import {dot, scaled, sum} from 'hulld/vector.js';

const negated = (n) => scaled(-1n, n);
const plus = (a, b) => a + b;
const times = (a, b) => a * b;
// A number in a message, as C++ prints it.
const shown = (number) => String(Number(number.toPrecision(6)));

// Returns moments: times in [0, 1] as the weights 1 - t and t of the two ends of a motion, times a
// common divisor.
function momentsOf(...moments) {
  const exponent = commonExponent([1, ...moments]);
  const divisor = toInteger(1, exponent);
  return moments.map((time) => {
    const t = toInteger(time, exponent);
    return {weights: [divisor - t, t], divisor};
  });
}

const between = ([start, end], {weights: [s, t]}) =>
    start.map((value, i) => s * value + t * end[i]);

// A motion in integers: all lengths at one power of two; the rotations of both ends at another,
// because their relative length matters.
class ExactMotion {
  constructor({xyz, poses: [start, ...inBody], end, radii}, exponent) {
    this.inBody = placedHull({xyz, poses: inBody, radii}, exponent);
    const rotations = [start, end].map((pose) => pose.slice(0, 4));
    const ofRotations = commonExponent(...rotations);
    this.q = rotations.map((q) => toIntegers(q, ofRotations));
    this.x = [start, end].map((pose) => toIntegers(pose.slice(4), exponent));
  }

  // Rotation and translation at a moment, times its divisor.
  rotationAt(moment) {
    return between(this.q, moment);
  }
  translationAt(moment) {
    return between(this.x, moment);
  }

  hullAt(time) {
    const [moment] = momentsOf(time);
    const q = this.rotationAt(moment);
    return this.inBody.moved(rotationForm(q, q), this.translationAt(moment), moment.divisor);
  }

  // True if one quaternion is a positive multiple of the other.
  keepsRotation() {
    const [p, q] = this.q;
    return p.reduce((cosine, value, i) => cosine + value * q[i], 0n) > 0n &&
        p.every((value, i) => q.every((other, j) => value * other === p[j] * q[i]));
  }
}

// A polynomial of time over an interval [t0, t1] is the list of its coefficients of u^(d-i) w^i,
// with the weights u : w = t1 - t : t - t0. They are Bernstein coefficients times positive numbers.
// Source: Farouki, "The Bernstein polynomial basis: a centennial retrospective", 2012.
function productOf(p, q, multiply = times, add = plus) {
  const coefficients = [];
  p.forEach((a, i) => q.forEach((b, j) => {
    const term = multiply(a, b);
    coefficients[i + j] = i + j in coefficients ? add(coefficients[i + j], term) : term;
  }));
  return coefficients;
}

const elevated = (p, ...operations) => productOf([1n, 1n], p, ...operations);

const sumOfForms = (f, g) =>
    ({rows: f.rows.map((row, i) => sum(row, g.rows[i])), scale: f.scale + g.scale});

// A number with the sign of a + b sqrt(c). Requires b >= 0 and c > 0.
const signOf = (a, b, c) => (a >= 0n || b === 0n ? a + b : b * b * c - a * a);

// Returns true if the hull is on the side n.p < offset of a plane over the interval, or, if
// `mayEnd`, on the plane at its end. `normals` and `offsets`: of the plane at both ends of the
// interval; both are linear in between, and |n| is replaced by the length of the longer normal.
// For each vertex p, |q|^2 (n.p + radius |n| - offset) is a polynomial of time of degree 4. It is
// negative if no coefficient is positive and the outer ones, its values at both ends, are negative.
function isBelow({inBody}, {normals, offsets}, {q, x, divisor}, mayEnd) {
  const forms = productOf(q, q, rotationForm, sumOfForms);
  const turned = productOf(normals, forms, (n, {rows}) => combination(n, rows), sum);
  const directions = elevated(turned, scaled, sum);
  const limits = elevated(offsets);
  const shifts = productOf(normals, x, dot).map((shift, i) => shift - divisor * limits[i]);
  const lengths = forms.map(({scale}) => inBody.scale * scale);
  const margins = elevated(elevated(lengths));
  const [start, end] = normals.map((n) => dot(n, n));
  const square = start > end ? start : end;
  const signs = productOf(lengths, shifts).map((shift, i) => {
    const height = shift + divisor * inBody.extent(directions[i])[1];
    return signOf(height, divisor * inBody.radius * margins[i], square);
  });
  const last = signs.pop();
  return signs[0] < 0n && signs.every((sign) => sign <= 0n) &&
      (last < 0n || (mayEnd && last === 0n));
}

// Returns the plane of an interval, all lengths at one power of two.
function planeOf(direction, {offset, endDirection, endOffset}, ofLengths) {
  const directions =
      [direction, endDirection ? readDirection({direction: endDirection}) : direction];
  const given = [offset, endOffset ?? offset].map(Number);
  require(areFinite(given), 'the offset is not finite');
  const exponents = directions.map(({exponent}) => exponent + ofLengths);
  const common = Math.min(commonExponent(given), ...exponents);
  return {
    normals: directions.map(({n}, i) => scaled(1n << BigInt(exponents[i] - common), n)),
    offsets: toIntegers(given, common),
  };
}

// A pair in motion, and its check.
class MovingPair {
  constructor(a, b, exponent) {
    this.a = a;
    this.b = b;
    this.exponent = exponent;
  }

  get isTranslation() {
    return this.a.keepsRotation() && this.b.keepsRotation();
  }

  hullsAt(time) {
    return [this.a.hullAt(time), this.b.hullAt(time)];
  }

  checkPlane(direction, interval, begin, mayEnd) {
    const {normals, offsets} = planeOf(direction, interval, this.exponent);
    const moments = momentsOf(begin, Number(interval.until));
    const {divisor} = moments[0];
    const isBelowOf = (motion, plane) => {
      const q = moments.map((moment) => motion.rotationAt(moment));
      const x = moments.map((moment) => motion.translationAt(moment));
      return isBelow(motion, plane, {q, x, divisor}, mayEnd);
    };
    require(isBelowOf(this.a, {normals, offsets}), 'A does not stay on its side of the plane');
    const opposite = {normals: normals.map(negated), offsets: offsets.map((value) => -value)};
    require(isBelowOf(this.b, opposite), 'B does not stay on its side of the plane');
  }

  // n.(b - a) is linear in time for each pair of vertices, so its signs at both ends suffice.
  checkTranslation({n}, {until}, begin, mayEnd) {
    require(this.isTranslation, 'the offset is missing, which is allowed only for translations');
    const [atBegin, atEnd] =
        [begin, Number(until)].map((time) => gapSign(...this.hullsAt(time), n));
    require(
        atBegin > 0n && (atEnd > 0n || (mayEnd && atEnd === 0n)),
        'the direction does not separate at both ends: max n.A >= min n.B');
  }

  // Checks intervals up to contact.separatedUntil.
  checkIntervals({separatedUntil, contactTime}, intervals = []) {
    const last = Number(separatedUntil);
    let begin = 0;
    intervals.forEach((interval, i) => {
      const until = Number(interval.until);
      // A comparison with NaN is false.
      require(
          begin < until && until <= last,
          `intervals[${i}] ends at ${shown(until)}, not between ${shown(begin)} and ${
              shown(last)}`);
      const mayEnd = contactTime !== undefined && until === last;
      const problem = problemOf(() => {
        const direction = readDirection(interval);
        const hasEnd = interval.endDirection !== undefined;
        require(
            hasEnd === (interval.endOffset !== undefined) &&
                !(hasEnd && interval.offset === undefined),
            'the end of a plane needs a direction, and offsets at both ends');
        if (interval.offset === undefined)
          this.checkTranslation(direction, interval, begin, mayEnd);
        else
          this.checkPlane(direction, interval, begin, mayEnd);
      });
      require(!problem, `intervals[${i}]: ${problem}`);
      begin = until;
    });
    require(
        begin === last,
        `the intervals end at ${shown(begin)}, before separated_until, ${shown(last)}`);
  }

  checkContact(relation, {separatedUntil, contactTime}, certificate = {}) {
    const time = Number(contactTime);
    const check = (atContact) => checkExactly(atContact, certificate, ...this.hullsAt(time));
    // With radii, the time of a translation is irrational in general.
    const isRounded = this.a.inBody.radius + this.b.inBody.radius > 0n;
    if (isRounded || !this.isTranslation) {
      check(relation);
    } else if (certificate.direction || certificate.integerDirection) {
      check('RELATION_TOUCHING');
    } else if (problemOf(() => check('RELATION_OVERLAPPING'))) {
      this.checkBriefContact([Number(separatedUntil), time], certificate);
    } else {
      require(relation === 'RELATION_OVERLAPPING', 'the hulls overlap; they do not merely touch');
    }
  }

  // Contact of a translation between two times. All differences of vertices move alike, so their
  // hulls at these times span all hulls in between; one of them contains 0 if the span does.
  checkBriefContact(bracket, certificate) {
    const span = bracket.flatMap(
        (time) => differences(MAX_PAIRS.RELATION_TOUCHING, certificate, ...this.hullsAt(time)));
    require(
        holdsOriginInside(span) || holdsOriginOnBoundary(span),
        'the vertex pairs show no common point up to contact_time');
  }
}

function checkTimes(relation, {separatedUntil, contactTime}) {
  const until = Number(separatedUntil);
  require(until >= 0 && until <= 1, `separated_until is ${shown(until)}, not in [0, 1]`);
  if (relation === 'RELATION_SEPARATED') {
    require(
        until === 1 && contactTime === undefined,
        'the pair is SEPARATED, but separated_until is not 1, or there is a contact_time');
    return;
  }
  require(contactTime !== undefined, 'the contact has no contact_time');
  const time = Number(contactTime);
  require(
      time >= until && time <= 1,
      `contact_time is ${shown(time)}, not between separated_until, ${shown(until)}, and 1`);
}

const endsOf = ({poses: [start, ...inBody], end, ...hull}) => [start, end].map(
    (pose) => ({...hull, poses: [pose, ...inBody]}));

// Returns a function that creates the pair of pieces i and j.
function pairsOf(a, b) {
  const ends = [...a, ...b].filter(({xyz}) => xyz.length).flatMap(endsOf);
  ends.forEach(checkPlacement);
  const exponent = commonExponent(...ends.flatMap(lengthsOf));
  const motions = [a, b].map((pieces) => pieces.map(() => null));
  const motionOf = (side, i) => (motions[side][i] ??= new ExactMotion([a, b][side][i], exponent));
  return (i, j) => new MovingPair(motionOf(0, i), motionOf(1, j), exponent);
}

function checkPair(relation, contact, certificate, a, b) {
  checkRelation(relation);
  checkTimes(relation, contact);
  if (!a.xyz.length || !b.xyz.length) {
    require(relation === 'RELATION_SEPARATED', 'a hull is empty, and so separated from everything');
    return;
  }
  const pair = pairsOf([a], [b])(0, 0);
  pair.checkIntervals(contact, contact.intervals);
  if (relation === 'RELATION_SEPARATED') return;
  const problem = problemOf(() => pair.checkContact(relation, contact, certificate));
  require(!problem, `contact: ${problem}`);
}

const STRENGTHS = ['RELATION_SEPARATED', 'RELATION_TOUCHING', 'RELATION_OVERLAPPING'];

function checkBodies(relation, contact, certificates, a, b) {
  checkRelation(relation);
  checkTimes(relation, contact);
  const pairOf = pairsOf(a, b);
  const isThere = (piece) => Boolean(piece?.xyz.length);
  const proven = new Set();
  let strongest = 0;
  for (const {pieceA = 0, pieceB = 0, relation: own, certificate, intervals} of certificates) {
    const name = `pieces ${pieceA} of A and ${pieceB} of B: `;
    require(
        isThere(a[pieceA]) && isThere(b[pieceB]) && !proven.has(`${pieceA} ${pieceB}`),
        `${name}there is no such pair of nonempty pieces, or it has two certificates`);
    proven.add(`${pieceA} ${pieceB}`);
    const problem = problemOf(() => {
      const pair = pairOf(pieceA, pieceB);
      pair.checkIntervals(contact, intervals);
      if (own === 'RELATION_SEPARATED') return;
      require(
          contact.contactTime !== undefined,
          'the pieces are in contact, but the answer has no contact_time');
      pair.checkContact(own, contact, certificate);
    });
    require(!problem, name + problem);
    strongest = Math.max(strongest, STRENGTHS.indexOf(own));
  }
  const shownRelation = STRENGTHS[strongest];
  const isPlain = () => a.every((piece, i) => !isThere(piece) || b.every((other, j) => {
    if (!isThere(other)) return true;
    const pair = pairOf(i, j);
    return pair.isTranslation && pair.a.inBody.radius + pair.b.inBody.radius === 0n;
  }));
  const mayOverlapLater =
      relation === 'RELATION_OVERLAPPING' && shownRelation === 'RELATION_TOUCHING' && isPlain();
  require(
      shownRelation === relation || mayOverlapLater,
      `the certificates show ${shownRelation}, not ${relation}`);
  if (Number(contact.separatedUntil) === 0) return;
  a.forEach(
      (piece, i) => b.forEach(
          (other, j) => require(
              !isThere(piece) || !isThere(other) || proven.has(`${i} ${j}`),
              `pieces ${i} of A and ${j} of B have no certificate`)));
}

// Returns the missing proof, or an empty text if the intervals of a FirstContact prove that A and B
// are separated up to separatedUntil, and the certificate that they are in contact at contactTime.
// Everything is in the JSON mapping of the contract; a and b are as for certificateProblem, with
// the `end` of the motion of their first pose. The width of the bracket is not checked.
//
// Cost: O(vertices) operations on integers of any length per interval: about ten microseconds per
// vertex.
export const motionProblem = (relation, contact, certificate, a, b) =>
    problemOf(() => checkPair(relation, contact, certificate, a, b));

// Like motionProblem, for bodies. a and b list all pieces; each pair of pieces has one certificate,
// which proves its separation up to separatedUntil.
export const bodiesMotionProblem = (relation, contact, certificates, a, b) =>
    problemOf(() => checkBodies(relation, contact, certificates, a, b));
