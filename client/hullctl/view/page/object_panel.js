// The selected object: what it is, where it is, and a simpler hull in its place.
import {element, exact, facts, grouped, short} from 'hulld/dom.js';

const POSE_NAMES = ['w', 'x', 'y', 'z', 'x', 'y', 'z'];

export class ObjectPanel {
  constructor(model, live, simplify) {
    this.model = model;
    this.live = live;
    this.simplify = simplify;
    this.root = document.getElementById('object');
    this.side = 'inside';
    this.steps = 0;
  }

  get object() {
    return this.model.selected === null ? null : this.model.objects[this.model.selected];
  }

  rebuild() {
    const {object} = this;
    if (!object) {
      this.root.replaceChildren(
          element('h2', {}, 'Object'),
          element('p', {className: 'quiet'}, 'Nothing is selected. Click an object, or press J.'));
      return;
    }
    // Typing must not be disturbed by an object that changes.
    if (this.root.contains(document.activeElement) && this.shownIndex === object.index &&
        document.activeElement.matches('input')) {
      this.factsBlock.replaceChildren(...this.factRows(object));
      return;
    }
    this.shownIndex = object.index;
    this.factsBlock =
        element('div', {className: 'block', id: 'object-facts'}, ...this.factRows(object));
    const blocks = [this.factsBlock];
    if (object.hullId) blocks.push(this.poseBlock(object));
    if (object.hullId && this.live && this.model.hullOf(object)?.info.dimension === 3) {
      blocks.push(this.simplifyBlock(object));
    }
    this.root.replaceChildren(...blocks);
  }

  factRows(object) {
    const hull = this.model.hullOf(object);
    const mesh = this.model.meshOf(object);
    const info = this.model.info.get(object.hullId) || hull?.info;
    const rows = [element('h2', {}, object.name)];
    if (object.gone) rows.push(element('p', {className: 'quiet'}, 'This hull was deleted.'));
    if (hull?.message) rows.push(element('p', {className: 'quiet'}, hull.message));
    rows.push(facts([
      ['hull', object.hullId || null],
      ['revision', info?.revision],
      ['dimension', info?.dimension],
      ['vertices', hull && grouped(hull.vertexCount)],
      ['edges', hull?.info.dimension === 3 ? grouped(hull.edgeCount) : null],
      ['facets', hull && grouped(hull.facetCount)],
      ['points', info?.counts && grouped(info.counts.received)],
      ['volume', hull?.info.dimension === 3 ? exact(hull.measures.volume) : null],
      [
        'box',
        hull && !hull.isEmpty ? hull.high.map((h, k) => short(h - hull.low[k])).join(' \u00d7 ') :
                                null
      ],
      ...this.meshRows(hull, mesh, object),
    ]));
    return rows;
  }

  meshRows(hull, mesh, object) {
    if (!mesh) return [];
    const rows = [['file', this.model.files[object.file].name]];
    if (!mesh.triangles.length) {
      const drawn =
          mesh.vertexCount < mesh.pointCount ? `, ${grouped(mesh.vertexCount)} drawn` : '';
      return [...rows, ['in it', `${grouped(mesh.pointCount)} points${drawn}`]];
    }
    rows.push([
      'mesh',
      `${grouped(mesh.vertexCount)} vertices, ${grouped(mesh.triangles.length / 3)} triangles`
    ]);
    if (!hull || hull.info.dimension !== 3) return rows;
    const {volume, area} = mesh.measures;
    if (volume) {
      rows.push(
          ['mesh volume', exact(volume)],
          ['hull is', `${short(hull.measures.volume / volume)} times as large as its mesh`]);
    } else {
      rows.push(
          ['mesh volume', 'none: the mesh is not closed'],
          ['hull has', `${short(hull.measures.area / area)} times the area of its mesh`]);
    }
    return rows;
  }

  poseBlock(object) {
    this.inputs =
        object.pose.map((value, i) => element('input', {
                          type: 'text',
                          inputMode: 'decimal',
                          value: String(value),
                          autocomplete: 'off',
                          spellcheck: false,
                          readOnly: !this.live,
                          'data-pose': i,
                          'aria-label': `${i < 4 ? 'Rotation' : 'Translation'} ${POSE_NAMES[i]}`,
                          onchange: () => this.typed(object),
                        }));
    const fields = (from, to) => element(
        'div', {className: 'pose'},
        ...this.inputs.slice(from, to).flatMap(
            (input, i) => [element('b', {className: 'quiet'}, POSE_NAMES[from + i]), input]));
    return element(
        'div', {className: 'block'}, element('h2', {}, 'Translation'), fields(4, 7),
        element(
            'details', {className: 'command'}, element('summary', {}, 'Rotation (quaternion)'),
            fields(0, 4)));
  }

  typed(object) {
    const pose = this.inputs.map(({value}) => (value.trim() === '' ? NaN : Number(value)));
    this.inputs.forEach((input, i) => {
      input.setAttribute('aria-invalid', String(!Number.isFinite(pose[i])));
    });
    const turns = pose.slice(0, 4).some((value) => value !== 0);
    if (pose.every(Number.isFinite) && turns) this.model.setPose(object.index, pose, true);
  }

  // The pose changed by other means.
  updatePose() {
    const {object, inputs} = this;
    if (!object || !inputs || this.shownIndex !== object.index) return;
    inputs.forEach((input, i) => {
      if (document.activeElement !== input) input.value = String(object.pose[i]);
    });
  }

  // From nothing to half of the size, by powers.
  simplifyBlock(object) {
    this.steps = 0;
    this.output = element('output', {}, 'off');
    this.result = element('div', {'aria-live': 'polite'});
    const ask = () => {
      const size = this.model.radiusOf(object);
      const maxError =
          this.steps === 0 ? 0 : Number((size * 10 ** ((this.steps - 40) / 13) / 2).toPrecision(3));
      this.output.textContent = this.steps === 0 ? 'off' : `error up to ${short(maxError)}`;
      if (this.steps === 0) this.result.replaceChildren();
      this.simplify(object, this.side, maxError);
    };
    return element(
        'div', {className: 'block'}, element('h2', {}, 'A simpler hull'),
        element(
            'div', {className: 'slider'},
            element('label', {}, 'Simplify ', this.output, element('input', {
                      type: 'range',
                      min: 0,
                      max: 40,
                      value: 0,
                      id: 'simplify',
                      oninput: ({target}) => {
                        this.steps = Number(target.value);
                        ask();
                      },
                    })),
            element(
                'select', {
                  'aria-label': 'Side',
                  onchange: ({target}) => {
                    this.side = target.value;
                    ask();
                  },
                },
                element(
                    'option', {value: 'inside', selected: this.side === 'inside'},
                    'inside: a subset of the vertices'),
                element(
                    'option', {value: 'outside', selected: this.side === 'outside'},
                    'outside: encloses the hull'))),
        this.result);
  }

  simplified(hull) {
    if (!this.result || this.steps === 0) return;
    this.result.replaceChildren(facts([
      ['vertices', grouped(hull.vertexCount)],
      ['facets', grouped(hull.facetCount)],
      ['proven error', exact(hull.error)],
    ]));
  }

  simplifyFailed(message) {
    this.result?.replaceChildren(element('p', {className: 'quiet'}, message));
  }
}
