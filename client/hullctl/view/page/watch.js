// A recorded watch: the colliding pairs, or the existing hulls, at each moment.
import {playTime, runsOf} from 'hulld/panels/time_line.js';

// Time that a moment takes while playing.
const MOMENT_MS = 400;

const COLLIDING = ['RELATION_TOUCHING', 'RELATION_OVERLAPPING'];

// Merges the messages of the initial state into one moment; every later message with events is a
// moment of its own.
function momentsOf(messages) {
  const moments = [];
  let isInitial = true;
  for (const {header, events, synced, restarted} of messages) {
    if (moments.length && (isInitial || !events.length)) {
      moments[moments.length - 1].events.push(...events);
      moments[moments.length - 1].revision = header.revision;
    } else {
      moments.push({revision: header.revision, events: [...events], restarted});
    }
    isInitial &&= !synced;
  }
  return moments;
}

// Applies events to the colliding pairs, by "a b".
function applyTo(pairs, events) {
  for (const {placementA, placementB, relation} of events) {
    const [a, b] = [placementA, placementB].sort((one, other) => one - other);
    if (COLLIDING.includes(relation))
      pairs.set(`${a} ${b}`, [a, b, relation]);
    else
      pairs.delete(`${a} ${b}`);
  }
}

export class Watch {
  constructor(model) {
    this.model = model;
    this.moments = [];
  }

  // Called when the scene changes.
  rebuild() {
    const {watch} = this.model;
    this.moments = momentsOf(watch);
    // A watch of a scene, rather than of hulls.
    this.isOfPairs = watch.some(({update}) => update !== undefined);
    const pairs = new Map();
    this.contacts = [];
    if (!this.isOfPairs) return;
    this.moments.forEach(({events}, i) => {
      applyTo(pairs, events);
      if (pairs.size) this.contacts.push(i);
    });
  }

  // True if the recording determines which hulls exist.
  get ownsHulls() {
    return this.moments.length > 0 && !this.isOfPairs;
  }

  // Returns the track of the timeline; null if nothing changes.
  track() {
    const last = this.moments.length - 1;
    if (last < 1) return null;
    return {
      last,
      steps: 1,
      length: playTime(last, MOMENT_MS),
      marks: () => runsOf(this.contacts),
      text: (moment) => `revision ${this.moments[moment].revision}`,
      show: (moment) => this.show(moment),
    };
  }

  show(moment) {
    if (this.isOfPairs)
      this.showPairs(moment);
    else if (this.moments.length)
      this.showHulls(moment);
  }

  showPairs(moment) {
    const pairs = new Map();
    for (const {events} of this.moments.slice(0, moment + 1)) applyTo(pairs, events);
    const rows = [...pairs.values()];
    const count = (relation) => rows.filter((row) => row[2] === relation).length;
    const [touching, overlapping] = COLLIDING.map(count);
    this.model.setCollisions({pairs: rows, problems: [], totals: {touching, overlapping}});
  }

  // Shows the hulls and bodies that existed, with their sizes at that time.
  showHulls(moment) {
    const {model} = this;
    const hulls = new Map();
    for (const {events, restarted} of this.moments.slice(0, moment + 1)) {
      if (restarted) hulls.clear();
      for (const {kind, hull} of events) {
        if (kind === 'HULL_EVENT_KIND_DELETED')
          hulls.delete(hull.hullId);
        else
          hulls.set(hull.hullId, hull);
      }
    }
    for (const object of model.objects) {
      object.gone = !hulls.has(object.hullId);
      model.info.set(object.hullId, hulls.get(object.hullId));
    }
    model.tell('visibility');
  }
}
