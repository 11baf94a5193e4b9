// The content of a frame, prepared for drawing and measuring. In double; only GPU data is float,
// relative to the shape's center, so that distant shapes do not jitter.
import {toWorld} from 'hulld/pose.js';

// Returns {low, high, center} of points x y z x y z ...; the center of none is the origin.
export function boxOf(xyz) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < xyz.length; ++i) {
    const k = i % 3;
    if (xyz[i] < low[k]) low[k] = xyz[i];
    if (xyz[i] > high[k]) high[k] = xyz[i];
  }
  const center = xyz.length ? low.map((value, k) => value / 2 + high[k] / 2) : [0, 0, 0];
  return {low, high, center};
}

// Splits facets into triangle fans, and collects the distinct edges.
function triangulate(rest, facets) {
  const sizes = rest.subarray(0, facets);
  const corners = rest.subarray(facets);
  const count = corners.length - 2 * facets;
  const triangles = new Uint32Array(3 * count);
  const edges = new Uint32Array(corners.length * (facets === 1 ? 2 : 1));
  let t = 0;
  let e = 0;
  let first = 0;
  for (let f = 0; f < facets; ++f) {
    const size = sizes[f];
    for (let i = 0; i < size; ++i) {
      const a = corners[first + i];
      const b = corners[first + (i + 1) % size];
      // A closed surface has each edge once in each direction.
      if (a < b || facets === 1) {
        edges[e++] = a;
        edges[e++] = b;
      }
      if (i === 0 || i === size - 1) continue;
      triangles[t++] = corners[first];
      triangles[t++] = a;
      triangles[t++] = b;
    }
    first += size;
  }
  return {triangles, edges: edges.subarray(0, e)};
}

// Returns the signed volume (by the divergence theorem) and the area of triangles, about the
// center.
function measure(xyz, triangles, [cx, cy, cz]) {
  let volume = 0;
  let area = 0;
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const ax = xyz[a] - cx, ay = xyz[a + 1] - cy, az = xyz[a + 2] - cz;
    const bx = xyz[b] - cx, by = xyz[b + 1] - cy, bz = xyz[b + 2] - cz;
    const dx = xyz[c] - cx, dy = xyz[c + 1] - cy, dz = xyz[c + 2] - cz;
    const nx = by * dz - bz * dy, ny = bz * dx - bx * dz, nz = bx * dy - by * dx;
    volume += ax * nx + ay * ny + az * nz;
    const ux = bx - ax, uy = by - ay, uz = bz - az;
    const vx = dx - ax, vy = dy - ay, vz = dz - az;
    area += Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx);
  }
  return {volume: volume / 6, area: area / 2};
}

// Returns true if every edge of a mesh is traversed once in each direction, with corners at the
// same position merged. Only then does the mesh have a volume.
function isClosed(xyz, triangles) {
  const places = new Map();
  const place = (v) => {
    const key = `${xyz[3 * v]},${xyz[3 * v + 1]},${xyz[3 * v + 2]}`;
    if (!places.has(key)) places.set(key, places.size);
    return places.get(key);
  };
  const open = new Map();
  for (let t = 0; t < triangles.length; t += 3) {
    const corners = [place(triangles[t]), place(triangles[t + 1]), place(triangles[t + 2])];
    for (let i = 0; i < 3; ++i) {
      const a = corners[i];
      const b = corners[(i + 1) % 3];
      if (a === b) continue;
      const key = a < b ? `${a} ${b}` : `${b} ${a}`;
      open.set(key, (open.get(key) || 0) + (a < b ? 1 : -1));
    }
  }
  return [...open.values()].every((balance) => balance === 0);
}

// Larger meshes are not checked for closedness, which takes a second for a million triangles.
const MAX_TRIANGLES_TO_CLOSE = 400000;

export class Shape {
  constructor(xyz, triangles, edges) {
    this.xyz = xyz;
    this.triangles = triangles;
    this.edges = edges;
    this.isEmpty = xyz.length === 0;
    Object.assign(this, boxOf(xyz));
    const [cx, cy, cz] = this.center;
    this.radius = 0;
    for (let i = 0; i < xyz.length; i += 3) {
      this.radius =
          Math.max(this.radius, Math.hypot(xyz[i] - cx, xyz[i + 1] - cy, xyz[i + 2] - cz));
    }
  }

  get vertexCount() {
    return this.xyz.length / 3;
  }

  vertex(i) {
    return [this.xyz[3 * i], this.xyz[3 * i + 1], this.xyz[3 * i + 2]];
  }

  // Relative to the center, in the given unit.
  positions(unit) {
    const [cx, cy, cz] = this.center;
    const positions = new Float32Array(this.xyz.length);
    for (let i = 0; i < positions.length; i += 3) {
      positions[i] = (this.xyz[i] - cx) / unit;
      positions[i + 1] = (this.xyz[i + 1] - cy) / unit;
      positions[i + 2] = (this.xyz[i + 2] - cz) / unit;
    }
    return positions;
  }

  // Returns {volume, area}; volume is null if undefined.
  get measures() {
    if (!this.measured) {
      this.measured = measure(this.xyz, this.triangles, this.center);
      if (!this.hasVolume()) this.measured.volume = null;
    }
    return this.measured;
  }

  hasVolume() {
    return true;
  }
}

export class HullShape extends Shape {
  constructor({head, xyz, rest}) {
    const {triangles, edges} = triangulate(rest, head.facets);
    super(xyz, triangles, edges);
    this.facetCount = head.facets;
    this.facets = rest;
    this.info = head.header.hull;
    this.error = head.header.error;
    this.edgeCount = edges.length / 2;
    this.dimension = this.info.dimension;
  }

  get revision() {
    return this.info.revision;
  }
}

// The hulls of a body's pieces merged into a shape in the frame of the body.
class BodyShape extends Shape {
  // placed: [{hull, pose}].
  constructor(placed) {
    const total = (count) => placed.reduce((sum, {hull}) => sum + count(hull), 0);
    const xyz = new Float64Array(total((hull) => hull.xyz.length));
    const triangles = new Uint32Array(total((hull) => hull.triangles.length));
    const edges = new Uint32Array(total((hull) => hull.edges.length));
    let [vertex, t, e] = [0, 0, 0];
    for (const {hull, pose} of placed) {
      for (let i = 0; i < hull.xyz.length; i += 3) {
        xyz.set(toWorld(pose, hull.xyz.subarray(i, i + 3)), 3 * vertex + i);
      }
      for (const index of hull.triangles) triangles[t++] = vertex + index;
      for (const index of hull.edges) edges[e++] = vertex + index;
      vertex += hull.vertexCount;
    }
    super(xyz, triangles, edges);
    this.facetCount = total((hull) => hull.facetCount);
    this.edgeCount = edges.length / 2;
    this.dimension = Math.max(-1, ...placed.map(({hull}) => hull.dimension));
    this.isBody = true;
  }
}

// A body from the bridge, and its shape after its pieces have arrived.
export class Body {
  constructor({info, pieces}) {
    this.info = info;
    // [{hullId, pose}].
    this.pieces = pieces;
    this.hullIds = new Set(pieces.map(({hullId}) => hullId));
  }

  get revision() {
    return this.info.revision;
  }

  // Called when the hull of a piece arrives, changes, or is deleted.
  pieceChanged() {
    this.made = undefined;
  }

  // Returns undefined while a piece is in flight; omits `absent` pieces.
  shape(hulls, absent) {
    if (this.made === undefined) {
      const isReady = [...this.hullIds].every((id) => hulls.has(id) || absent.has(id));
      const there = this.pieces.filter(({hullId}) => hulls.has(hullId));
      this.made = isReady ?
          new BodyShape(there.map(({hullId, pose}) => ({hull: hulls.get(hullId), pose}))) :
          null;
    }
    return this.made ?? undefined;
  }
}

export class MeshShape extends Shape {
  constructor({head, xyz, rest}) {
    super(xyz, rest, new Uint32Array());
    this.pointCount = head.points;
  }

  hasVolume() {
    if (this.closed === undefined) {
      this.closed = this.triangles.length > 0 &&
          this.triangles.length / 3 <= MAX_TRIANGLES_TO_CLOSE && isClosed(this.xyz, this.triangles);
    }
    return this.closed;
  }
}

// Returns the indices of the vertices of `after` that `before` lacks.
export function newVertices(before, after) {
  const known = new Set();
  const key = (xyz, i) => `${xyz[i]},${xyz[i + 1]},${xyz[i + 2]}`;
  for (let i = 0; i < before.xyz.length; i += 3) known.add(key(before.xyz, i));
  const fresh = [];
  for (let i = 0; i < after.xyz.length; i += 3) {
    if (!known.has(key(after.xyz, i))) fresh.push(i / 3);
  }
  return fresh;
}
