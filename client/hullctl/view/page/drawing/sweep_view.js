// Draws the motions: the swept shape of each moving object, the path of its center, and the
// outlines of the pair at its first contact.
//
// A swept shape is the union of the hulls of consecutive sampled positions: exact for a
// translation, slightly too small for a rotation.
import {fewVertices, hullTriangles} from 'hulld/drawing/convex_hull.js';
import {DrawnGroup} from 'hulld/drawing/drawn_group.js';
import {edgeWeight, geometryOf} from 'hulld/drawing/object_view.js';
import {geometryFrom, THREE} from 'hulld/drawing/three.js';
import {RELATIONS} from 'hulld/palette.js';
import {angleBetween, poseAt, toWorld} from 'hulld/pose.js';

// Largest rotation between two samples, in radians, and the greatest number of halvings.
const MAX_ANGLE = Math.PI / 16;
const MAX_HALVINGS = 6;
// Larger shapes are represented by their extreme vertices.
const MAX_VERTICES = 160;
// Bodies of more pieces are swept as one hull.
const MAX_PIECES = 12;
// More moving objects are drawn without swept shapes.
const MAX_SWEEPS = 24;
// With more edges, outlines would hide the surface.
const MAX_EDGES = 20000;

// Returns sampled poses of a motion, at least both ends.
function sampledPoses({start, endPose}) {
  const poses = [start];
  const sample = (t, until, halvings) => {
    const [from, to] = [t, until].map((time) => poseAt(start, endPose, time));
    if (halvings === 0 || angleBetween(from, to) <= MAX_ANGLE) {
      poses.push(to);
      return;
    }
    sample(t, (t + until) / 2, halvings - 1);
    sample((t + until) / 2, until, halvings - 1);
  };
  // Halves first, because the angle between both ends does not reveal a longer way around.
  sample(0, 0.5, MAX_HALVINGS);
  sample(0.5, 1, MAX_HALVINGS);
  return angleBetween(start, endPose) === 0 && poses.length === 3 ? [start, endPose] : poses;
}

// Returns the triangles' corners of the swept shape, and of the path, as `drawn` returns them.
function sweep(parts, center, poses, drawn) {
  const placed = (pose, p) => drawn(toWorld(pose, p));
  const corners = [];
  for (const vertices of parts) {
    for (let i = 1; i < poses.length; ++i) {
      const points = vertices.flatMap((p) => [placed(poses[i - 1], p), placed(poses[i], p)]);
      for (const index of hullTriangles(points)) corners.push(...points[index]);
    }
  }
  return {corners, path: poses.flatMap((pose) => placed(pose, center))};
}

export class SweepView extends DrawnGroup {
  // The geometry of each object that was drawn: {shape, unit, base, surface, path}.
  known = new Map();

  rebuild() {
    this.clear();
    const {model} = this;
    const {moving} = model;
    if (model.show.sweep && moving.length <= MAX_SWEEPS) {
      for (const object of moving) this.addSweep(object);
    }
    if (model.show.sweep) this.addContact();
    this.stage.draw();
  }

  // Returns the vertices of the shape, or of each piece of a body.
  partsOf(object, shape) {
    const rounded = this.model.roundedOf(object);
    const parts = rounded?.parts ?? this.model.partsOf(object);
    if (parts.length > MAX_PIECES) return [fewVertices(rounded ?? shape, MAX_VERTICES)];
    return parts.map(
        ({hull, pose}) => fewVertices(hull, MAX_VERTICES).map((p) => toWorld(pose, p)));
  }

  geometryOf(object, shape) {
    const known = this.known.get(object);
    if (known?.shape === shape && known.unit === this.model.unit) return known;
    known?.surface.dispose();
    known?.path.dispose();
    const {unit} = this.model;
    const base = toWorld(object.start, shape.center);
    const drawn = (p) => this.model.drawn(p, base);
    const {corners, path} =
        sweep(this.partsOf(object, shape), shape.center, sampledPoses(object), drawn);
    const [surface, line] =
        [corners, path].map((numbers) => geometryFrom({position: new Float32Array(numbers)}));
    const made = {shape, unit, base, surface, path: line};
    this.known.set(object, made);
    return made;
  }

  add(part, position, order) {
    part.position.copy(this.stage.local(position));
    part.userData.sharesGeometry = true;
    part.renderOrder = order;
    this.group.add(part);
  }

  // The union of the hulls looks like one shape: a first pass finds its nearest surface, a second
  // one paints it.
  addSweep(object) {
    const shape = this.model.hullOf(object);
    if (!shape || shape.isEmpty || !this.model.isShown(object)) return;
    const {surface, path, base} = this.geometryOf(object, shape);
    const color = this.model.colorOf(object);
    const depth = new THREE.MeshBasicMaterial({colorWrite: false, transparent: true});
    const paint = new THREE.MeshPhongMaterial({
      color,
      specular: 0x000000,
      flatShading: true,
      transparent: true,
      opacity: 0.25,
      depthWrite: false,
    });
    this.add(new THREE.Mesh(surface, depth), base, 10);
    this.add(new THREE.Mesh(surface, paint), base, 11);
    const line = new THREE.LineBasicMaterial({color, transparent: true, depthTest: false});
    this.add(new THREE.Line(path, line), base, 12);
  }

  // Outlines the moving objects of the pair at the time of the first contact.
  addContact() {
    const {model} = this;
    const contact = model.pairMotion?.firstContact;
    if (contact?.contactTime === undefined) return;
    const {lit} = RELATIONS[model.pairMotion.relation];
    for (const object of model.pair.map((index) => model.objects[index])) {
      const hull = model.hullOf(object);
      if (!object.endPose || !hull || !model.isShown(object) || hull.edges.length > 2 * MAX_EDGES)
        continue;
      const pose = poseAt(object.start, object.endPose, contact.contactTime);
      const material = new THREE.LineBasicMaterial({
        color: lit,
        transparent: true,
        opacity: edgeWeight(8 * hull.edgeCount),
        depthTest: false,
      });
      const outline = new THREE.LineSegments(geometryOf(hull, 'edges', model.unit), material);
      const center = toWorld(pose, hull.center);
      this.stage.place(outline, center, pose);
      this.add(outline, center, 13);
    }
  }

  // Called when the scene changes.
  forget() {
    for (const {surface, path} of this.known.values()) {
      surface.dispose();
      path.dispose();
    }
    this.known.clear();
  }
}
