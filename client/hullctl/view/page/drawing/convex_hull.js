// The convex hull of a few hundred points in floating point, for pictures only: answers use the
// hulls computed by hulld.
import {cross, difference, dot, unit} from 'hulld/vector.js';

// Points closer to a facet than this fraction of the extent do not count as outside.
const RELATIVE_TOLERANCE = 1e-9;

const GOLDEN_ANGLE = Math.PI * (3 - Math.sqrt(5));

// Returns the index of the maximum measure.
function farthest(points, measure) {
  let best = 0;
  let largest = -Infinity;
  points.forEach((point, i) => {
    const value = measure(point);
    if (value > largest) [best, largest] = [i, value];
  });
  return best;
}

// Returns unit vectors that are spread evenly. Source: the golden spiral, Swinbank and Purser 2006.
export function directions(count) {
  return Array.from({length: count}, (_, i) => {
    const z = 1 - (2 * i + 1) / count;
    const r = Math.sqrt(1 - z * z);
    return [r * Math.cos(GOLDEN_ANGLE * i), r * Math.sin(GOLDEN_ANGLE * i), z];
  });
}

// Returns the index of the vertex that is farthest in a direction.
export function extremeVertex(xyz, [x, y, z]) {
  let best = 0;
  let largest = -Infinity;
  for (let i = 0; i < xyz.length; i += 3) {
    const height = x * xyz[i] + y * xyz[i + 1] + z * xyz[i + 2];
    if (height > largest) [best, largest] = [i / 3, height];
  }
  return best;
}

// Returns the vertices of {xyz} as [x, y, z] or, if there are more than `maxCount`, the extreme
// ones in that many directions.
export function fewVertices({xyz}, maxCount) {
  const at = (i) => [xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]];
  const count = xyz.length / 3;
  if (count <= maxCount) return Array.from({length: count}, (_, i) => at(i));
  return [...new Set(directions(maxCount).map((d) => extremeVertex(xyz, d)))].map(at);
}

// Returns the unit normal of a triangle.
export const normalOf = ([a, b, c]) => unit(cross(difference(b, a), difference(c, a)));

// Returns the corners of the triangles of the hull of `points` ([x, y, z] each) as indices,
// counterclockwise from outside; empty if the points lie in a plane.
// Cost: O(points * facets). Source: the beneath-beyond method, Gruenbaum 1961.
export function hullTriangles(points) {
  const a = points[0];
  const b = points[farthest(points, (p) => Math.hypot(...difference(p, a)))];
  const along = difference(b, a);
  const tolerance = RELATIVE_TOLERANCE * Math.hypot(...along);
  const c = points[farthest(points, (p) => Math.hypot(...cross(difference(p, a), along)))];
  const normal = cross(along, difference(c, a));
  const height = (p) => dot(difference(p, a), normal) / (Math.hypot(...normal) || 1);
  const d = points[farthest(points, (p) => Math.abs(height(p)))];
  if (Math.abs(height(d)) <= tolerance) return [];

  const facetOf = (corners) => {
    const triangle = corners.map((i) => points[i]);
    const n = normalOf(triangle);
    return {corners, n, offset: dot(n, triangle[0]) + tolerance};
  };
  const [i, j, k, l] = [a, b, c, d].map((point) => points.indexOf(point));
  const base = height(d) < 0 ? [i, j, k] : [i, k, j];
  const sides = base.map((from, at) => [base[(at + 1) % 3], from, l]);
  let facets = [base, ...sides].map(facetOf);
  points.forEach((point, index) => {
    const isSeen = ({n, offset}) => dot(n, point) > offset;
    const seen = facets.filter(isSeen);
    if (!seen.length) return;
    const edges = new Map();
    for (const {corners} of seen) {
      corners.forEach((from, at) => {
        const to = corners[(at + 1) % 3];
        if (!edges.delete(`${to} ${from}`)) edges.set(`${from} ${to}`, [from, to, index]);
      });
    }
    facets = [...facets.filter((facet) => !isSeen(facet)), ...[...edges.values()].map(facetOf)];
  });
  return facets.flatMap(({corners}) => corners);
}
