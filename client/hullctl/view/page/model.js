// The displayed scene and the user's choices, without drawing. Parts of the page listen to its
// changes.
import {CROWD_COLOR, OBJECT_COLORS} from 'hulld/palette.js';
import {IDENTITY, poseAt, samePose, toWorld} from 'hulld/pose.js';
import {RoundedShape} from 'hulld/rounded_shape.js';
import {boxOf} from 'hulld/shape.js';
import {difference} from 'hulld/vector.js';

// Maximum number of objects drawn individually; more are drawn as a crowd, in few draw calls.
const MAX_SINGLE_OBJECTS = 24;

// Maximum number of objects with labels and colors of their own.
const MAX_NAMED_OBJECTS = 200;

// Maximum number of poses that undo() can restore.
const MAX_UNDONE = 200;

// Bodies with more pairs of pieces than this are queried without a certificate.
const MAX_PIECE_PAIRS = 1000;

// Number of times at which a moving object must be inside the picture.
const PATH_TIMES = [0, 0.25, 0.5, 0.75, 1];

// Shapes with more vertices, and the shapes of a crowd, are represented by their box.
const MAX_CORNERS = 300;

export class Model extends EventTarget {
  constructor() {
    super();
    this.show = {
      points: false,
      mesh: false,
      hull: true,
      edges: true,
      labels: true,
      grid: true,
      sweep: true,
    };
    this.tolerance = 0;
    this.clear();
  }

  clear() {
    this.objects = [];
    this.files = [];
    // Shapes by ID, and by file. Hulls include the pieces of bodies.
    this.hulls = new Map();
    this.bodies = new Map();
    // Hulls of pieces that do not exist.
    this.absent = new Set();
    this.meshes = new Map();
    this.info = new Map();
    this.selected = null;
    this.other = null;
    this.answer = null;
    this.collisions = {pairs: [], problems: [], totals: {}};
    this.relationOf = new Map();
    // The joints of a robot: [{name, low, high, value}], their trajectory, and its waypoints with a
    // colliding pair.
    this.joints = [];
    this.waypoints = [];
    this.contacts = [];
    // The first pair that the file of the scene names; empty if it names none.
    this.named = [];
    // The messages of a recorded watch.
    this.watch = [];
    // The time t of a scene with motions; null in other scenes.
    this.time = null;
    // The last message about the motion of a pair.
    this.motion = null;
    // {index, pose}: poses before each completed drag.
    this.history = [];
    // Drawn coordinates are relative to the origin and in this unit, a power of two near the size
    // of the scene: the GPU's floats would overflow or underflow in the unit of the points.
    this.origin = [0, 0, 0];
    this.unit = 1;
  }

  tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, {detail}));
  }

  on(types, listener) {
    for (const type of types.split(' ')) this.addEventListener(type, (e) => listener(e.detail));
  }

  load({number, files, objects, joints, waypoints, contacts, named, watch}) {
    this.clear();
    Object.assign(this, {number, files, joints, waypoints, contacts, named, watch});
    this.addObjects(objects);
    this.show.mesh = files.length > 0;
    this.time = this.moving.length ? 0 : null;
  }

  addObjects(objects) {
    const many = this.objects.length + objects.length > MAX_NAMED_OBJECTS;
    for (const object of objects) {
      const index = this.objects.length;
      this.objects.push({
        ...object,
        index,
        start: object.pose,
        // True if the object cannot be dragged: it is moved by joints or by the time of the scene,
        // or belongs to a recorded watch.
        isDriven: object.isJointed || Boolean(object.endPose) || this.watch.length > 0,
        // The pose after the last completed drag.
        rested: object.pose,
        opacity: 1,
        visible: true,
        gone: false,
        color: many ? CROWD_COLOR : OBJECT_COLORS[index % OBJECT_COLORS.length],
      });
    }
  }

  // Returns the selected object; undefined if none is selected.
  get object() {
    return this.objects[this.selected];
  }

  get moving() {
    return this.objects.filter(({endPose}) => endPose);
  }

  get isCrowd() {
    return this.objects.length > MAX_SINGLE_OBJECTS;
  }

  // Returns true if there are too many objects for labels and colors of their own.
  get isNameless() {
    return this.objects.length > MAX_NAMED_OBJECTS;
  }

  // Returns the color in which an object is drawn. The two objects of the pair never share one.
  colorOf({index, color}) {
    const {pair} = this;
    const place = pair ? pair.indexOf(index) : -1;
    if (place < 0) return color;
    const [a, b] = pair.map((i) => this.objects[i].color);
    if (a !== b) return color;
    const first = a === CROWD_COLOR ? OBJECT_COLORS[0] : a;
    return place === 0 ? first : OBJECT_COLORS.find((other) => other !== first);
  }

  // Returns the hull, or all pieces of a body; undefined while in flight.
  hullOf(object) {
    return this.hulls.get(object.hullId) ?? this.bodyOf(object)?.shape(this.hulls, this.absent);
  }

  // Returns [{hull, pose, radius}]: the hull of an object, or the pieces of a body that have
  // arrived.
  partsOf(object) {
    const {radius = 0, hullId} = object;
    const pieces = this.bodyOf(object)?.pieces ?? [{hullId, pose: IDENTITY}];
    return pieces.filter((piece) => this.hulls.has(piece.hullId))
        .map((piece) => ({
               hull: this.hulls.get(piece.hullId),
               pose: piece.pose,
               radius: radius + (piece.radius ?? 0),
             }));
  }

  // Returns the surface of an object with a radius; null if it has none, and for a piece of a large
  // scene.
  roundedOf(object) {
    const shape = this.hullOf(object);
    if (!shape || shape.isEmpty || this.isNameless) return null;
    if (object.rounded?.shape !== shape) {
      const parts = this.partsOf(object).filter(({hull}) => !hull.isEmpty);
      const isRounded = parts.some(({radius}) => radius > 0);
      const made = isRounded ? new RoundedShape(parts, shape.center, this.objects.length) : null;
      object.rounded = {shape, made};
    }
    return object.rounded.made;
  }

  bodyOf(object) {
    return this.bodies.get(object.hullId);
  }

  // Sets the hull of an ID; null if it does not exist.
  setHull(id, hull) {
    if (hull) {
      this.hulls.set(id, hull);
      this.bodies.delete(id);
      this.absent.delete(id);
    } else {
      this.hulls.delete(id);
      this.absent.add(id);
    }
    for (const body of this.bodiesWith(id)) body.pieceChanged();
  }

  setBody(id, body) {
    this.bodies.set(id, body);
    this.hulls.delete(id);
  }

  bodiesWith(id) {
    return [...this.bodies.values()].filter(({hullIds}) => hullIds.has(id));
  }

  // Returns the known revision of a hull or a body.
  revisionOf(id) {
    return (this.hulls.get(id) ?? this.bodies.get(id))?.revision;
  }

  // Returns the deciding pieces of the pair's objects: null for a hull, or if no single piece
  // decided.
  decidingPieces() {
    const {answer, pair} = this;
    return [0, 1].map((k) => {
      const body = pair && this.bodyOf(this.objects[pair[k]]);
      return body?.pieces[answer?.pieces?.[k] ?? -1] ?? null;
    });
  }

  // Returns a point of an object in the world; `piece` is the piece that is its frame, or null.
  placed(object, piece, p) {
    return toWorld(object.pose, piece ? toWorld(piece.pose, p) : p);
  }

  meshOf(object) {
    return this.meshes.get(object.file);
  }

  shapeOf(object) {
    return this.hullOf(object) || this.meshOf(object);
  }

  isShown(object) {
    return object.visible && !object.gone;
  }

  setVisible(objects, visible) {
    for (const object of objects) object.visible = visible;
    this.tell('visibility');
  }

  // Returns the center of an object's box in the world, in double.
  centerOf(object) {
    const shape = this.shapeOf(object);
    return toWorld(object.pose, shape ? shape.center : [0, 0, 0]);
  }

  radiusOf(object) {
    return (this.roundedOf(object) ?? this.shapeOf(object))?.radius || 0;
  }

  // Returns world points that enclose an object at a pose: its vertices if few, otherwise the
  // corners of its box.
  cornersOf(object, pose = object.pose) {
    const {xyz, vertexCount} = this.shapeOf(object);
    if (vertexCount > MAX_CORNERS || this.isCrowd || this.roundedOf(object))
      return this.boxCornersOf(object, pose);
    return Array.from(
        {length: vertexCount}, (_, i) => toWorld(pose, xyz.subarray(3 * i, 3 * i + 3)));
  }

  boxCornersOf(object, pose) {
    const {low, high} = this.roundedOf(object) ?? this.shapeOf(object);
    const corners = [];
    for (let i = 0; i < 8; ++i) {
      corners.push(toWorld(pose, [0, 1, 2].map((k) => (i >> k & 1 ? high[k] : low[k]))));
    }
    return corners;
  }

  // Returns some poses on the way of a moving object.
  posesOnPath({start, endPose}) {
    return PATH_TIMES.map((t) => poseAt(start, endPose, t));
  }

  // Sets the origin and the unit of drawn coordinates.
  drawAround({center, radius}) {
    this.origin = center.slice();
    this.unit = 2 ** Math.min(1023, Math.floor(Math.log2(radius)));
  }

  // Returns the difference of two points in the unit of drawn coordinates.
  drawn(p, base = this.origin) {
    return difference(p, base).map((value) => value / this.unit);
  }

  // Returns {center, radius, corners}: a sphere around all shown objects and their motions, and its
  // input points; null if none is shown. `now`: without the motions.
  bounds(objects = this.objects, now = false) {
    const posesOf = (object) => now || !object.endPose ? [object.pose] : this.posesOnPath(object);
    const corners =
        objects.filter((object) => this.isShown(object) && this.shapeOf(object)?.isEmpty === false)
            .flatMap((object) => posesOf(object).flatMap((pose) => this.cornersOf(object, pose)));
    if (!corners.length) return null;
    const {low, high, center} = boxOf(corners.flat());
    const radius = Math.hypot(...difference(high, center));
    return {center, radius: Math.min(radius, Number.MAX_VALUE) || 1, corners};
  }

  select(index, other = undefined) {
    if (index === this.selected && (other === undefined || other === this.other)) return;
    const before = this.selected;
    this.selected = index;
    if (index === null) {
      this.other = null;
    } else if (other !== undefined) {
      this.other = other;
    } else if (before !== null && before !== index && this.other === index) {
      this.other = before;
    } else if (this.other === null || this.other === index) {
      this.other = this.nearestTo(index);
    }
    this.answer = null;
    this.tell('selection');
  }

  // Returns the other object with the nearest bounding sphere; null if none exists.
  nearestTo(index) {
    const object = this.objects[index];
    const center = this.centerOf(object);
    let nearest = null;
    let least = Infinity;
    for (const candidate of this.objects) {
      if (candidate === object || !candidate.hullId || candidate.gone) continue;
      const gap =
          Math.hypot(...difference(this.centerOf(candidate), center)) - this.radiusOf(candidate);
      if (gap < least) [nearest, least] = [candidate.index, gap];
    }
    return nearest;
  }

  // Returns the queried pair, lower index first; null if none.
  get pair() {
    if (this.selected === null || this.other === null) return null;
    const pair = [this.selected, this.other].sort((a, b) => a - b);
    return pair.every((i) => this.objects[i].hullId) ? pair : null;
  }

  // Returns the message about the motion of the pair; null if none has arrived.
  get pairMotion() {
    const {motion, pair} = this;
    const isOfPair = motion && pair && motion.pair.every((index, k) => index === pair[k]);
    return isOfPair ? motion : null;
  }

  // Returns true if the pair's certificate is requested. For large bodies, it would contain one for
  // each of very many pairs of pieces.
  wantsCertificate(rest) {
    const counts = (this.pair || []).map((i) => this.bodyOf(this.objects[i])?.pieces.length ?? 0);
    const isPlain = counts.every((count) => count === 0);
    return isPlain || (rest && Math.max(1, counts[0]) * Math.max(1, counts[1]) <= MAX_PIECE_PAIRS);
  }

  // `rest`: true if the motion has ended.
  setPose(index, pose, rest) {
    const object = this.objects[index];
    if (samePose(object.pose, pose) && !rest) return;
    object.pose = pose;
    if (rest && !samePose(object.rested, pose)) {
      this.history.push({index, pose: object.rested});
      if (this.history.length > MAX_UNDONE) this.history.shift();
      object.rested = pose;
    }
    this.tell('pose', {indices: [index], rest});
  }

  // Moves all moving objects to their poses at time t.
  setTime(t, rest) {
    this.time = t;
    const {moving} = this;
    for (const object of moving) object.pose = poseAt(object.start, object.endPose, t);
    this.tell('pose', {indices: moving.map(({index}) => index), rest});
  }

  // Sets the poses of all objects that joints move.
  setJointedPoses(poses, rest) {
    const jointed = this.objects.filter(({isJointed}) => isJointed);
    jointed.forEach((object, i) => {
      object.pose = poses.slice(7 * i, 7 * i + 7);
    });
    this.tell('pose', {indices: jointed.map(({index}) => index), rest});
  }

  // Restores the pose before the last completed motion, of any object.
  undo() {
    const last = this.history.pop();
    if (!last) return;
    if (last.index !== this.selected && last.index !== this.other) this.select(last.index);
    this.objects[last.index].rested = last.pose;
    this.setPose(last.index, last.pose, true);
  }

  setCollisions(collisions) {
    const before = this.relationOf;
    this.collisions = collisions;
    this.relationOf = new Map();
    for (const [a, b, relation] of collisions.pairs) {
      for (const index of [a, b]) {
        if (this.relationOf.get(index) !== 'RELATION_OVERLAPPING') {
          this.relationOf.set(index, relation);
        }
      }
    }
    const changed = new Set();
    for (const index of [...before.keys(), ...this.relationOf.keys()]) {
      if (before.get(index) !== this.relationOf.get(index)) changed.add(index);
    }
    this.tell('collisions', changed);
  }
}
