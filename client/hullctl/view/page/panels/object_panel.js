// The selected object: its pose, a simplification of its hull, and its properties.
import {button, copy, details, element, facts, grouped, quiet, rounded, short, slider} from 'hulld/panels/dom.js';
import {poseText} from 'hulld/pose.js';

const SIDES = {
  inside: 'inside: a subset of the vertices',
  outside: 'outside: encloses the hull',
};
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

  rebuild() {
    const {object} = this.model;
    if (!object) {
      this.root.replaceChildren(
          element('h2', {}, 'Object'),
          quiet('Nothing is selected. Select an object in the picture or the list.'));
      return;
    }
    // A change of the object must not disturb typing.
    if (this.root.contains(document.activeElement) && this.shownIndex === object.index &&
        document.activeElement.matches('input, button')) {
      this.factsBlock.replaceChildren(...this.factRows(object));
      return;
    }
    this.shownIndex = object.index;
    this.factsBlock =
        element('div', {className: 'block', id: 'object-facts'}, ...this.factRows(object));
    const blocks = [this.controlBlock(object)];
    const isHull = object.hullId && !this.model.bodyOf(object);
    if (isHull && this.live && this.model.hullOf(object)?.dimension === 3) {
      blocks.push(this.simplifyBlock(object));
    }
    blocks.push(this.factsBlock);
    this.root.replaceChildren(...blocks);
  }

  factRows(object) {
    const hull = this.model.hullOf(object);
    const mesh = this.model.meshOf(object);
    const body = this.model.bodyOf(object);
    const info = this.model.info.get(object.hullId) || hull?.info || body?.info;
    const isSolid = !body && hull?.dimension === 3;
    const rows = [element('h2', {}, 'Facts')];
    if (object.gone) rows.push(quiet('Deleted.'));
    rows.push(facts([
      [body ? 'body' : 'hull', object.hullId || null],
      ['revision', info?.revision],
      ['pieces', body && grouped(body.pieces.length)],
      ['radius', object.radius ? rounded(object.radius) : null],
      ['dimension', body ? null : info?.dimension],
      ['vertices', hull && grouped(hull.vertexCount)],
      ['edges', isSolid ? grouped(hull.edgeCount) : null],
      ['facets', hull && grouped(hull.facetCount)],
      ['points', !body && info?.counts ? grouped(info.counts.received) : null],
      ['volume', isSolid ? rounded(hull.measures.volume) : null],
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
      return [...rows, ['contents', `${grouped(mesh.pointCount)} points${drawn}`]];
    }
    rows.push([
      'mesh',
      `${grouped(mesh.vertexCount)} vertices, ${grouped(mesh.triangles.length / 3)} triangles`
    ]);
    if (!hull || hull.dimension !== 3) return rows;
    const {volume, area} = mesh.measures;
    if (volume) {
      rows.push(
          ['mesh volume', rounded(volume)],
          ['hull is', `${short(hull.measures.volume / volume)} times as large as its mesh`]);
    } else {
      rows.push(
          ['mesh volume', 'none: the mesh is not closed'],
          ['hull has', `${short(hull.measures.area / area)} times the area of its mesh`]);
    }
    return rows;
  }

  controlBlock(object) {
    this.inputs = object.hullId ? object.pose.map((_, i) => this.poseInput(object, i)) : [];
    const fields = (from, to) => element(
        'div', {className: 'pose'},
        ...this.inputs.slice(from, to).flatMap(
            (input, i) => [element('b', {className: 'quiet'}, POSE_NAMES[from + i]), input]));
    const pose = object.hullId ? [fields(4, 7), this.rotationAndCopies(object, fields)] : [];
    return element(
        'div', {className: 'block'}, element('h2', {}, object.name), ...pose,
        this.opacitySlider(object));
  }

  rotationAndCopies(object, fields) {
    const copyButton = (id, label, text) => button(
        {
          id,
          title: 'Copies the placement with exact numbers',
          onclick: async ({target}) => {
            await copy(text());
            target.textContent = 'Copied';
            setTimeout(() => target.textContent = label, 1500);
          },
        },
        label);
    return element(
        'div', {}, details('Rotation (quaternion)', false, fields(0, 4)),
        element(
            'div', {className: 'buttons'},
            copyButton(
                'copy-hullctl', 'Copy for hullctl',
                () => `${object.hullId} --pose-b ${poseText(object.pose)}`),
            copyButton(
                'copy-python', 'Copy for Python',
                () => `(${JSON.stringify(object.hullId)}, [${
                    object.pose.map(String).join(', ')}])`)));
  }

  // A field shows a rounded number; while it has the focus, the text of the exact double.
  poseInput(object, i) {
    const input = element('input', {
      type: 'text',
      inputMode: 'decimal',
      autocomplete: 'off',
      spellcheck: false,
      readOnly: !this.live || object.isDriven,
      'data-pose': i,
      'aria-label': `${i < 4 ? 'Rotation' : 'Translation'} ${POSE_NAMES[i]}`,
      onchange: () => this.typed(object, i),
      // Text that is not a number stays until it is corrected.
      onfocus: () => {
        if (input.getAttribute('aria-invalid') !== 'true') input.value = String(object.pose[i]);
      },
      onblur: () => {
        if (input.getAttribute('aria-invalid') !== 'true') this.showNumber(input, object.pose[i]);
      },
    });
    this.showNumber(input, object.pose[i]);
    return input;
  }

  showNumber(input, value) {
    input.value = short(value);
    input.title = String(value);
  }

  typed(object, i) {
    const {value} = this.inputs[i];
    const pose = object.pose.slice();
    pose[i] = value.trim() === '' ? NaN : Number(value);
    const isValid = Number.isFinite(pose[i]) && pose.slice(0, 4).some((part) => part !== 0);
    this.inputs[i].setAttribute('aria-invalid', String(!isValid));
    if (isValid) this.model.setPose(object.index, pose, true);
  }

  // Called when the pose changes by other means.
  updatePose() {
    const {inputs, model: {object}} = this;
    if (!object || !inputs || this.shownIndex !== object.index) return;
    inputs.forEach((input, i) => {
      if (document.activeElement !== input) this.showNumber(input, object.pose[i]);
    });
  }

  opacitySlider(object) {
    const oninput = ({target}) => {
      object.opacity = Number(target.value);
      this.model.tell('color');
    };
    return slider(
        'Opacity ', {min: 0.1, max: 1, step: 0.05, value: object.opacity, id: 'opacity', oninput});
  }

  // A logarithmic range from 0 to half of the size.
  simplifyBlock(object) {
    this.steps = 0;
    this.simpler = null;
    this.output = element('output', {}, 'off');
    this.result = element('div', {className: 'result', 'aria-live': 'polite'});
    const ask = () => {
      const size = this.model.radiusOf(object);
      const maxError =
          this.steps === 0 ? 0 : Number((size * 10 ** ((this.steps - 40) / 13) / 2).toPrecision(3));
      this.output.textContent = this.steps === 0 ? 'off' : `error up to ${short(maxError)}`;
      this.simpler = null;
      if (this.steps === 0) this.result.replaceChildren();
      this.simplify(object, this.side, maxError);
    };
    const oninput = ({target}) => {
      this.steps = Number(target.value);
      ask();
    };
    const onchange = ({target}) => {
      this.side = target.value;
      ask();
    };
    const options = Object.entries(SIDES).map(
        ([value, text]) => element('option', {value, selected: this.side === value}, text));
    const block =
        slider('Simplify ', {min: 0, max: 40, value: 0, id: 'simplify', oninput}, this.output);
    block.append(element('select', {'aria-label': 'Side', onchange}, ...options));
    return element(
        'div', {className: 'block'}, element('h2', {}, 'A simpler hull'), block, this.result);
  }

  simplified(hull) {
    if (!this.result || this.steps === 0) return;
    this.simpler = hull;
    this.compare();
  }

  // Shows the simpler hull and its answer next to the exact ones. Called when either changes.
  compare() {
    const {simpler} = this;
    const {object} = this.model;
    const exact = object && this.model.hullOf(object);
    if (!simpler || !exact || this.steps === 0) return;
    const of = (count, all) => `${grouped(count)} of ${grouped(all)}`;
    this.result.replaceChildren(facts([
      ['vertices', of(simpler.vertexCount, exact.vertexCount)],
      ['facets', of(simpler.facetCount, exact.facetCount)],
      ['proven error', rounded(simpler.error)],
      ...this.simplerAnswer(simpler.error),
    ]));
  }

  // The separations of the exact hull and of the simpler one. If convex shapes differ by at most e,
  // so do their separations from any other; a shape inside another is not closer.
  simplerAnswer(error) {
    const {answer} = this.model;
    if (!answer?.separation) return [];
    const [value, bound] = [answer.separation.value, answer.separation.bound].map(Number);
    const isInside = this.side === 'inside';
    const low = value - bound - (isInside ? 0 : error);
    const high = value + bound + (isInside ? error : 0);
    const relations = [
      low < 0 && 'overlapping',
      low <= 0 && high >= 0 && 'touching',
      high > 0 && 'separated',
    ];
    return [
      ['exact separation', rounded(value)],
      ['of the simpler hull', rounded(low), ' to ', rounded(high)],
      ['relation', relations.filter(Boolean).join(' or ')],
    ];
  }

  simplifyFailed(message) {
    this.result?.replaceChildren(quiet(message));
  }
}
