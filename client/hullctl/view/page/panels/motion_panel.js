// The first contact of the pair during its motion, by the server's answer.
import {RELATIONS} from 'hulld/palette.js';
import {element, facts, rounded} from 'hulld/panels/dom.js';
import {poseText} from 'hulld/pose.js';

const LEGEND = 'The swept shapes are hulls of sampled positions: a picture, not a proof. ' +
    'hulld proves the times.';

export class MotionPanel {
  // goToContact(): shows the time of the first contact.
  constructor(model, live, goToContact) {
    this.model = model;
    this.live = live;
    this.root = document.getElementById('motion');
    this.button = document.getElementById('contact');
    this.button.addEventListener('click', goToContact);
  }

  update() {
    const {model} = this;
    const isOpen = this.root.querySelector('details')?.open;
    this.button.hidden = model.pairMotion?.firstContact?.contactTime === undefined;
    this.root.replaceChildren();
    if (model.time === null) return;
    this.root.append(
        element('h2', {}, 'Motion'), ...this.answer(isOpen),
        element('p', {className: 'quiet'}, LEGEND));
  }

  answer(isOpen) {
    const {model} = this;
    if (!model.pair) return [];
    if (!model.pair.some((index) => model.objects[index].endPose))
      return [element('p', {className: 'quiet'}, 'This pair does not move.')];
    const {pairMotion} = model;
    if (!pairMotion) {
      const text = this.live ? 'Waiting for the answer\u2026' : 'Not recorded in this file.';
      return [element('p', {className: 'quiet'}, text)];
    }
    if (pairMotion.problem) return [element('p', {}, pairMotion.problem)];
    const {word, sign, style} = RELATIONS[pairMotion.relation];
    const {separatedUntil, contactTime} = pairMotion.firstContact;
    const text = contactTime !== undefined ? `${sign} ${word}` :
        separatedUntil === 1 ? `${sign} ${word} throughout` :
                               `${sign} ${word}: nearly in contact`;
    return [
      element('p', {}, element('b', {id: 'motion-relation', className: style}, text)),
      element('div', {id: 'motion-facts'}, facts([
                ['separated until', rounded(separatedUntil)],
                ['first contact', contactTime !== undefined ? rounded(contactTime) : null],
              ])),
      this.command(isOpen),
    ];
  }

  // Shows the query as a shell command with round-trip decimal numbers.
  command(isOpen) {
    const sides = this.model.pair.map((index) => this.model.objects[index]);
    const options = sides.map(({start, pose, endPose, radius}, k) => {
      const side = 'ab'[k];
      return ` --pose-${side} ${poseText(endPose ? start : pose)}` +
          (endPose ? ` --to-${side} ${poseText(endPose)}` : '') +
          (radius ? ` --radius-${side} ${radius}` : '');
    });
    const ids = sides.map(({hullId}) => hullId).join(' ');
    return element(
        'details', {className: 'command', open: Boolean(isOpen)},
        element('summary', {}, 'Run and verify in a shell'),
        element(
            'pre', {tabIndex: 0, id: 'motion-command'},
            `hullctl check ${ids} --verify${options.join('')}`));
  }
}
