// Names over the objects, as text of the page.
import {RELATIONS} from 'hulld/palette.js';
import {THREE} from 'hulld/three.js';

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
    const wanted = model.isCrowd || !model.show.labels ?
        model.objects.filter((o) => o.index === model.selected && model.show.labels) :
        model.objects;
    for (const object of wanted) {
      if (!model.isShown(object) || !model.shapeOf(object)) continue;
      const element = document.createElement('div');
      const relation = RELATIONS[model.relationOf.get(object.index)];
      element.className = 'label';
      element.textContent = object.name;
      if (relation) {
        const tag = document.createElement('span');
        tag.className = `tag ${relation.style}`;
        tag.textContent = ` ${relation.sign} ${relation.word}`;
        element.append(tag);
      }
      this.root.append(element);
      this.rows.set(object, element);
    }
    this.stage.draw();
  }

  // Above the object's box in the picture.
  place() {
    const {model, stage} = this;
    for (const [object, element] of this.rows) {
      const corners = model.cornersOf(object).map(
          (corner) => stage.toScreen(
              new THREE.Vector3(...corner.map((value, k) => value - model.origin[k]))));
      const inFront = corners.every(Boolean);
      element.hidden = !inFront;
      if (!inFront) continue;
      const xs = corners.map(([x]) => x);
      const x = (Math.min(...xs) + Math.max(...xs)) / 2;
      const y = Math.min(...corners.map((corner) => corner[1]));
      const left = Math.round(Math.min(Math.max(x, 60), stage.canvas.clientWidth - 60));
      element.style.transform =
          `translate(${left}px, ${Math.round(Math.max(y, 24))}px) translate(-50%, -100%)`;
    }
  }
}
