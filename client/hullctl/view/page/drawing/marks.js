// Draws an answer: the separating plane and its axis, the witness points, and the vertex pairs of
// the certificate.
import {DrawnGroup} from 'hulld/drawing/drawn_group.js';
import {discMaterial, gridTexture, THREE} from 'hulld/drawing/three.js';
import {MARK_COLORS} from 'hulld/palette.js';

// With more edges, lines would hide the surface.
const MAX_PIECE_EDGES = 20000;

// Cells of the plane's grid per radius of the smaller object.
const PLANE_CELLS = 4;

const number = ({x, y, z}) => [Number(x), Number(y), Number(z)];

// Returns the polygon in which the plane through `middle` with normal n cuts a box, in order around
// `middle`; fewer than three points if it misses the box.
function clipToBox(n, middle, [low, high]) {
  const points = [];
  const at = (k, i) => (i >> k & 1 ? high : low).getComponent(k);
  for (let i = 0; i < 8; ++i) {
    for (let k = 0; k < 3; ++k) {
      if (i >> k & 1) continue;
      const from = new THREE.Vector3(at(0, i), at(1, i), at(2, i));
      const to = from.clone().setComponent(k, high.getComponent(k));
      const [p, q] = [from, to].map((end) => n.dot(end.clone().sub(middle)));
      if ((p <= 0) !== (q <= 0)) points.push(from.lerp(to, p / (p - q)));
    }
  }
  const turn = new THREE.Quaternion().setFromUnitVectors(n, new THREE.Vector3(0, 0, 1));
  const center = points.reduce((sum, point) => sum.add(point), new THREE.Vector3())
                     .divideScalar(points.length || 1);
  const angle = (point) => {
    const {x, y} = point.clone().sub(center).applyQuaternion(turn);
    return Math.atan2(y, x);
  };
  return points.sort((a, b) => angle(a) - angle(b));
}

export class Marks extends DrawnGroup {
  constructor(model, stage) {
    super(model, stage);
    this.on = {plane: true, axis: true, witness: true, certificate: true};
  }

  rebuild() {
    this.clear();
    const {answer, pair} = this.model;
    const objects = (pair || []).map((i) => this.model.objects[i]);
    if (answer && !answer.problem && pair && objects.every((o) => this.model.isShown(o))) {
      this.size = Math.min(...objects.map((o) => this.model.radiusOf(o))) / this.model.unit || 1;
      const witness = answer.witness && isFinite(answer.separation?.value) &&
          [number(answer.witness.pointA), number(answer.witness.pointB)];
      if (witness && this.on.witness) this.addWitness(witness);
      if (answer.axis?.direction) this.addAxis(number(answer.axis.direction), witness, objects);
      if (answer.certificate && this.on.certificate) this.addCertificate(answer, objects);
      this.addPieces(objects);
    }
    this.stage.draw();
  }

  line(points, color, options = {}) {
    const geometry = new THREE.BufferGeometry().setFromPoints(points);
    const material =
        new THREE.LineBasicMaterial({color, depthTest: false, transparent: true, ...options});
    const line = new THREE.LineSegments(geometry, material);
    line.renderOrder = 8;
    this.group.add(line);
  }

  dots(points, color, size) {
    const geometry = new THREE.BufferGeometry().setFromPoints(points);
    const dots = new THREE.Points(
        geometry, discMaterial({color, size, depthTest: false, transparent: true}));
    dots.renderOrder = 9;
    this.group.add(dots);
  }

  // Draws the edges of the deciding pieces.
  addPieces(objects) {
    this.model.decidingPieces().forEach((piece, k) => {
      const hull = piece && this.model.hulls.get(piece.hullId);
      if (!hull || hull.edges.length > 2 * MAX_PIECE_EDGES) return;
      const vertices = Array.from(
          {length: hull.vertexCount},
          (_, i) => this.stage.local(
              this.model.placed(objects[k], piece, hull.xyz.subarray(3 * i, 3 * i + 3))));
      this.line(Array.from(hull.edges, (i) => vertices[i]), this.stage.theme.edge);
    });
  }

  addWitness(points) {
    const [a, b] = points.map((p) => this.stage.local(p));
    this.line([a, b], MARK_COLORS.witness);
    this.dots([a, b], MARK_COLORS.witness, 9);
  }

  // Draws the plane between the two features of the axis, near the witness points.
  addAxis(direction, witness, objects) {
    const n = new THREE.Vector3(...direction).normalize();
    if (!(n.length() > 0.5)) return;
    const {axis} = this.model.answer;
    const pieces = this.model.decidingPieces();
    const ends = [axis.featureA, axis.featureB].map(
        ({xyz}, k) => this.stage.local(
            this.model.placed(objects[k], pieces[k], xyz.slice(0, 3).map(Number))));
    const near = witness ? witness.map((p) => this.stage.local(p)) : ends;
    const middle = near[0].clone().add(near[1]).multiplyScalar(0.5);
    const height = (n.dot(ends[0]) + n.dot(ends[1])) / 2;
    middle.addScaledVector(n, height - n.dot(middle));
    if (this.on.axis) {
      const length = 0.5 * this.size;
      const arrow = new THREE.ArrowHelper(
          n, middle.clone().addScaledVector(n, -length / 2), length,
          new THREE.Color(MARK_COLORS.axis).getHex(), 0.22 * length, 0.1 * length);
      arrow.traverse((part) => {
        part.renderOrder = 8;
        if (part.material) {
          part.material.depthTest = false;
          part.material.transparent = true;
        }
      });
      this.group.add(arrow);
    }
    if (this.on.plane) this.addPlane(n, middle, objects);
  }

  // Draws the part of the plane through `middle` inside the box of the objects, with a grid.
  addPlane(n, middle, objects) {
    const corners = clipToBox(n, middle, this.boxOf(objects));
    if (corners.length < 3) return;
    const geometry = new THREE.BufferGeometry().setFromPoints(corners);
    const turn = new THREE.Quaternion().setFromUnitVectors(n, new THREE.Vector3(0, 0, 1));
    const cells = corners.flatMap((corner) => {
      const {x, y} = corner.clone().sub(middle).applyQuaternion(turn);
      return [x, y].map((value) => value * PLANE_CELLS / this.size);
    });
    geometry.setAttribute('uv', new THREE.Float32BufferAttribute(cells, 2));
    geometry.setIndex(corners.slice(2).flatMap((_, i) => [0, i + 1, i + 2]));
    const plane = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({
      color: MARK_COLORS.plane,
      map: gridTexture(),
      transparent: true,
      side: THREE.DoubleSide,
      depthWrite: false,
    }));
    plane.renderOrder = 7;
    this.group.add(plane);
    const border = corners.flatMap((p, i) => [p, corners[(i + 1) % corners.length]]);
    this.line(border, MARK_COLORS.plane, {depthTest: true, opacity: 0.9});
  }

  // Returns [low, high]: the box of the objects, slightly enlarged.
  boxOf(objects) {
    const {corners, radius} = this.model.bounds(objects, true);
    const box = new THREE.Box3().setFromPoints(corners.map((corner) => this.stage.local(corner)));
    box.expandByScalar(0.05 * radius / this.model.unit);
    return [box.min, box.max];
  }

  addCertificate({certificate}, objects) {
    const points = [];
    const pieces = this.model.decidingPieces();
    for (const pair of certificate.pairs) {
      [pair.vertexA, pair.vertexB].forEach((vertex, k) => {
        points.push(this.stage.local(this.model.placed(objects[k], pieces[k], number(vertex))));
      });
    }
    if (!points.length) return;
    this.line(points, MARK_COLORS.certificate);
    this.dots(points, MARK_COLORS.certificate, 7);
  }
}
