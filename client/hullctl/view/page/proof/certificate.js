// Checks the certificate of an answer by exact arithmetic, from vertices and poses alone: the page
// trusts neither the server nor hullctl. The C++ client has the same check in
// client/verify/certificate_check.h.
import {combination, commonExponent, isZero, product, rotationOf, toIntegers} from 'hulld/proof/exact.js';
import {cross, difference, dot, scaled, sum} from 'hulld/vector.js';

// Limits of the contract: Caratheodory's number for a point of the hull, and Steinitz's for an
// interior point.
export const MAX_PAIRS = {
  RELATION_TOUCHING: 4,
  RELATION_OVERLAPPING: 6
};
const MAX_DIGITS = 100000;

class ProofFails extends Error {}

export function require(holds, reason) {
  if (!holds) throw new ProofFails(reason);
}

// Returns the missing proof if the check throws one, or an empty text.
export function problemOf(check) {
  try {
    check();
    return '';
  } catch (error) {
    if (error instanceof ProofFails) return error.message;
    throw error;
  }
}

export function checkRelation(relation) {
  require(
      ['RELATION_SEPARATED', 'RELATION_TOUCHING', 'RELATION_OVERLAPPING'].includes(relation),
      `${relation} has no certificate`);
}

export const areFinite = (numbers) => numbers.every(Number.isFinite);
const isRotated = (pose) => pose.slice(0, 4).some((value) => value !== 0);

// An exact hull: p = (rows v + shift) / scale for its vertices v, in integers, all lengths at one
// power of two.
class ExactHull {
  // xyz: the vertices; radii: of the hull and, for a piece of a body, of the piece.
  constructor(xyz, radii, exponent) {
    this.xyz = xyz;
    this.vertices = toIntegers(xyz, exponent);
    // The exact sum of the radii, not times scale.
    this.radius = toIntegers(radii, exponent).reduce((total, radius) => total + radius, 0n);
    this.rows = [[1n, 0n, 0n], [0n, 1n, 0n], [0n, 0n, 1n]];
    this.scale = 1n;
    this.shift = [0n, 0n, 0n];
  }

  // Returns this hull moved by p -> rotation(p) + translation / divisor.
  moved({rows, scale}, translation, divisor = 1n) {
    const turned = product(rows, this.shift);
    return Object.assign(Object.create(ExactHull.prototype), this, {
      rows: rows.map((row) => scaled(divisor, combination(row, this.rows))),
      scale: divisor * scale * this.scale,
      shift: sum(scaled(divisor, turned), scaled(scale * this.scale, translation)),
    });
  }

  // Returns scale p of vertex i.
  point(i) {
    return sum(product(this.rows, this.vertices.slice(3 * i, 3 * i + 3)), this.shift);
  }

  // Returns the least and the greatest n.p over the vertices, times scale.
  extent(n) {
    const [x, y, z] = combination(n, this.rows);
    const {vertices} = this;
    let least = null;
    let greatest = null;
    for (let i = 0; i < vertices.length; i += 3) {
      const height = x * vertices[i] + y * vertices[i + 1] + z * vertices[i + 2];
      if (least === null || height < least) least = height;
      if (greatest === null || height > greatest) greatest = height;
    }
    const shifted = dot(n, this.shift);
    return [least + shifted, greatest + shifted];
  }
}

// Returns a hull at its poses, from the world inward.
export const placedHull = ({xyz, poses, radii = []}, exponent) => poses.reduceRight(
    (hull, pose) => hull.moved(rotationOf(pose.slice(0, 4)), toIntegers(pose.slice(4), exponent)),
    new ExactHull(xyz, radii, exponent));

export function checkPlacement({xyz, poses, radii = []}) {
  require(xyz.every(Number.isFinite), 'a hull contains a number that is not finite');
  require(areFinite(radii), 'a radius contains a number that is not finite');
  require(radii.every((radius) => radius >= 0), 'a radius is negative');
  for (const pose of poses) {
    require(areFinite(pose.slice(4)), 'a translation contains a number that is not finite');
    require(areFinite(pose.slice(0, 4)), 'a rotation contains a number that is not finite');
    require(isRotated(pose), 'a rotation is zero');
  }
}

function readInteger(text) {
  require(
      text.length <= MAX_DIGITS && /^-?[0-9]+$/.test(text),
      'integer_direction is not a decimal integer');
  return BigInt(text);
}

const numbersOf = ({x = 0, y = 0, z = 0}) => [Number(x), Number(y), Number(z)];

// Returns {n, exponent}: a direction as integers times 2^exponent.
export function readDirection({direction, integerDirection}) {
  let n = null;
  let exponent = 0;
  if (direction) {
    const numbers = numbersOf(direction);
    require(areFinite(numbers), 'the direction contains a number that is not finite');
    exponent = commonExponent(numbers);
    n = toIntegers(numbers, exponent);
  } else {
    require(integerDirection, 'the certificate has no direction');
    n = ['x', 'y', 'z'].map((key) => readInteger(integerDirection[key] ?? ''));
  }
  require(!isZero(n), 'the direction is zero');
  return {n, exponent};
}

// Returns a number with the sign of min n.B - max n.A - r |n|, r the sum of the radii.
export function gapSign(a, b, n) {
  const width = b.extent(n)[0] * a.scale - a.extent(n)[1] * b.scale;
  const r = radiiOf(a, b);
  return r === 0n || width < 0n ? width : width ** 2n - r ** 2n * dot(n, n);
}

// The sum of the radii at the scale of A - B.
const radiiOf = (a, b) => (a.radius + b.radius) * a.scale * b.scale;

function checkVertex(index, vertex, {xyz}, name) {
  const count = xyz.length / 3;
  require(index < count, `${name} is vertex ${index}, but the hull has ${count}`);
  const isSame = !vertex || numbersOf(vertex).every((value, k) => value === xyz[3 * index + k]);
  require(isSame, `${name} does not have the coordinates of vertex ${index} of the hull`);
}

// Returns the points of A - B that the vertex pairs name, times both scales.
export function differences(maxPairs, {pairs = []}, a, b) {
  require(
      pairs.length <= maxPairs,
      `the certificate has ${pairs.length} vertex pairs; its relation allows ${maxPairs}`);
  pairs.forEach(({indexA = 0, indexB = 0, vertexA, vertexB}, i) => {
    checkVertex(indexA, vertexA, a, `pairs[${i}].a`);
    checkVertex(indexB, vertexB, b, `pairs[${i}].b`);
  });
  return pairs.map(
      ({indexA = 0, indexB = 0}) =>
          difference(scaled(b.scale, a.point(indexA)), scaled(a.scale, b.point(indexB))));
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
export function holdsOriginOnBoundary(points) {
  return points.some(
      (p, i) => isZero(p) ||
          points.slice(i + 1).some(
              (q, j) => (isZero(cross(p, q)) && dot(p, q) <= 0n) ||
                  points.slice(i + j + 2).some((r) => isInTriangle(p, q, r))));
}

// Returns true if 0 is in the interior of the hull of the points: no plane through 0 has all of
// them on one side. A plane through two of them is such a plane if any is.
export function holdsOriginInside(points) {
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
  const isSeparated = relation === 'RELATION_SEPARATED';
  if (relation !== 'RELATION_OVERLAPPING') {
    require(
        gapSign(a, b, readDirection(certificate).n) >= (isSeparated ? 1n : 0n),
        'the gap between the hulls along the direction is too small for their radii');
    if (isSeparated) return;
  }
  const points = differences(MAX_PAIRS[relation], certificate, a, b);
  require(
      comesWithin(points, radiiOf(a, b) ** 2n, relation === 'RELATION_OVERLAPPING'),
      'the hull of the differences of the vertex pairs is too far from 0 for the radii');
}

// Checks a certificate of hulls that are not empty, at one exponent.
export function checkExactly(relation, certificate, a, b) {
  if (a.radius + b.radius > 0n) {
    checkRounded(relation, certificate, a, b);
    return;
  }
  if (relation === 'RELATION_SEPARATED') {
    require(
        gapSign(a, b, readDirection(certificate).n) > 0n,
        'the direction does not separate: max n.A >= min n.B');
    return;
  }
  const points = differences(MAX_PAIRS[relation], certificate, a, b);
  if (relation === 'RELATION_OVERLAPPING') {
    require(
        holdsOriginInside(points),
        '0 is not inside the hull of the differences of the vertex pairs');
    return;
  }
  require(
      gapSign(a, b, readDirection(certificate).n) >= 0n,
      'the direction does not separate the interiors: max n.A > min n.B');
  require(
      holdsOriginOnBoundary(points),
      'the vertex pairs show no common point: 0 is not in the hull of their differences');
}

// Returns the lengths of a placed hull, as lists for commonExponent.
export const lengthsOf =
    ({xyz, poses, radii = []}) => [xyz, radii, ...poses.map((pose) => pose.slice(4))];

function check(relation, certificate, a, b) {
  checkRelation(relation);
  if (!a.xyz.length || !b.xyz.length) {
    require(relation === 'RELATION_SEPARATED', 'a hull is empty, and so separated from everything');
    return;
  }
  checkPlacement(a);
  checkPlacement(b);
  const exponent = commonExponent(...lengthsOf(a), ...lengthsOf(b));
  checkExactly(relation, certificate, placedHull(a, exponent), placedHull(b, exponent));
}

// Returns the missing proof, or an empty text if the certificate proves that A and B are in this
// relation. The certificate is in the JSON mapping of the contract; a and b are {xyz, poses,
// radii}: the vertices, and the poses and radii of the hull from the world inward (two for a piece
// of a body).
//
// Cost: O(vertices) operations on integers of any length: about two microseconds per vertex.
export const certificateProblem = (relation, certificate, a, b) =>
    problemOf(() => check(relation, certificate, a, b));
