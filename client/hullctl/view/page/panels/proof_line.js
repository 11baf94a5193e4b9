// The result of checking a certificate in this page.
import {button, element, grouped} from 'hulld/panels/dom.js';

// Checks of more steps than this run on demand: a million take seconds.
const MAX_STEPS = 20000;

export class ProofLine {
  constructor(id) {
    this.id = id;
  }

  // Returns the line of an answer. parts: the placed hulls that its certificate concerns, or texts
  // with the reason why the page cannot check it; steps: the cost of the check, about one per
  // vertex; proven: the text of success; check(): returns the missing proof, or an empty text.
  show(answer, parts, {steps, proven, check}) {
    const line = element('p', {id: this.id, className: 'quiet'});
    const reason = parts.find((part) => typeof part === 'string');
    if (reason) {
      line.textContent = `Certificate not checked: ${reason}`;
      return line;
    }
    // Changes of other hulls show the same answer again.
    const {known} = this;
    if (known?.answer === answer && parts.length === known.parts.length &&
        parts.every(({xyz}, k) => xyz === known.parts[k].xyz))
      return known.line;
    this.known = {answer, parts, line};
    const run = () => {
      const problem = check();
      line.className = problem ? 'refuted' : 'proven';
      line.textContent =
          problem ? `\u2717 Certificate refuted here: ${problem}` : `\u2713 ${proven}`;
    };
    if (steps <= MAX_STEPS) {
      run();
    } else {
      const text = `Check the certificate here (${grouped(steps)} steps)`;
      line.append(button({onclick: run}, text));
    }
    return line;
  }
}
