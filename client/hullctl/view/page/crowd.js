// Draws many objects as a single surface and a single set of lines, placed in double and converted
// to float: two draw calls instead of two per object.
import {DrawnGroup, facetMaterial} from 'hulld/drawn_group.js';
import {RELATIONS} from 'hulld/palette.js';
import {rotate, unitQuaternion} from 'hulld/pose.js';
import {THREE} from 'hulld/three.js';

// With more edges, lines would hide the surface.
const MOST_EDGES = 400000;

export class Crowd extends DrawnGroup {
  clear() {
    super.clear();
    this.ranges = new Map();
  }

  // `except`: the object that is drawn separately.
  rebuild(except) {
    this.clear();
    const {model} = this;
    const members = model.objects.filter(
        (object) => object.index !== except && model.isShown(object) && model.hullOf(object));
    const total = (count) => members.reduce((sum, o) => sum + count(model.hullOf(o)), 0);
    const edgeTotal = total((hull) => hull.edges.length);
    const withEdges = model.show.edges && edgeTotal / 2 <= MOST_EDGES;
    this.positions = new Float32Array(3 * total((hull) => hull.vertexCount));
    this.colors = new Uint8Array(this.positions.length);
    const triangles = new Uint32Array(total((hull) => hull.triangles.length));
    const edges = new Uint32Array(withEdges ? edgeTotal : 0);
    let vertex = 0;
    let t = 0;
    let e = 0;
    for (const object of members) {
      const hull = model.hullOf(object);
      this.ranges.set(object.index, vertex);
      this.write(object, hull, vertex);
      for (let i = 0; i < hull.triangles.length; ++i) triangles[t++] = hull.triangles[i] + vertex;
      if (withEdges) {
        for (let i = 0; i < hull.edges.length; ++i) edges[e++] = hull.edges[i] + vertex;
      }
      vertex += hull.vertexCount;
    }
    this.add(triangles, edges);
  }

  add(triangles, edges) {
    const position = new THREE.BufferAttribute(this.positions, 3);
    const color = new THREE.BufferAttribute(this.colors, 3, true);
    const geometryWith = (index) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', position);
      geometry.setAttribute('color', color);
      geometry.setIndex(new THREE.BufferAttribute(index, 1));
      return geometry;
    };
    const parts = [];
    if (this.model.show.hull) {
      parts.push(new THREE.Mesh(
          geometryWith(triangles), facetMaterial({vertexColors: THREE.VertexColors})));
    }
    if (edges.length) {
      parts.push(new THREE.LineSegments(geometryWith(edges), new THREE.LineBasicMaterial({
        color: this.stage.theme.edge,
        transparent: true,
        opacity: 0.35,
      })));
    }
    if (this.model.show.points) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', position);
      parts.push(new THREE.Points(
          geometry,
          new THREE.PointsMaterial(
              {color: this.stage.theme.edge, size: 2, sizeAttenuation: false})));
    }
    for (const part of parts) {
      // A bounding sphere of the whole crowd is always in view.
      part.frustumCulled = false;
      this.group.add(part);
    }
  }

  write(object, hull, vertex) {
    const quaternion = unitQuaternion(object.pose);
    const {origin} = this.model;
    const relation = RELATIONS[this.model.relationOf.get(object.index)];
    const color = new THREE.Color(relation ? relation.lit : object.color);
    const bytes = [color.r, color.g, color.b].map((value) => Math.round(255 * value));
    const shift =
        [object.pose[4] - origin[0], object.pose[5] - origin[1], object.pose[6] - origin[2]];
    for (let i = 0; i < hull.xyz.length; i += 3) {
      const p = rotate(quaternion, [hull.xyz[i], hull.xyz[i + 1], hull.xyz[i + 2]]);
      for (let k = 0; k < 3; ++k) {
        this.positions[3 * vertex + i + k] = p[k] + shift[k];
        this.colors[3 * vertex + i + k] = bytes[k];
      }
    }
  }

  // Updates all colors after a change of the colliding objects.
  recolor() {
    for (const [index, vertex] of this.ranges) {
      const object = this.model.objects[index];
      const relation = RELATIONS[this.model.relationOf.get(index)];
      const color = new THREE.Color(relation ? relation.lit : object.color);
      const bytes = [color.r, color.g, color.b].map((value) => Math.round(255 * value));
      const end = 3 * (vertex + this.model.hullOf(object).vertexCount);
      for (let i = 3 * vertex; i < end; ++i) this.colors[i] = bytes[i % 3];
    }
    for (const part of this.group.children) {
      if (part.geometry.attributes.color) part.geometry.attributes.color.needsUpdate = true;
    }
  }
}
