// Handles at the center of the selected object's box that move and turn it.
import {THREE} from 'hulld/drawing/three.js';
import {AXIS_COLORS} from 'hulld/palette.js';
import {rotate, unitQuaternion} from 'hulld/pose.js';

// three.js paints axes pure red, green, and blue, which color-blind users may confuse.
function repaint(handles) {
  const colors = {ff0000: AXIS_COLORS.x, '00ff00': AXIS_COLORS.y, '0000ff': AXIS_COLORS.z};
  handles.traverse((part) => {
    const color = part.material && colors[part.material.color.getHexString()];
    if (color) part.material.color.set(color);
  });
}

// three.js draws the rings of the turn handles as lines of one pixel. Adds a tube along each.
function thicken(handles) {
  const {gizmo} = handles.children.find((part) => part.gizmo);
  for (const ring of gizmo.rotate.children) {
    if (!ring.isLine || !/^[XYZ]$/.test(ring.name)) continue;
    const {array} = ring.geometry.attributes.position;
    const points = Array.from(
        {length: array.length / 3}, (_, i) => new THREE.Vector3().fromArray(array, 3 * i));
    const tube = new THREE.TubeBufferGeometry(
        new THREE.CatmullRomCurve3(points), points.length, 0.018, 6, false);
    const {color} = ring.material;
    const material = new THREE.MeshBasicMaterial({color, depthTest: false, transparent: true});
    const part = new THREE.Mesh(tube, material);
    part.renderOrder = Infinity;
    ring.add(part);
  }
}

export class Gizmo {
  constructor(model, stage) {
    this.model = model;
    this.stage = stage;
    this.proxy = new THREE.Object3D();
    this.handles = new THREE.TransformControls(stage.camera, stage.canvas);
    this.handles.setSize(0.75);
    repaint(this.handles);
    thicken(this.handles);
    stage.scene.add(this.proxy, this.handles);
    this.handles.addEventListener('change', () => stage.draw());
    this.handles.addEventListener('objectChange', () => this.follow(false));
    this.handles.addEventListener('dragging-changed', ({value}) => {
      stage.controls.enabled = !value;
      this.dragged = true;
      if (value)
        this.begin();
      else
        this.follow(true);
    });
    this.setMode('translate');
  }

  setMode(mode) {
    this.mode = mode;
    this.handles.setMode(mode);
    this.stage.draw();
  }

  // Moves the handles to the object, or hides them.
  update() {
    const {model} = this;
    const {object} = model;
    if (!this.handles.enabled || !object || !object.hullId || object.isDriven ||
        !model.isShown(object) || !model.shapeOf(object)) {
      this.handles.detach();
      return;
    }
    if (!this.handles.dragging) {
      this.stage.place(this.proxy, model.centerOf(object), object.pose);
      this.proxy.updateMatrixWorld();
    }
    this.handles.attach(this.proxy);
  }

  begin() {
    this.startPose = this.model.object.pose;
    this.startPosition = this.proxy.position.clone();
  }

  // Applies the handles to the pose. A move adds to the translation and keeps the quaternion bit
  // for bit; a turn keeps the center of the box in place.
  follow(rest) {
    const {model} = this;
    const {object} = model;
    if (!object || !this.startPose) return;
    let pose = this.startPose.slice();
    if (this.mode === 'translate') {
      const moved = this.proxy.position.clone().sub(this.startPosition).toArray();
      for (let k = 0; k < 3; ++k) pose[4 + k] += moved[k] * model.unit;
    } else {
      const {w, x, y, z} = this.proxy.quaternion;
      const center = model.shapeOf(object).center;
      const before = rotate(unitQuaternion(pose), center);
      const after = rotate(unitQuaternion([w, x, y, z]), center);
      pose = [w, x, y, z, ...[0, 1, 2].map((k) => pose[4 + k] + (before[k] - after[k]))];
    }
    model.setPose(object.index, pose, rest);
  }

  // Moves the selected object along a world axis by `steps` of about a hundredth of its size: a
  // power of ten, so that numbers stay short.
  nudge(axis, steps) {
    const {model} = this;
    const {object} = model;
    if (!object || !object.hullId || object.isDriven) return;
    const step = 10 ** Math.floor(Math.log10((model.radiusOf(object) || 1) / 20));
    const pose = object.pose.slice();
    const k = 4 + 'xyz'.indexOf(axis);
    // Snaps to a whole step if close enough.
    const count = pose[k] / step + steps;
    const rounded = Math.abs(count - Math.round(count)) < 1e-6 ? Math.round(count) : count;
    pose[k] = step < 1 ? rounded / Math.round(1 / step) : rounded * step;
    model.setPose(object.index, pose, true);
  }
}
