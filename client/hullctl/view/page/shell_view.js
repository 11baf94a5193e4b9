// Draws a simpler hull in place of the selected one with the shell of its proven error, or the
// shell of the tolerance.
import {DrawnGroup} from 'hulld/drawn_group.js';
import {MARK_COLOURS} from 'hulld/palette.js';
import {unitQuaternion} from 'hulld/pose.js';
import {shellGeometry} from 'hulld/shell.js';
import {THREE} from 'hulld/three.js';

// Shells of larger hulls are not drawn: they take longer to make than people wait.
const MOST_FACETS = 20000;

export class ShellView extends DrawnGroup {
  clear() {
    this.expected = null;
    this.empty();
  }

  empty() {
    super.clear();
    this.stage.draw();
  }

  expect(object) {
    this.expected = object;
  }

  // Inside: the hull lies within the error of the simpler one, so that the shell is about that one.
  // Outside: the simpler one lies within the error of the hull.
  showSimplified({hullId, side}, simpler) {
    const object = this.expected;
    if (!object || object.hullId !== hullId) return;
    this.empty();
    this.object = object;
    this.add(this.plain(simpler), simpler.centre, {color: MARK_COLOURS.witness, opacity: 0.35});
    const inner = side === 'inside' ? simpler : this.model.hullOf(object);
    this.addShell(inner, simpler.error);
    this.place();
  }

  showTolerance() {
    const {selected, tolerance} = this.model;
    this.empty();
    if (selected === null || tolerance === 0) return;
    this.object = this.model.objects[selected];
    const hull = this.model.hullOf(this.object);
    if (hull?.info.dimension === 3) this.addShell(hull, tolerance);
    this.place();
  }

  plain(hull) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(hull.positions(), 3));
    geometry.setIndex(new THREE.BufferAttribute(hull.triangles, 1));
    return geometry;
  }

  addShell(hull, distance) {
    if (hull.facetCount > MOST_FACETS || !(distance > 0)) return;
    this.add(shellGeometry(hull, distance), hull.centre, {color: MARK_COLOURS.shell, opacity: 0.2});
  }

  add(geometry, centre, {color, opacity}) {
    const part = new THREE.Mesh(geometry, new THREE.MeshPhongMaterial({
      color,
      opacity,
      transparent: true,
      depthWrite: false,
      flatShading: true,
      side: THREE.DoubleSide,
    }));
    part.renderOrder = 6;
    part.userData.centre = centre;
    this.group.add(part);
  }

  // Where the object is.
  place() {
    if (!this.object || !this.group.children.length) return;
    const base = this.model.hullOf(this.object).centre;
    const centre = this.model.centreOf(this.object);
    const [w, x, y, z] = unitQuaternion(this.object.pose);
    this.group.position.set(...centre.map((value, k) => value - this.model.origin[k]));
    this.group.quaternion.set(x, y, z, w);
    for (const part of this.group.children) {
      part.position.set(...part.userData.centre.map((value, k) => value - base[k]));
    }
    this.stage.draw();
  }
}
