// The motions of a scene, over the time t in [0, 1]: the timeline, the swept hulls, and the first
// contact of the pair.
import {SweepView} from 'hulld/drawing/sweep_view.js';
import {MotionPanel} from 'hulld/panels/motion_panel.js';

const PLAY_MS = 4000;
// Steps of the slider: the recorded times, as in client/hullctl/view/recording.h.
const STEPS = 64;

export class Motion {
  constructor(model, stage, connection, timeLine) {
    this.model = model;
    this.connection = connection;
    this.timeLine = timeLine;
    this.sweeps = new SweepView(model, stage);
    this.panel = new MotionPanel(model, connection.live, () => this.goToContact());
    model.on('selection', () => this.update());
    model.on('visibility color shown', () => this.sweeps.rebuild());
  }

  // Called when the scene changes.
  rebuild() {
    this.sweeps.forget();
    document.getElementById('sweep-choice').hidden = this.model.time === null;
    this.update();
  }

  // Returns the track of the timeline; null if nothing moves.
  track() {
    const {model} = this;
    if (model.time === null) return null;
    return {
      last: 1,
      steps: STEPS,
      length: PLAY_MS,
      marks: () => {
        const time = this.contactTime;
        return time === undefined ? [] : [[time, time]];
      },
      text: (t) => `t = ${Number(t.toFixed(4))}`,
      show: (t, rest) => model.setTime(t, rest || !this.connection.live),
    };
  }

  // Returns the time of the first contact of the pair; undefined if none is known.
  get contactTime() {
    return this.model.pairMotion?.firstContact?.contactTime;
  }

  goToContact() {
    if (this.contactTime !== undefined) this.timeLine.jumpTo(this.contactTime);
  }

  arrived(message) {
    this.model.motion = message;
    this.update();
  }

  // Called when the pair or its first contact changes.
  update() {
    if (this.timeLine.track) this.timeLine.updateMarks();
    this.panel.update();
    this.sweeps.rebuild();
  }
}
