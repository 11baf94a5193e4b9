// The surface of an object with a radius: its hulls plus a ball, approximated from inside.
import {directions, extremeVertex, fewVertices, hullTriangles, normalOf} from 'hulld/drawing/convex_hull.js';
import {toWorld} from 'hulld/pose.js';
import {Shape} from 'hulld/shape.js';
import {difference} from 'hulld/vector.js';

// Directions in which the surface of a hull is sampled, and those of all hulls of a scene.
const MAX_DIRECTIONS = 400;
const MAX_IN_ALL = 8000;
const MIN_DIRECTIONS = 40;
// The facets of hulls with more triangles are too small to be seen as flat.
const MAX_TRIANGLES = 100;
// Larger hulls are represented by their extreme vertices.
const MAX_VERTICES = 300;

// Returns points on the surface of a hull plus a ball: those in `count` directions, and the corners
// of its moved facets.
function pointsAround(hull, radius, count) {
  const moved = (p, n) => p.map((value, k) => value + radius * n[k]);
  const few = fewVertices(hull, MAX_VERTICES);
  const xyz = Float64Array.from(few.flat());
  const points = directions(count).map((d) => moved(few[extremeVertex(xyz, d)], d));
  const {triangles} = hull;
  if (triangles.length > 3 * MAX_TRIANGLES) return points;
  for (let t = 0; t < triangles.length; t += 3) {
    const corners =
        [...triangles.subarray(t, t + 3)].map((i) => [...hull.xyz.subarray(3 * i, 3 * i + 3)]);
    const n = normalOf(corners);
    points.push(...corners.map((p) => moved(p, n)));
    // A polygon has two sides.
    if (hull.dimension < 3) points.push(...corners.map((p) => moved(p, n.map((v) => -v))));
  }
  return points;
}

export class RoundedShape extends Shape {
  // parts: [{hull, pose, radius}]; center: that of the hulls alone; share: the number of objects
  // that share the directions.
  constructor(parts, center, share) {
    const count = Math.min(
        MAX_DIRECTIONS, Math.max(MIN_DIRECTIONS, Math.floor(MAX_IN_ALL / share / parts.length)));
    const points = [];
    const triangles = [];
    const rounded = parts.map(({hull, pose, radius}) => {
      const own = radius === 0 ? fewVertices(hull, count) : pointsAround(hull, radius, count);
      for (const corner of hullTriangles(own)) triangles.push(points.length + corner);
      points.push(...own.map((p) => toWorld(pose, p)));
      return {hull: {xyz: Float64Array.from(own.flat())}, pose};
    });
    super(Float64Array.from(points.flat()), Uint32Array.from(triangles), new Uint32Array());
    // [{hull: {xyz}, pose}].
    this.parts = rounded;
    this.center = center;
    this.radius = Math.max(...points.map((p) => Math.hypot(...difference(p, center))));
  }
}
