// A time line under the picture, for the trajectory of a robot: the configuration between two
// waypoints is interpolated linearly in each joint.

// Time from one waypoint to the next while playing, within limits for the whole.
const WAYPOINT_MS = 600;
const LEAST_MS = 3000;
const MOST_MS = 30000;
// Steps of the slider between two waypoints.
const STEPS = 16;

export class TimeLine {
  // move(values, rest, waypoint): as Viewer.moveJoints. A recording has the waypoints alone.
  constructor(model, live, move) {
    this.model = model;
    this.steps = live ? STEPS : 1;
    this.move = move;
    [this.root, this.button, this.slider, this.text, this.marks] = [
      'time', 'play', 'moment', 'moment-text', 'contacts'
    ].map((id) => document.getElementById(id));
    this.slider.addEventListener('input', () => this.dragTo(false));
    this.slider.addEventListener('change', () => this.dragTo(true));
    this.button.addEventListener('click', () => this.play());
  }

  get last() {
    return this.model.waypoints.length - 1;
  }

  // Called when the scene changes.
  rebuild() {
    this.stop();
    this.root.hidden = this.last < 1;
    if (this.root.hidden) return;
    this.slider.max = this.last;
    this.slider.step = 1 / this.steps;
    this.slider.value = 0;
    this.showText(0);
    this.marks.replaceChildren(...this.runs().map(([first, end]) => {
      const mark = document.createElement('span');
      mark.style.left = `${100 * first / this.last}%`;
      mark.style.width = `${100 * (end - first) / this.last}%`;
      return mark;
    }));
  }

  // Merges the waypoints in contact into runs [first, last].
  runs() {
    const runs = [];
    for (const contact of this.model.contacts) {
      const run = runs[runs.length - 1];
      if (run && run[1] === contact - 1)
        run[1] = contact;
      else
        runs.push([contact, contact]);
    }
    return runs;
  }

  dragTo(rest) {
    this.stop();
    this.show(Number(this.slider.value), rest);
  }

  // Shows a moment, in waypoints from 0.
  show(moment, rest) {
    const {waypoints} = this.model;
    const before = Math.floor(moment);
    const after = Math.min(before + 1, this.last);
    const part = moment - before;
    const values = waypoints[before].map(
        (value, j) => (part === 0 ? value : (1 - part) * value + part * waypoints[after][j]));
    this.showText(moment);
    this.move(values, rest, part === 0 ? before : null);
  }

  showText(moment) {
    const count = this.last + 1;
    this.text.textContent = `${Number((moment + 1).toFixed(2))} of ${count}`;
  }

  // Starts to play, from the beginning if at the end; or stops.
  play() {
    if (this.root.hidden) return;
    if (this.playing) {
      this.stop();
      this.show(Number(this.slider.value), true);
      return;
    }
    if (Number(this.slider.value) === this.last) this.slider.value = 0;
    const length = Math.min(Math.max(WAYPOINT_MS * this.last, LEAST_MS), MOST_MS);
    const start = performance.now() - length * Number(this.slider.value) / this.last;
    const tick = (now) => {
      if (this.playing !== tick) return;
      const moment = Math.min(this.last, Math.max(0, (now - start) / length * this.last));
      const shown = Math.round(moment * this.steps) / this.steps;
      const isOver = shown === this.last;
      if (shown !== Number(this.slider.value) || isOver) {
        this.slider.value = shown;
        this.show(shown, isOver || this.steps === 1);
      }
      if (isOver)
        this.stop();
      else
        requestAnimationFrame(tick);
    };
    this.playing = tick;
    this.showButton();
    requestAnimationFrame(tick);
  }

  stop() {
    this.playing = null;
    this.showButton();
  }

  showButton() {
    this.button.textContent = this.playing ? 'Stop' : 'Play';
    this.button.setAttribute('aria-pressed', String(Boolean(this.playing)));
  }
}
