// Sliders for the joints of a robot.
import {element, quiet, short, slider} from 'hulld/panels/dom.js';

// Poses of other joint values need hullctl.
const RECORDED = 'Recorded. To move the joints, run hullctl view without --html.';

export class JointPanel {
  // move(values, rest): moves the joints; rest: the slider was released.
  constructor(model, live, move) {
    this.model = model;
    this.live = live;
    this.move = move;
    this.root = document.getElementById('joints');
  }

  // Called when the scene changes.
  rebuild() {
    this.sliders = this.model.joints.map((joint) => this.slider(joint));
    const parts = [element('h2', {}, 'Joints'), ...this.sliders.map(({block}) => block)];
    if (!this.live) parts.push(quiet(RECORDED));
    this.root.replaceChildren(...(this.sliders.length ? parts : []));
  }

  slider(joint) {
    const output = element('output', {className: 'number'});
    const send = (rest) => {
      joint.value = Number(input.value);
      this.move(this.model.joints.map(({value}) => value), rest);
      this.update();
    };
    const block = slider(
        `${joint.name} `, {
          min: joint.low,
          max: joint.high,
          step: (joint.high - joint.low) / 1000 || 1,
          disabled: !this.live,
          'aria-label': `Joint ${joint.name}`,
          oninput: () => send(false),
          onchange: () => send(true),
        },
        output);
    const input = block.querySelector('input');
    const update = () => {
      input.value = joint.value;
      output.textContent = short(joint.value);
      output.title = String(joint.value);
    };
    update();
    return {block, update};
  }

  // Called when the joints move by other means.
  update() {
    for (const {update} of this.sliders) update();
  }
}
