// Draws an answer: the separating plane and its axis, the witness points, and the vertex pairs of
// the certificate.
import {DrawnGroup} from 'hulld/drawn_group.js';
import {MARK_COLORS} from 'hulld/palette.js';
import {discTexture, THREE} from 'hulld/three.js';

// With more edges, lines would hide the surface.
const MOST_PIECE_EDGES = 20000;

const number = ({x, y, z}) => [Number(x), Number(y), Number(z)];

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
      this.size = Math.min(...objects.map((o) => this.model.radiusOf(o))) || 1;
      const witness = answer.witness && isFinite(answer.separation?.value) &&
          [number(answer.witness.pointA), number(answer.witness.pointB)];
      if (witness && this.on.witness) this.addWitness(witness);
      if (answer.axis?.direction) this.addAxis(number(answer.axis.direction), witness, objects);
      if (answer.certificate && this.on.certificate) this.addCertificate(answer, objects);
      this.addPieces(objects);
    }
    this.stage.draw();
  }

  local(p) {
    return new THREE.Vector3(...p.map((value, k) => value - this.model.origin[k]));
  }

  line(points, color, options = {}) {
    const geometry = new THREE.BufferGeometry().setFromPoints(points);
    const material = new THREE.LineBasicMaterial(
        {color: color, depthTest: false, transparent: true, ...options});
    const line = new THREE.LineSegments(geometry, material);
    line.renderOrder = 8;
    this.group.add(line);
  }

  dots(points, color, size) {
    const geometry = new THREE.BufferGeometry().setFromPoints(points);
    const material = new THREE.PointsMaterial({
      color: color,
      size,
      sizeAttenuation: false,
      depthTest: false,
      transparent: true,
      map: discTexture(),
      alphaTest: 0.3,
    });
    const dots = new THREE.Points(geometry, material);
    dots.renderOrder = 9;
    this.group.add(dots);
  }

  // Draws the edges of the deciding pieces.
  addPieces(objects) {
    this.model.decidingPieces().forEach((piece, k) => {
      const hull = piece && this.model.hulls.get(piece.hullId);
      if (!hull || hull.edges.length > 2 * MOST_PIECE_EDGES) return;
      const vertices = Array.from(
          {length: hull.vertexCount},
          (_, i) => this.local(
              this.model.placed(objects[k], piece, hull.xyz.subarray(3 * i, 3 * i + 3))));
      this.line(Array.from(hull.edges, (i) => vertices[i]), this.stage.theme.edge);
    });
  }

  addWitness(points) {
    const [a, b] = points.map((p) => this.local(p));
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
        ({xyz}, k) =>
            this.local(this.model.placed(objects[k], pieces[k], xyz.slice(0, 3).map(Number))));
    const near = witness ? witness.map((p) => this.local(p)) : ends;
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
    if (this.on.plane) this.addPlane(n, middle);
  }

  addPlane(n, middle) {
    const half = 0.9 * this.size;
    const turn = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 0, 1), n);
    const corner = (x, y) =>
        new THREE.Vector3(half * x, half * y, 0).applyQuaternion(turn).add(middle);
    const plane = new THREE.Mesh(
        new THREE.PlaneBufferGeometry(2 * half, 2 * half), new THREE.MeshBasicMaterial({
          color: MARK_COLORS.plane,
          transparent: true,
          opacity: 0.16,
          side: THREE.DoubleSide,
          depthWrite: false,
        }));
    plane.quaternion.copy(turn);
    plane.position.copy(middle);
    plane.renderOrder = 7;
    this.group.add(plane);
    const corners = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
    const border = corners.flatMap((p, i) => [p, corners[(i + 1) % 4]]);
    this.line(border, MARK_COLORS.plane, {depthTest: true, opacity: 0.9});
  }

  addCertificate({certificate}, objects) {
    const points = [];
    const pieces = this.model.decidingPieces();
    for (const pair of certificate.pairs) {
      [pair.vertexA, pair.vertexB].forEach((vertex, k) => {
        points.push(this.local(this.model.placed(objects[k], pieces[k], number(vertex))));
      });
    }
    if (!points.length) return;
    this.line(points, MARK_COLORS.certificate);
    this.dots(points, MARK_COLORS.certificate, 7);
  }
}
