// Measures the distance between two picked points of objects. The points move with their objects.
import {DrawnGroup} from 'hulld/drawing/drawn_group.js';
import {pick} from 'hulld/drawing/picking.js';
import {discMaterial, THREE} from 'hulld/drawing/three.js';
import {short} from 'hulld/panels/dom.js';
import {toWorld} from 'hulld/pose.js';
import {difference} from 'hulld/vector.js';

export class Ruler extends DrawnGroup {
  constructor(model, stage) {
    super(model, stage);
    this.on = false;
    // Picked points: {index, point}, in the frame of the object.
    this.ends = [];
    this.label = document.getElementById('measured');
    stage.afterFrame(() => this.placeLabel());
  }

  toggle() {
    this.on = !this.on;
    this.ends = [];
    this.rebuild();
  }

  // Takes a click on the picture. The third point starts another measurement.
  take(x, y) {
    const hit = pick(this.model, this.stage, x, y, {toVertex: true});
    if (!hit) return;
    if (this.ends.length === 2) this.ends = [];
    this.ends.push(hit);
    this.rebuild();
  }

  // The ends in the world, in double.
  get points() {
    return this.ends.map(({index, point}) => toWorld(this.model.objects[index].pose, point));
  }

  get distance() {
    const [p, q] = this.points;
    return q ? Math.hypot(...difference(q, p)) : null;
  }

  // Called when the scene is replaced.
  forget() {
    this.ends = [];
    this.rebuild();
  }

  rebuild() {
    this.clear();
    const {distance} = this;
    this.label.hidden = !this.on;
    this.label.textContent = distance !== null ? short(distance) :
        this.ends.length                       ? 'Pick the second point' :
                                                 'Pick two points';
    this.label.title = distance === null ? '' : String(distance);
    if (this.ends.length) {
      const geometry = new THREE.BufferGeometry().setFromPoints(
          this.points.map((point) => this.stage.local(point)));
      const common = {color: this.stage.theme.edge, depthTest: false, transparent: true};
      const line = new THREE.Line(geometry, new THREE.LineBasicMaterial(common));
      const dots = new THREE.Points(geometry, discMaterial({...common, size: 8}));
      line.renderOrder = dots.renderOrder = 10;
      this.group.add(line, dots);
    }
    this.stage.draw();
  }

  // Places the label at the middle of the line, or at the top of the picture.
  placeLabel() {
    if (!this.on) return;
    const [p, q] = this.points;
    const middle =
        q && this.stage.toScreen(this.stage.local(p.map((value, k) => (value + q[k]) / 2)));
    const [x, y] = middle || [this.stage.canvas.clientWidth / 2, 110];
    this.label.style.transform =
        `translate(${Math.round(x)}px, ${Math.round(y)}px) translate(-50%, -140%)`;
  }
}
