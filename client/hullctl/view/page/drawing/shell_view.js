// Draws a simpler hull, instead of the selected one, with the shell of its proven error, or the
// shell of the tolerance.
import {DrawnGroup} from 'hulld/drawing/drawn_group.js';
import {geometryFrom, THREE} from 'hulld/drawing/three.js';
import {MARK_COLORS} from 'hulld/palette.js';
import {unit as unitVector} from 'hulld/vector.js';

// Shells of larger hulls have as many facets as the hull.
const MAX_FACETS = 20000;

export class ShellView extends DrawnGroup {
  // Object whose hull is simplified.
  expected = null;

  clear() {
    this.expect(null);
    this.empty();
  }

  empty() {
    super.clear();
    this.stage.draw();
  }

  // The hull of the object is drawn as glass, so that the simpler one shows through.
  expect(object) {
    if (this.expected === object) return;
    if (this.expected) this.expected.isGlass = false;
    if (object) object.isGlass = true;
    this.expected = object;
    this.model.tell('color');
  }

  // Inside: the hull lies within the error of the simpler one, so the shell surrounds the simpler
  // one. Outside: the simpler one lies within the error of the hull.
  showSimplified({hullId, side}, simpler) {
    const object = this.expected;
    if (!object || object.hullId !== hullId) return;
    this.empty();
    this.object = object;
    const geometry =
        geometryFrom({position: simpler.positions(this.model.unit)}, simpler.triangles);
    this.add(geometry, simpler.center, {color: MARK_COLORS.witness, opacity: 0.35});
    const inner = side === 'inside' ? simpler : this.model.hullOf(object);
    this.addShell(inner, simpler.error);
    this.place();
  }

  showTolerance() {
    const {object, tolerance} = this.model;
    this.empty();
    if (!object || tolerance === 0) return;
    this.object = object;
    const hull = this.model.hullOf(this.object);
    if (hull?.dimension === 3 && !hull.isBody) this.addShell(hull, tolerance);
    this.place();
  }

  addShell(hull, distance) {
    if (!(distance > 0)) return;
    const make = hull.facetCount > MAX_FACETS ? fineShell : shellGeometry;
    this.add(
        make(hull, distance, this.model.unit), hull.center,
        {color: MARK_COLORS.shell, opacity: 0.2});
  }

  add(geometry, center, {color, opacity}) {
    const part = new THREE.Mesh(geometry, new THREE.MeshPhongMaterial({
      color,
      opacity,
      transparent: true,
      depthWrite: false,
      flatShading: true,
      side: THREE.DoubleSide,
    }));
    part.renderOrder = 6;
    part.userData.center = center;
    this.group.add(part);
  }

  // Moves the shell to the object.
  place() {
    if (!this.object || !this.group.children.length) return;
    const base = this.model.hullOf(this.object).center;
    this.stage.place(this.group, this.model.centerOf(this.object), this.object.pose);
    for (const part of this.group.children) {
      part.position.set(...this.model.drawn(part.userData.center, base));
    }
    this.stage.draw();
  }
}

// Returns a shell at a given distance around a hull, in drawn coordinates: its facets moved
// outward, with flat strips in place of the round parts over edges and vertices. The points within
// the distance of the hull form the round shell; this one approximates it from inside.
function shellGeometry(hull, distance, unit) {
  const sizes = hull.facets.subarray(0, hull.facetCount);
  const corners = hull.facets.subarray(hull.facetCount);
  const [cx, cy, cz] = hull.center;
  const positions = [];
  const indices = [];
  // New indices of the two ends of each directed edge.
  const moved = new Map();
  // Copies of each vertex, with the next facet around it.
  const around = new Map();
  let first = 0;
  for (let f = 0; f < sizes.length; ++f) {
    const facet = corners.subarray(first, first + sizes[f]);
    first += sizes[f];
    const n = normalOf(hull.xyz, facet);
    const base = positions.length / 3;
    facet.forEach((v, i) => {
      positions.push(
          (hull.xyz[3 * v] - cx + distance * n[0]) / unit,
          (hull.xyz[3 * v + 1] - cy + distance * n[1]) / unit,
          (hull.xyz[3 * v + 2] - cz + distance * n[2]) / unit);
      const j = (i + 1) % facet.length;
      moved.set(`${v} ${facet[j]}`, [base + i, base + j]);
      const previous = facet[(i + facet.length - 1) % facet.length];
      if (!around.has(v)) around.set(v, new Map());
      around.get(v).set(previous, {copy: base + i, next: facet[j]});
      if (i > 0 && i < facet.length - 1) indices.push(base, base + i, base + i + 1);
    });
  }
  for (const [edge, [a, b]] of moved) {
    const [v, w] = edge.split(' ').map(Number);
    const back = v < w && moved.get(`${w} ${v}`);
    if (back) indices.push(a, back[1], back[0], a, back[0], b);
  }
  for (const ring of around.values()) fillVertex(ring, indices);
  return geometryFrom({position: new Float32Array(positions)}, new Uint32Array(indices));
}

// Returns a shell of a hull with many small facets, in linear time and memory. Each vertex moves
// out by the distance along a mean of the normals around it. The hull is extreme at the vertex in
// that direction, so the moved vertex is exactly at the distance from the hull, and the hull of
// such points lies inside the round shell.
function fineShell(hull, distance, unit) {
  const {xyz, triangles} = hull;
  const normals = new Float64Array(xyz.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const ux = xyz[b] - xyz[a], uy = xyz[b + 1] - xyz[a + 1], uz = xyz[b + 2] - xyz[a + 2];
    const vx = xyz[c] - xyz[a], vy = xyz[c + 1] - xyz[a + 1], vz = xyz[c + 2] - xyz[a + 2];
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    for (const corner of [a, b, c]) {
      normals[corner] += nx;
      normals[corner + 1] += ny;
      normals[corner + 2] += nz;
    }
  }
  const position = new Float32Array(xyz.length);
  for (let i = 0; i < xyz.length; i += 3) {
    const scale = distance / (Math.hypot(normals[i], normals[i + 1], normals[i + 2]) || 1);
    for (let k = 0; k < 3; ++k) {
      position[i + k] = (xyz[i + k] - hull.center[k] + scale * normals[i + k]) / unit;
    }
  }
  return geometryFrom({position}, triangles);
}

// Fills a fan over the copies of a vertex, in the order of the facets around it.
function fillVertex(ring, indices) {
  const start = ring.keys().next().value;
  const copies = [];
  let at = start;
  for (let i = 0; i < ring.size && ring.has(at); ++i) {
    const {copy, next} = ring.get(at);
    copies.push(copy);
    at = next;
  }
  for (let i = 1; i + 1 < copies.length; ++i) indices.push(copies[0], copies[i + 1], copies[i]);
}

// Newell's method, for any polygon.
function normalOf(xyz, facet) {
  const n = [0, 0, 0];
  facet.forEach((v, i) => {
    const w = facet[(i + 1) % facet.length];
    for (let k = 0; k < 3; ++k) {
      const [p, q] = [(k + 1) % 3, (k + 2) % 3];
      n[k] += (xyz[3 * v + p] - xyz[3 * w + p]) * (xyz[3 * v + q] + xyz[3 * w + q]);
    }
  });
  return unitVector(n);
}
