// The server's answer about the pair, and about all pairs of the scene.
import {MARK_COLORS, RELATIONS, RUNGS} from 'hulld/palette.js';
import {button, details, element, facts, grouped, missingAnswer, quiet, rounded, short, slider, tag} from 'hulld/panels/dom.js';
import {ProofLine} from 'hulld/panels/proof_line.js';
import {poseText} from 'hulld/pose.js';
import {certificateProblem} from 'hulld/proof/certificate.js';

const MAX_ROWS = 200;
const MAX_CHOICES = 400;
const MARK_NAMES = {
  plane: 'plane',
  axis: 'axis',
  witness: 'witness points',
  certificate: 'certificate',
};
const AXIS_KINDS = {
  AXIS_KIND_FACET_A: 'facet of A',
  AXIS_KIND_FACET_B: 'facet of B',
  AXIS_KIND_EDGE_EDGE: 'two edges',
  AXIS_KIND_FLAT: 'flat hulls',
  AXIS_KIND_GENERAL: 'found by search',
};

const roundedVector = ({x, y, z}) => rounded(x, y, z);
const note = (text) => element('span', {className: 'quiet'}, text);

export class AnswerPanel {
  constructor(model, marks, live) {
    this.model = model;
    this.marks = marks;
    this.live = live;
    this.root = document.getElementById('answer');
    // Shown next to the objects because it concerns all of them.
    this.list = document.getElementById('collisions');
    this.body = element('div', {'aria-live': 'polite', 'aria-busy': 'false'});
    this.proofLine = new ProofLine('proof');
  }

  // Called when the pair changes.
  rebuild() {
    const {model} = this;
    const {pair} = model;
    if (!pair) {
      const hint = model.objects.filter((o) => o.hullId && !o.gone).length > 1 ?
          'Select an object in the picture or the list; the nearest other object completes the pair.' :
          'A pair needs two hulls or bodies.';
      this.root.replaceChildren(element('h2', {}, 'Answer'), quiet(hint));
      return;
    }
    this.root.replaceChildren(
        element('div', {className: 'pair'}, ...this.choice('A', 0), ...this.choice('B', 1)),
        this.body);
    this.update();
  }

  choice(letter, place) {
    const {model} = this;
    const {pair} = model;
    const select = element('select', {'aria-label': `Object ${letter}`, id: `object-${letter}`});
    const near = model.objects.slice(0, MAX_CHOICES);
    if (pair[place] >= MAX_CHOICES) near.push(model.objects[pair[place]]);
    for (const object of near) {
      if (!object.hullId || object.index === pair[1 - place]) continue;
      select.append(element(
          'option', {value: object.index, selected: object.index === pair[place]}, object.name));
    }
    select.addEventListener('change', () => {
      const chosen = Number(select.value);
      if (model.selected === pair[place])
        model.select(chosen, pair[1 - place]);
      else
        model.select(model.selected, chosen);
    });
    return [element('b', {}, letter), select];
  }

  // Called when the answer changes.
  update() {
    const {answer, pair} = this.model;
    if (!pair) return;
    if (!answer) {
      this.body.replaceChildren(quiet(missingAnswer(this.live)));
      return;
    }
    if (answer.problem) {
      this.body.replaceChildren(element('p', {}, answer.problem));
      return;
    }
    // Announced by screen readers only at rest.
    this.body.setAttribute('aria-busy', String(!answer.rest));
    const [more, command] = [...this.body.querySelectorAll('details')].map(({open}) => open);
    this.body.replaceChildren(
        this.verdict(answer), this.proof(answer), this.tables(answer, more), this.toggles(),
        this.command(answer, command));
  }

  // The result of checking the certificate in this page.
  proof(answer) {
    if (!answer.rest || !answer.certificate) return element('p', {id: 'proof'});
    const sides = this.model.pair.map((index, k) => this.placedSide(answer, index, k));
    const isPieces = this.model.decidingPieces().some(Boolean);
    const concerned = isPieces ? ' for the deciding pieces,' : '';
    return this.proofLine.show(answer, sides, {
      steps: sides.reduce((total, {xyz}) => total + xyz?.length / 3, 0),
      proven: `Proven${concerned} by exact arithmetic in this page`,
      check: () => certificateProblem(answer.relation, answer.certificate, ...sides),
    });
  }

  // Returns what the certificate concerns at place k of the pair, or the reason why the page cannot
  // check it.
  placedSide(answer, index, k) {
    const {model} = this;
    const object = model.objects[index];
    const version = [answer.hullA, answer.hullB][k];
    const piece = model.decidingPieces()[k];
    const hull = model.hulls.get(piece ? piece.hullId : object.hullId);
    if (!hull) return `the vertices of ${piece ? piece.hullId : object.name} are not available`;
    // An inline shape has no version, and never changes.
    if (version.hullId && model.revisionOf(object.hullId) !== version.revision)
      return `${object.name} has changed since the answer`;
    const {pose, radius = 0} = object;
    if (!pose.every((value, i) => value === answer.poses[7 * k + i]))
      return `${object.name} has moved since the answer`;
    return piece ? {xyz: hull.xyz, poses: [pose, piece.pose], radii: [radius, piece.radius]} :
                   {xyz: hull.xyz, poses: [pose], radii: [radius]};
  }

  verdict(answer) {
    const {word, sign, style} =
        RELATIONS[answer.relation] || {word: 'no answer', sign: '', style: ''};
    return element(
        'p', {className: 'verdict', id: 'verdict'},
        element('span', {className: style, id: 'relation'}, `${sign} ${word}`),
        element('span', {className: 'moving'}, answer.rest ? '' : 'while moving'));
  }

  tables(answer, open) {
    const {separation, witness, axis, certificate} = answer;
    const value = Number(separation?.value);
    const list = facts([
      ['separation', separation && rounded(separation.value)],
      ['', value < 0 ? note('minus the depth of the overlap') : null],
      ['within', separation && rounded(separation.bound)],
      ['certificate', certificate && this.certificateText(certificate)],
      ['axis', axis?.direction && roundedVector(axis.direction)],
      ['', axis?.direction && note(AXIS_KINDS[axis.kind] || '')],
      ...this.pieceRows(answer),
      ...this.tolerantRows(answer),
    ]);
    const more = facts([
      ['point of A', witness && roundedVector(witness.pointA)],
      ['point of B', witness && roundedVector(witness.pointB)],
      ['decided by', RUNGS[answer.rung]],
      ['revisions', `${answer.hullA.revision} and ${answer.hullB.revision}`],
    ]);
    return element(
        'div', {id: 'answer-facts'}, list, details('Witness points, revisions', open, more));
  }

  // Rows for the deciding pieces of bodies.
  pieceRows({pieces}) {
    return this.model.decidingPieces().map(
        (piece, k) => [`piece of ${'AB'[k]}`, piece && `${pieces[k]}: ${piece.hullId}`]);
  }

  // The result with the tolerance: possibly a weaker relation, decided by a cheaper rung.
  tolerantRows({tolerant}) {
    if (!tolerant) return [];
    const {word, sign} = RELATIONS[tolerant.relation];
    return [
      ['tolerance', rounded(tolerant.tolerance)],
      ['relation with it', `${sign} ${word}`],
      ['then decided by', RUNGS[tolerant.rung]],
    ];
  }

  certificateText({direction, integerDirection, pairs}) {
    const count = pairs.length === 1 ? 'a vertex pair' : `${pairs.length} vertex pairs`;
    const parts = [(direction || integerDirection) && 'a direction', pairs.length && count];
    return parts.filter(Boolean).join(' and ');
  }

  toggles() {
    return element(
        'div', {className: 'marks', role: 'group', 'aria-label': 'Parts of the answer to draw'},
        ...Object.entries(MARK_NAMES).map(([key, name]) => {
          const swatch = element('span', {className: 'swatch'});
          swatch.style.background = MARK_COLORS[key];
          return element(
              'label', {}, element('input', {
                type: 'checkbox',
                checked: this.marks.on[key],
                onchange: ({target}) => {
                  this.marks.on[key] = target.checked;
                  this.marks.rebuild();
                },
              }),
              swatch, name);
        }));
  }

  // Shows the query as a shell command with round-trip decimal numbers.
  command(answer, open) {
    const [a, b] = this.model.pair.map((i) => this.model.objects[i]);
    const {poses} = answer;
    const text =
        `hullctl check ${a.hullId} ${b.hullId} --separation --witness --axis --certificate ` +
        `--pose-a ${poseText(poses.slice(0, 7))} --pose-b ${poseText(poses.slice(7))}` +
        [a, b].map(({radius}, k) => radius ? ` --radius-${'ab'[k]} ${radius}` : '').join('');
    return details(
        'Run the same query in a shell', open, element('pre', {tabIndex: 0, id: 'command'}, text));
  }

  updateCollisions() {
    const {model} = this;
    const {pairs, problems, totals} = model.collisions;
    const count = Number(totals.touching || 0) + Number(totals.overlapping || 0) +
        Number(totals.withinTolerance || 0);
    const title = count === 0 ? 'No pair collides' :
        count === 1           ? '1 pair collides' :
                                `${grouped(count)} pairs collide`;
    const rows = pairs.slice(0, MAX_ROWS).map(([a, b, relation]) => {
      const names = `${model.objects[a].name} and ${model.objects[b].name}`;
      return element(
          'li', {},
          button(
              {onclick: () => this.visit(a, b)}, element('span', {className: 'names'}, names),
              tag(RELATIONS[relation])));
    });
    if (count > rows.length)
      rows.push(element('li', {className: 'more'}, `and ${grouped(count - rows.length)} more`));
    this.slider ??= this.live ? this.toleranceSlider() : '';
    this.list.replaceChildren(
        element('h2', {id: 'collision-count'}, title), element('ol', {}, ...rows),
        ...problems.map(quiet), this.slider);
  }

  visit(a, b) {
    this.model.select(b, a);
    this.model.tell('fly', [this.model.objects[a], this.model.objects[b]]);
  }

  // A logarithmic slider from 0 to a tenth of the scene.
  toleranceSlider() {
    const {model} = this;
    const output = element('output', {}, 'exact');
    const oninput = ({target}) => {
      const radius = model.bounds()?.radius || 1;
      const steps = Number(target.value);
      model.tolerance =
          steps === 0 ? 0 : Number((radius * 10 ** ((steps - 60) / 10 - 1)).toPrecision(3));
      output.textContent = steps === 0 ? 'exact' : short(model.tolerance);
      model.tell('tolerance');
    };
    return slider(
        'Tolerance ',
        {min: 0, max: 60, value: 0, id: 'tolerance', 'aria-label': 'Tolerance', oninput}, output);
  }
}
