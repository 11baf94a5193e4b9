// The joints of a robot, and the timeline of its trajectory: the configuration between two
// waypoints is interpolated linearly in each joint.
import {JointPanel} from 'hulld/panels/joint_panel.js';
import {playTime, runsOf} from 'hulld/panels/time_line.js';

// Time from one waypoint to the next while playing.
const WAYPOINT_MS = 600;
// Steps of the slider between two waypoints. A recording has only the waypoints.
const STEPS = 16;

export class Joints {
  constructor(model, connection) {
    this.model = model;
    this.connection = connection;
    this.panel = new JointPanel(model, connection.live, (values, rest) => this.move(values, rest));
  }

  // Called when the scene changes.
  rebuild() {
    this.inFlight = null;
    this.wish = null;
    this.panel.rebuild();
  }

  // Returns the track of the timeline; null if there is no trajectory.
  track() {
    const {waypoints, contacts} = this.model;
    const last = waypoints.length - 1;
    if (last < 1) return null;
    return {
      last,
      steps: this.connection.live ? STEPS : 1,
      length: playTime(last, WAYPOINT_MS),
      marks: () => runsOf(contacts),
      text: (moment) => `${Number((moment + 1).toFixed(2))} of ${last + 1}`,
      show: (moment, rest) => {
        const before = Math.floor(moment);
        const after = Math.min(before + 1, last);
        const part = moment - before;
        const values = waypoints[before].map(
            (value, j) => (part === 0 ? value : (1 - part) * value + part * waypoints[after][j]));
        this.move(values, rest || !this.connection.live, part === 0 ? before : null);
        this.panel.update();
      },
    };
  }

  // Moves the joints. The latest values win while an answer is in flight. waypoint: the index of
  // the waypoint with these values, or null.
  move(values, rest, waypoint = null) {
    values.forEach((value, i) => this.model.joints[i].value = value);
    this.wish = {values: values.slice(), rest, waypoint};
    if (!this.inFlight) this.send();
  }

  send() {
    this.inFlight = this.wish;
    this.wish = null;
    const {values, waypoint} = this.inFlight;
    this.connection.send({type: 'joints', scene: this.model.number, values, waypoint});
  }

  // Applies the poses that answer the values in flight.
  arrived(poses) {
    const {rest} = this.inFlight;
    this.inFlight = null;
    if (this.wish) this.send();
    this.model.setJointedPoses(poses, rest);
  }

  // Called if there is no answer.
  failed() {
    this.inFlight = null;
  }
}
