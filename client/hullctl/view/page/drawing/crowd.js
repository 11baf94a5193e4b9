// Draws many objects as a single surface and a single set of lines, placed in double and converted
// to float: two draw calls instead of two per object.
import {DrawnGroup, facetMaterial} from 'hulld/drawing/drawn_group.js';
import {FINE_LAYER} from 'hulld/drawing/stage.js';
import {geometryFrom, THREE} from 'hulld/drawing/three.js';
import {RELATIONS} from 'hulld/palette.js';
import {rotate, unitQuaternion} from 'hulld/pose.js';

// With more edges, lines would hide the surface.
const MAX_EDGES = 400000;

export class Crowd extends DrawnGroup {
  clear() {
    super.clear();
    // From the index of a drawn object to the index of its first vertex.
    this.ranges = new Map();
  }

  // `except`: indices of objects that are drawn separately.
  rebuild(except) {
    this.clear();
    const {model} = this;
    const members = model.objects.filter(
        (object) => !except.has(object.index) && model.isShown(object) && model.hullOf(object));
    const total = (count) => members.reduce((sum, o) => sum + count(model.hullOf(o)), 0);
    const edgeTotal = total((hull) => hull.edges.length);
    const withEdges = model.show.edges && edgeTotal / 2 <= MAX_EDGES;
    const vertices = total((hull) => hull.vertexCount);
    this.positions = new THREE.BufferAttribute(new Float32Array(3 * vertices), 3);
    this.fills = new THREE.BufferAttribute(new Uint8Array(3 * vertices), 3, true);
    this.strokes = new THREE.BufferAttribute(new Uint8Array(3 * vertices), 3, true);
    const triangles = new Uint32Array(total((hull) => hull.triangles.length));
    const edges = new Uint32Array(withEdges ? edgeTotal : 0);
    let [vertex, t, e] = [0, 0, 0];
    for (const object of members) {
      const hull = model.hullOf(object);
      this.ranges.set(object.index, vertex);
      this.write(object);
      for (let i = 0; i < hull.triangles.length; ++i) triangles[t++] = hull.triangles[i] + vertex;
      if (withEdges) {
        for (let i = 0; i < hull.edges.length; ++i) edges[e++] = hull.edges[i] + vertex;
      }
      vertex += hull.vertexCount;
    }
    this.recolor();
    this.add(triangles, edges);
  }

  add(triangles, edges) {
    const geometryWith = (color, index) => geometryFrom({position: this.positions, color}, index);
    const colored = {vertexColors: THREE.VertexColors};
    const parts = [];
    if (this.model.show.hull)
      parts.push(new THREE.Mesh(geometryWith(this.fills, triangles), facetMaterial(colored)));
    if (edges.length) {
      const lines = new THREE.LineSegments(
          geometryWith(this.strokes, edges), new THREE.LineBasicMaterial(colored));
      lines.layers.set(FINE_LAYER);
      parts.push(lines);
    }
    if (this.model.show.points) {
      parts.push(new THREE.Points(
          geometryWith(this.model.show.hull ? this.strokes : this.fills),
          new THREE.PointsMaterial({...colored, size: 3, sizeAttenuation: false})));
    }
    for (const part of parts) {
      // A bounding sphere of the whole crowd is always in view.
      part.frustumCulled = false;
      this.group.add(part);
    }
  }

  // Writes the positions of an object after its pose changed; ignores objects drawn separately.
  write(object) {
    const first = 3 * (this.ranges.get(object.index) ?? NaN);
    if (Number.isNaN(first)) return;
    const {unit} = this.model;
    const {xyz} = this.model.hullOf(object);
    const quaternion = unitQuaternion(object.pose);
    const shift = this.stage.local(object.pose.slice(4)).toArray();
    const {array} = this.positions;
    for (let i = 0; i < xyz.length; i += 3) {
      const p = rotate(quaternion, [xyz[i], xyz[i + 1], xyz[i + 2]]);
      for (let k = 0; k < 3; ++k) array[first + i + k] = p[k] / unit + shift[k];
    }
    this.positions.needsUpdate = true;
  }

  // Updates all colors after a change of the colliding objects. Colliding objects stand out by
  // their edges, or by their facets among objects without colors of their own.
  recolor() {
    const {model, stage} = this;
    const edge = new THREE.Color(stage.theme.edge);
    for (const [index, vertex] of this.ranges) {
      const object = model.objects[index];
      const lit = RELATIONS[model.relationOf.get(index)]?.lit;
      const own = new THREE.Color(object.color);
      const fill = lit && model.isNameless ? new THREE.Color(lit) : own;
      const stroke = lit ? new THREE.Color(lit) : own.clone().lerp(edge, stage.theme.edgeOpacity);
      const end = vertex + model.hullOf(object).vertexCount;
      for (const [{array}, color] of [[this.fills, fill], [this.strokes, stroke]]) {
        const bytes = color.toArray().map((value) => Math.round(255 * value));
        for (let i = 3 * vertex; i < 3 * end; ++i) array[i] = bytes[i % 3];
      }
    }
    this.fills.needsUpdate = true;
    this.strokes.needsUpdate = true;
  }
}
