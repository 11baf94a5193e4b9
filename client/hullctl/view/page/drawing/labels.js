// Labels with the names of objects, as HTML over the canvas. Labels never overlap. The queried pair
// has priority; then objects closer to the camera.
import {RELATIONS} from 'hulld/palette.js';
import {element, tag} from 'hulld/panels/dom.js';

const GAP = 2;

const overlap = (a, b) => a.left < b.left + b.width + GAP && b.left < a.left + a.width + GAP &&
    a.top < b.top + b.height + GAP && b.top < a.top + a.height + GAP;

export class Labels {
  constructor(model, stage) {
    this.model = model;
    this.stage = stage;
    this.root = document.getElementById('labels');
    this.rows = new Map();
    stage.afterFrame(() => this.place());
  }

  rebuild() {
    const {model} = this;
    this.root.replaceChildren();
    this.rows.clear();
    const wanted = !model.show.labels ? [] :
        model.isNameless              ? model.objects.filter((o) => this.isOfPair(o)) :
                                        model.objects;
    for (const object of wanted) {
      if (!model.isShown(object) || !model.shapeOf(object)) continue;
      const relation = RELATIONS[model.relationOf.get(object.index)];
      const label = element(
          'div', {className: 'label'}, object.name, ...(relation ? [' ', tag(relation)] : []));
      this.root.append(label);
      this.rows.set(object, {label});
    }
    for (const row of this.rows.values()) {
      row.width = row.label.offsetWidth;
      row.height = row.label.offsetHeight;
    }
    this.stage.draw();
  }

  isOfPair({index}) {
    return index === this.model.selected || index === this.model.other;
  }

  // Places each label above its object in the picture, or below it. Hides it if it would overlap a
  // more important label or the buttons, or if the object is outside the picture. Reads all sizes
  // before it writes: reading after a write makes the browser lay out the page.
  place() {
    const taken = this.buttonBoxes();
    const shown = [];
    for (const [object, row] of this.rows) {
      row.box = null;
      row.anchor = this.anchorOf(object);
      if (!row.anchor) continue;
      row.rank = this.isOfPair(object) ? -1 : row.anchor.distance;
      shown.push(row);
    }
    for (const row of shown.sort((a, b) => a.rank - b.rank)) {
      row.box = this.freeBox(row, taken);
      if (row.box) taken.push(row.box);
    }
    for (const {label, box} of this.rows.values()) {
      label.hidden = !box;
      if (box) label.style.transform = `translate(${box.left}px, ${box.top}px)`;
    }
  }

  buttonBoxes() {
    const {left, top} = this.root.getBoundingClientRect();
    const buttons = this.stage.canvas.parentElement.querySelectorAll('.views button, .tools');
    return [...buttons]
        .map((button) => button.getBoundingClientRect())
        .filter(({width}) => width > 0)
        .map(({x, y, width, height}) => ({left: x - left, top: y - top, width, height}));
  }

  // Returns {left, top, width, height}, in pixels of the picture; undefined if there is no room.
  freeBox({anchor, width, height}, taken) {
    const {clientWidth, clientHeight} = this.stage.canvas;
    const left =
        Math.round(Math.min(Math.max(anchor.x - width / 2, GAP), clientWidth - width - GAP));
    return [anchor.top - height, anchor.bottom]
        .map((top) => ({left, top: Math.round(top), width, height}))
        .find(
            (box) => box.top >= 0 && box.top + height <= clientHeight &&
                taken.every((other) => !overlap(box, other)));
  }

  // Returns {x, top, bottom, distance}: the extent of an object in the picture, and its distance
  // from the camera; null if its middle is outside the picture.
  anchorOf(object) {
    const {model, stage} = this;
    const corners = model.cornersOf(object).map((corner) => stage.toScreen(stage.local(corner)));
    if (!corners.every(Boolean)) return null;
    const [xs, ys] = [0, 1].map((k) => corners.map((corner) => corner[k]));
    const [top, bottom] = [Math.min(...ys), Math.max(...ys)];
    const x = (Math.min(...xs) + Math.max(...xs)) / 2;
    const {clientWidth, clientHeight} = stage.canvas;
    if (x < 0 || x > clientWidth || bottom < 0 || top > clientHeight) return null;
    const center = stage.local(model.centerOf(object));
    return {x, top, bottom, distance: center.distanceTo(stage.camera.position)};
  }
}
