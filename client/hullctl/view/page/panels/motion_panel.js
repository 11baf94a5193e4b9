// The first contact of the pair during its motion: the server's answer, and the check of its
// certificate.
import {RELATIONS} from 'hulld/palette.js';
import {details, element, facts, missingAnswer, quiet, rounded} from 'hulld/panels/dom.js';
import {ProofLine} from 'hulld/panels/proof_line.js';
import {poseText} from 'hulld/pose.js';
import {bodiesMotionProblem, motionProblem} from 'hulld/proof/motion_certificate.js';

const LEGEND = 'The swept shapes are hulls of sampled positions: an illustration, not a proof. ' +
    'The certificate proves the times.';
// Coefficients of the polynomial of a vertex.
const STEPS_PER_INTERVAL = 5;

export class MotionPanel {
  // goToContact(): shows the time of the first contact.
  constructor(model, live, goToContact) {
    this.model = model;
    this.live = live;
    this.root = document.getElementById('motion');
    this.button = document.getElementById('contact');
    this.button.addEventListener('click', goToContact);
    this.proofLine = new ProofLine('motion-proof');
  }

  update() {
    const {model} = this;
    const isOpen = this.root.querySelector('details')?.open;
    this.button.hidden = model.pairMotion?.firstContact?.contactTime === undefined;
    this.root.replaceChildren();
    if (model.time === null) return;
    this.root.append(element('h2', {}, 'Motion'), ...this.answer(isOpen), quiet(LEGEND));
  }

  answer(isOpen) {
    const {model} = this;
    if (!model.pair) return [];
    if (!model.pair.some((index) => model.objects[index].endPose))
      return [quiet('This pair does not move.')];
    const {pairMotion} = model;
    if (!pairMotion) return [quiet(missingAnswer(this.live))];
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
      this.proof(pairMotion),
      this.command(isOpen),
    ];
  }

  // The result of checking the certificate in this page.
  proof(motion) {
    const {relation, firstContact, certificate, pieceCertificates} = motion;
    const isBodies = pieceCertificates.length > 0;
    if (relation === 'RELATION_WITHIN_TOLERANCE' ||
        !(isBodies || firstContact.intervals.length || certificate))
      return element('p', {id: 'motion-proof'});
    const sides = this.model.pair.map((index, k) => this.movingPieces(motion, index, k));
    const parts = sides.flat();
    const vertices = parts.reduce((total, {xyz}) => total + xyz?.length / 3, 0);
    const intervals =
        (isBodies ? pieceCertificates : [firstContact]).map(({intervals}) => intervals.length);
    // A file repeats the message at each time, with the same first contact.
    return this.proofLine.show(firstContact, parts, {
      steps: STEPS_PER_INTERVAL * vertices * Math.max(1, ...intervals),
      proven: 'Times proven by exact arithmetic in this page',
      check: () => isBodies ?
          bodiesMotionProblem(relation, firstContact, pieceCertificates, ...sides) :
          motionProblem(relation, firstContact, certificate, ...parts),
    });
  }

  // Returns the pieces of the object at place k of the pair, or a text with the reason why the page
  // cannot check its motion.
  movingPieces({hulls, poses}, index, k) {
    const {model} = this;
    const object = model.objects[index];
    const {hullId, endPose, radius = 0} = object;
    const start = endPose ? object.start : object.pose;
    if (!start.every((value, i) => value === poses[7 * k + i]))
      return `${object.name} has moved since the answer`;
    const pieces = model.bodyOf(object)?.pieces ?? [{hullId}];
    const revisions = new Map(hulls.map((version) => [version.hullId, version.revision]));
    // An inline shape has no version, and never changes.
    const isStale = (id) => revisions.has(id) && revisions.get(id) !== model.revisionOf(id);
    if (isStale(hullId) || pieces.some((piece) => isStale(piece.hullId)))
      return `${object.name} has changed since the answer`;
    const missing = pieces.find((piece) => !model.hulls.has(piece.hullId));
    if (missing) return `the vertices of ${missing.hullId} are not available`;
    return pieces.map(({hullId, pose = null, radius: ofPiece = 0}) => ({
                        xyz: model.hulls.get(hullId).xyz,
                        poses: pose ? [start, pose] : [start],
                        end: endPose ?? start,
                        radii: [radius, ofPiece],
                      }));
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
    const text = `hullctl check ${ids} --verify${options.join('')}`;
    return details(
        'Run and verify in a shell', isOpen,
        element('pre', {tabIndex: 0, id: 'motion-command'}, text));
  }
}
