// A timeline under the picture: a slider with marks, and a button that plays it. A track defines
// what the timeline shows.

// Merges ascending moments into runs [first, last].
export function runsOf(moments) {
  const runs = [];
  for (const moment of moments) {
    const run = runs[runs.length - 1];
    if (run && run[1] === moment - 1)
      run[1] = moment;
    else
      runs.push([moment, moment]);
  }
  return runs;
}

// Returns the time in ms to play a track of `count` moments of `each` ms, within limits.
export const playTime = (count, each) => Math.min(Math.max(count * each, 3000), 30000);

export class TimeLine {
  constructor() {
    [this.root, this.button, this.slider, this.text, this.marks] = [
      'time', 'play', 'moment', 'moment-text', 'contacts'
    ].map((id) => document.getElementById(id));
    this.slider.addEventListener('input', () => this.dragTo(false));
    this.slider.addEventListener('change', () => this.dragTo(true));
    this.button.addEventListener('click', () => this.play());
  }

  // Called when the scene changes. track: null for none, or {last, steps, length, marks(),
  // text(moment), show(moment, rest)}: the last moment, from 0; the steps of the slider from one
  // moment to the next; the time to play it all, in ms; the first and last moments of each mark;
  // and the functions that name a moment and show it, `rest` if nothing moves after it.
  load(track) {
    this.track = track;
    this.stop();
    this.root.hidden = !track;
    if (!track) return;
    this.slider.max = track.last;
    this.slider.step = 1 / track.steps;
    this.slider.value = 0;
    this.text.textContent = track.text(0);
    this.updateMarks();
  }

  updateMarks() {
    const {last, marks} = this.track;
    this.marks.replaceChildren(...marks().map(([first, end]) => {
      const mark = document.createElement('span');
      mark.style.left = `${100 * first / last}%`;
      mark.style.width = `${100 * (end - first) / last}%`;
      return mark;
    }));
  }

  dragTo(rest) {
    this.stop();
    this.show(Number(this.slider.value), rest);
  }

  // Stops at a moment, which may lie between two steps.
  jumpTo(moment) {
    this.stop();
    this.slider.value = moment;
    this.show(moment, true);
  }

  show(moment, rest) {
    this.text.textContent = this.track.text(moment);
    this.track.show(moment, rest);
  }

  // Starts to play, from the beginning if at the end; or stops.
  play() {
    if (this.root.hidden) return;
    if (this.playing) {
      this.stop();
      this.show(Number(this.slider.value), true);
      return;
    }
    const {last, steps, length} = this.track;
    if (Number(this.slider.value) === last) this.slider.value = 0;
    const start = performance.now() - length * Number(this.slider.value) / last;
    const tick = (now) => {
      if (this.playing !== tick) return;
      const moment = Math.min(last, Math.max(0, (now - start) / length * last));
      const shown = Math.round(moment * steps) / steps;
      const isOver = shown === last;
      if (shown !== Number(this.slider.value) || isOver) {
        this.slider.value = shown;
        this.show(shown, isOver);
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
