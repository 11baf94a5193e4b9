// Checks the certificate of an answer by exact arithmetic, from vertices and poses alone: the page
// trusts neither the server nor hullctl. The C++ client has the same check in
// client/verify/certificate_check.h.
import {combination, commonExponent, cross, difference, dot, isZero, product, rotationOf, scaled, sum, toInteger, toIntegers} from 'hulld/proof/exact.js';

// Limits of the contract: Caratheodory's number for a point of the hull, and Steinitz's for an
// interior point.
const MOST_PAIRS = {
  RELATION_TOUCHING: 4,
  RELATION_OVERLAPPING: 6
};
const MOST_DIGITS = 100000;

class ProofFails extends Error {}

function require(holds, reason) {
  if (!holds) throw new ProofFails(reason);
}

const areFinite = (numbers) => numbers.every(Number.isFinite);
const isRotated = (pose) => pose.slice(0, 4).some((value) => value !== 0);

// An exact hull in the world: p_W = (rows p + shift) / scale in integers, all lengths at one power
// of two.
class ExactHull {
  // placed: {xyz, poses, radii}: the pose and radius of the hull and, for a piece of a body, of the
  // piece in the body.
  constructor({xyz, poses, radii = []}, exponent) {
    this.xyz = xyz;
    // The exact sum of the radii, not times scale.
    this.radius = toIntegers(radii, exponent).reduce((total, radius) => total + radius, 0n);
    this.exponent = exponent;
    this.rows = [[1n, 0n, 0n], [0n, 1n, 0n], [0n, 0n, 1n]];
    this.scale = 1n;
    this.shift = [0n, 0n, 0n];
    for (const pose of poses) {
      const {rows, scale} = rotationOf(pose.slice(0, 4));
      const t = toIntegers(pose.slice(4), exponent);
      const turned = this.rows.map((row) => combination(row, rows));
      this.shift = sum(scaled(scale, this.shift), scaled(scale, product(this.rows, t)));
      this.rows = turned;
      this.scale *= scale;
    }
  }

  vertex(i) {
    return toIntegers(this.xyz.subarray(3 * i, 3 * i + 3), this.exponent);
  }

  // Returns scale p_W of vertex i.
  world(i) {
    return sum(product(this.rows, this.vertex(i)), this.shift);
  }

  // Returns the least and the greatest n.p_W over the vertices, times scale.
  extent(n) {
    const turned = combination(n, this.rows);
    const {xyz, exponent} = this;
    let least = null;
    let greatest = null;
    for (let i = 0; i < xyz.length; i += 3) {
      const height = turned[0] * toInteger(xyz[i], exponent) +
          turned[1] * toInteger(xyz[i + 1], exponent) + turned[2] * toInteger(xyz[i + 2], exponent);
      if (least === null || height < least) least = height;
      if (greatest === null || height > greatest) greatest = height;
    }
    const shifted = dot(n, this.shift);
    return [least + shifted, greatest + shifted];
  }
}

function checkPlacement({xyz, poses, radii = []}) {
  require(xyz.every(Number.isFinite), 'a hull holds a number that is not finite');
  require(areFinite(radii), 'a radius holds a number that is not finite');
  require(radii.every((radius) => radius >= 0), 'a radius is negative');
  for (const pose of poses) {
    require(areFinite(pose.slice(4)), 'a translation holds a number that is not finite');
    require(areFinite(pose.slice(0, 4)), 'a rotation holds a number that is not finite');
    require(isRotated(pose), 'a rotation is zero');
  }
}

function readInteger(text) {
  require(
      text.length <= MOST_DIGITS && /^-?[0-9]+$/.test(text),
      'integer_direction is not a decimal integer');
  return BigInt(text);
}

const numbersOf = ({x = 0, y = 0, z = 0}) => [Number(x), Number(y), Number(z)];

function readDirection({direction, integerDirection}) {
  let n = null;
  if (direction) {
    const numbers = numbersOf(direction);
    require(areFinite(numbers), 'the direction holds a number that is not finite');
    n = toIntegers(numbers, commonExponent(numbers));
  } else {
    require(integerDirection, 'the certificate has no direction');
    n = ['x', 'y', 'z'].map((key) => readInteger(integerDirection[key] ?? ''));
  }
  require(!isZero(n), 'the direction is zero');
  return n;
}

// Returns min n.B - max n.A, times a positive number.
const gap = (a, b, n) => b.extent(n)[0] * a.scale - a.extent(n)[1] * b.scale;

function checkVertex(index, vertex, {xyz}, name) {
  const count = xyz.length / 3;
  require(index < count, `${name} is vertex ${index}, but the hull has ${count}`);
  const isSame = !vertex || numbersOf(vertex).every((value, k) => value === xyz[3 * index + k]);
  require(isSame, `${name} has other coordinates than vertex ${index} of the hull`);
}

// Returns the points of A - B that the vertex pairs name, times both scales.
function differences(relation, {pairs = []}, a, b) {
  const most = MOST_PAIRS[relation];
  require(
      pairs.length <= most,
      `the certificate has ${pairs.length} vertex pairs; its relation allows ${most}`);
  pairs.forEach(({indexA = 0, indexB = 0, vertexA, vertexB}, i) => {
    checkVertex(indexA, vertexA, a, `pairs[${i}].a`);
    checkVertex(indexB, vertexB, b, `pairs[${i}].b`);
  });
  return pairs.map(
      ({indexA = 0, indexB = 0}) =>
          difference(scaled(b.scale, a.world(indexA)), scaled(a.scale, b.world(indexB))));
}

// 0 = (b x c) a + (c x a) b + (a x b) c in the plane of the three, measured along its normal.
function isInTriangle(a, b, c) {
  const products = [cross(b, c), cross(c, a), cross(a, b)];
  const normal = products.reduce(sum);
  if (isZero(normal) || dot(normal, a) !== 0n) return false;
  return products.every((each) => dot(each, normal) >= 0n);
}

// Returns true if 0 is in the hull of the points. Requires points in a closed half space with 0 on
// its boundary; then three of them suffice. Source: Caratheodory 1907.
function holdsOriginOnBoundary(points) {
  return points.some(
      (p, i) => isZero(p) ||
          points.slice(i + 1).some(
              (q, j) => (isZero(cross(p, q)) && dot(p, q) <= 0n) ||
                  points.slice(i + j + 2).some((r) => isInTriangle(p, q, r))));
}

// Returns true if 0 is in the interior of the hull of the points: no plane through 0 has all of
// them on one side. A plane through two of them is such a plane if any is.
function holdsOriginInside(points) {
  let spansSpace = false;
  for (let i = 0; i < points.length; ++i) {
    for (let j = i + 1; j < points.length; ++j) {
      const normal = cross(points[i], points[j]);
      if (isZero(normal)) continue;
      const heights = points.map((point) => dot(normal, point));
      if (!heights.some((h) => h > 0n) || !heights.some((h) => h < 0n)) return false;
      spansSpace = true;
    }
  }
  return spansSpace;
}

// Returns true if a point of the hull of the points is within r of 0 or, if `nearer`, less than r
// from it. The nearest one is a vertex, or inside an edge or a triangle, or it is 0 itself.
function comesWithin(points, rSquared, nearer) {
  const holds = (numerator, denominator) =>
      nearer ? numerator < rSquared * denominator : numerator <= rSquared * denominator;
  const holdsEdge = (p, q) => {
    const e = difference(q, p);
    const moment = cross(p, q);
    return dot(p, e) < 0n && dot(q, e) > 0n && holds(dot(moment, moment), dot(e, e));
  };
  const holdsTriangle = (p, q, r) => {
    const normal = cross(difference(q, p), difference(r, p));
    const sides = [cross(p, q), cross(q, r), cross(r, p)];
    return !isZero(normal) && sides.every((side) => dot(normal, side) >= 0n) &&
        holds(dot(normal, p) ** 2n, dot(normal, normal));
  };
  return holdsOriginInside(points) ||
      points.some(
          (p, i) => holds(dot(p, p), 1n) ||
              points.slice(i + 1).some(
                  (q, j) => holdsEdge(p, q) ||
                      points.slice(i + j + 2).some((r) => holdsTriangle(p, q, r))));
}

// Checks a certificate of hulls with radii, not both 0.
function checkRounded(relation, certificate, a, b) {
  const r = (a.radius + b.radius) * a.scale * b.scale;
  if (relation !== 'RELATION_OVERLAPPING') {
    const n = readDirection(certificate);
    const width = gap(a, b, n);
    const more = width ** 2n - r ** 2n * dot(n, n);
    require(
        width >= 0n && (relation === 'RELATION_SEPARATED' ? more > 0n : more >= 0n),
        'the gap between the hulls along the direction is too small for their radii');
    if (relation === 'RELATION_SEPARATED') return;
  }
  const points = differences(relation, certificate, a, b);
  require(
      comesWithin(points, r ** 2n, relation === 'RELATION_OVERLAPPING'),
      'the hull of the differences of the vertex pairs is too far from 0 for the radii');
}

function check(relation, certificate, placedA, placedB) {
  require(
      ['RELATION_SEPARATED', 'RELATION_TOUCHING', 'RELATION_OVERLAPPING'].includes(relation),
      `${relation} has no certificate`);
  if (!placedA.xyz.length || !placedB.xyz.length) {
    require(relation === 'RELATION_SEPARATED', 'a hull is empty, and so separated from everything');
    return;
  }
  checkPlacement(placedA);
  checkPlacement(placedB);
  const lengths = [placedA, placedB].flatMap(
      ({xyz, poses, radii = []}) => [xyz, radii, ...poses.map((pose) => pose.slice(4))]);
  const exponent = commonExponent(...lengths);
  const a = new ExactHull(placedA, exponent);
  const b = new ExactHull(placedB, exponent);
  if (a.radius + b.radius > 0n) {
    checkRounded(relation, certificate, a, b);
    return;
  }
  if (relation === 'RELATION_SEPARATED') {
    require(
        gap(a, b, readDirection(certificate)) > 0n,
        'the direction does not separate: max n.A >= min n.B');
    return;
  }
  const points = differences(relation, certificate, a, b);
  if (relation === 'RELATION_OVERLAPPING') {
    require(
        holdsOriginInside(points),
        '0 is not inside the hull of the differences of the vertex pairs');
    return;
  }
  require(
      gap(a, b, readDirection(certificate)) >= 0n,
      'the direction does not keep the insides apart: max n.A > min n.B');
  require(
      holdsOriginOnBoundary(points),
      'the vertex pairs show no common point: 0 is not in the hull of their differences');
}

// Returns the missing proof, or an empty text if the certificate proves that A and B are in this
// relation. The certificate is in the JSON mapping of the contract; a and b are {xyz, poses,
// radii}: the vertices, and the poses and radii of the hull from the world inward (two for a piece
// of a body).
//
// Cost: O(vertices) operations on integers of any length: about two microseconds per vertex.
export function certificateProblem(relation, certificate, a, b) {
  try {
    check(relation, certificate, a, b);
    return '';
  } catch (error) {
    if (error instanceof ProofFails) return error.message;
    throw error;
  }
}
