// Connects the page: messages change the model, the model notifies the parts, the parts draw.
import {connect} from 'hulld/connection.js';
import {Controls} from 'hulld/controls.js';
import {Crowd} from 'hulld/drawing/crowd.js';
import {Gizmo} from 'hulld/drawing/gizmo.js';
import {Ground} from 'hulld/drawing/ground.js';
import {Labels} from 'hulld/drawing/labels.js';
import {Marks} from 'hulld/drawing/marks.js';
import {ObjectView} from 'hulld/drawing/object_view.js';
import {keepPicture} from 'hulld/drawing/picture.js';
import {Ruler} from 'hulld/drawing/ruler.js';
import {ShellView} from 'hulld/drawing/shell_view.js';
import {Stage} from 'hulld/drawing/stage.js';
import {Joints} from 'hulld/joints.js';
import {Model} from 'hulld/model.js';
import {Motion} from 'hulld/motion.js';
import {AnswerPanel} from 'hulld/panels/answer_panel.js';
import {element, grouped} from 'hulld/panels/dom.js';
import {ObjectPanel} from 'hulld/panels/object_panel.js';
import {TimeLine} from 'hulld/panels/time_line.js';
import {Tree} from 'hulld/panels/tree.js';
import {Body, HullShape, MeshShape, newVertices} from 'hulld/shape.js';
import {Watch} from 'hulld/watch.js';

const $ = (id) => document.getElementById(id);
// Compares revisions, 64-bit numbers as text; an absent one is the oldest.
const isNewer = (a, b) => BigInt(a || 0) > BigInt(b || 0);

class Viewer {
  constructor() {
    this.model = new Model();
    this.stage = new Stage($('canvas'), this.model);
    this.setTheme(matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light');
    this.marks = new Marks(this.model, this.stage);
    this.shell = new ShellView(this.model, this.stage);
    this.labels = new Labels(this.model, this.stage);
    this.ground = new Ground(this.model, this.stage);
    this.ruler = new Ruler(this.model, this.stage);
    this.tree = new Tree(this.model);
    this.gizmo = new Gizmo(this.model, this.stage);
    this.views = new Map();
    this.crowd = null;
    this.update = 0;
    this.moved = new Set();
    // Requested hulls that have not arrived yet.
    this.awaited = new Set();
    // The previous shapes of objects whose new vertices will flash, by index.
    this.former = new Map();
    // Work that runs before the next frame, by name.
    this.waiting = new Map();
    this.connection = connect({
      hello: (message) => this.hello(message),
      scene: (message) => this.scene(message),
      objects: (message) => this.moreObjects(message),
      hull: (message) => this.hullChanged(message.event),
      answer: (message) => this.answer(message),
      motion: (message) => this.isCurrent(message) && this.motion.arrived(message),
      collisions: (message) => this.collisions(message),
      poses: (message) => this.posesCame(message),
      problem: (message) => {
        this.joints.failed();
        this.say(message.message);
      },
      frame: (frame) => this.frame(frame),
      lost: () => this.lost(),
    });
    this.answerPanel = new AnswerPanel(this.model, this.marks, this.connection.live);
    this.objectPanel =
        new ObjectPanel(this.model, this.connection.live, (...wish) => this.simplify(...wish));
    this.timeLine = new TimeLine();
    this.joints = new Joints(this.model, this.connection);
    this.watch = new Watch(this.model);
    this.listen();
    this.motion = new Motion(this.model, this.stage, this.connection, this.timeLine);
    this.controls = new Controls(this);
    this.stage.beforeFrame(
        (now) => [...this.views.values()].reduce((any, view) => view.fade(now) || any, false));
    if (document.body.classList.contains('picture')) keepPicture(this.stage);
    document.body.dataset.ready = 'yes';
  }

  // Subscribes to changes of the model.
  listen() {
    const {model} = this;
    model.on('selection', () => {
      this.mayChoosePair = false;
      this.shell.clear();
      this.rebuildObjects();
      this.answerPanel.rebuild();
      this.objectPanel.rebuild();
      this.controls.updateTools();
      this.ask(true);
    });
    model.on('pose', ({indices, rest}) => {
      for (const index of indices) {
        this.views.get(index)?.place();
        this.crowd?.write(model.objects[index]);
        this.moved.add(index);
      }
      if (this.ruler.ends.length) this.ruler.rebuild();
      this.gizmo.update();
      this.shell.place();
      this.objectPanel.updatePose();
      this.controls.updateTools();
      this.stage.draw(!rest);
      this.ask(rest);
    });
    $('canvas').addEventListener(
        'webglcontextlost',
        () => this.say(
            'The browser has stopped drawing. If the picture does not return, reload the page.'));
    model.on('visibility shown', () => this.rebuildGround());
    model.on('visibility', () => {
      this.objectPanel.rebuild();
      this.updateStatus();
    });
    model.on('visibility color shown', () => this.rebuildObjects());
    model.on('collisions', (changed) => {
      this.answerPanel.updateCollisions();
      if (this.mayChoosePair) this.chooseCollidingPair();
      if (!changed.size) return;
      if (model.isCrowd) this.crowd?.recolor();
      for (const index of changed) this.views.get(index)?.rebuild();
      this.tree.rebuild();
      this.labels.rebuild();
      this.stage.draw();
    });
    model.on('tolerance', () => {
      this.shell.showTolerance();
      this.ask(true);
    });
    model.on('fly', (objects) => {
      const bounds = model.bounds(objects);
      if (!bounds) return;
      this.stage.flyTo(bounds);
      this.stage.isFitted = false;
    });
  }

  // --- Messages ---

  hello({server, version, up, scenes}) {
    this.server = server;
    this.stage.setUp(up);
    this.gizmo.handles.camera = this.stage.camera;
    const choice = $('scene-choice');
    choice.hidden = scenes.length < 2;
    const ordered = scenes.slice().sort((a, b) => a.key.localeCompare(b.key));
    choice.replaceChildren(
        ...ordered.map(({key, title}) => element('option', {value: key}, `${key}  ${title}`)));
    $('status').dataset.live = this.connection.live ? 'yes' : 'no';
    $('status').title = this.connection.live ? `hulld ${version} at ${server}` :
                                               'A recording: its content does not change';
    this.scenes = scenes.map(({key}) => key);
  }

  scene(message) {
    const {model} = this;
    model.load(message);
    $('scene-choice').value = message.key;
    $('title').textContent = message.title;
    $('note').textContent = message.note;
    document.title = `${message.title} \u2013 hulld`;
    document.body.dataset.scene = message.key;
    this.moved = new Set(model.objects.map(({index}) => index));
    this.awaited.clear();
    this.former.clear();
    this.fitted = false;
    this.ruler.forget();
    // Answers to earlier queries concern another scene.
    this.firstUpdate = this.connection.live ? this.update + 1 : 0;
    this.clearViews();
    this.shell.clear();
    this.controls.syncShown();
    this.joints.rebuild();
    this.motion.rebuild();
    this.watch.rebuild();
    this.timeLine.load(this.watch.track() ?? this.joints.track() ?? this.motion.track());
    model.tell('selection');
    this.mayChoosePair = true;
    this.answerPanel.updateCollisions();
    if (this.watch.isOfPairs) this.watch.show(0);
    this.connection.send({type: 'geometry', files: model.files.map((_, i) => i), hullIds: []});
    this.fetchHulls(new Set(model.objects.map(({hullId}) => hullId).filter(Boolean)));
    this.updateStatus();
  }

  moreObjects({scene, objects}) {
    const {model} = this;
    if (scene !== model.number) return;
    const before = model.objects.length;
    const wasCrowd = model.isCrowd;
    model.addObjects(objects);
    if (wasCrowd !== model.isCrowd) this.clearViews();
    for (const object of model.objects.slice(before)) this.moved.add(object.index);
    this.fetchHulls(objects.map(({hullId}) => hullId));
    this.soon('tree', () => {
      this.tree.rebuild();
      this.answerPanel.rebuild();
    });
  }

  fetchHulls(ids) {
    const wanted = [...ids].filter((id) => !this.awaited.has(id));
    for (const id of wanted) this.awaited.add(id);
    if (wanted.length) this.connection.send({type: 'geometry', files: [], hullIds: wanted});
  }

  hullChanged({kind, hull}) {
    const {model} = this;
    if (this.watch.ownsHulls) return;
    const gone = kind === 'HULL_EVENT_KIND_DELETED';
    model.info.set(hull.hullId, gone ? undefined : hull);
    this.setGone(hull.hullId, gone);
    this.updateStatus(hull.revision);
    if (!gone) {
      this.fetchIfOlder(hull.hullId);
    } else if (model.bodiesWith(hull.hullId).length) {
      model.setHull(hull.hullId, null);
      this.geometryChanged();
    }
  }

  setGone(id, gone) {
    for (const object of this.model.objects) {
      if (object.hullId !== id || object.gone === gone) continue;
      object.gone = gone;
      this.soon('gone', () => this.model.tell('visibility'));
    }
  }

  // Requests a hull or a body again if it changed while its shape was in flight.
  fetchIfOlder(id) {
    if (this.watch.ownsHulls) return;
    const revision = this.model.info.get(id)?.revision;
    if (isNewer(revision, this.model.revisionOf(id))) this.fetchHulls([id]);
  }

  frame(frame) {
    const {model} = this;
    const {kind} = frame.head;
    if (kind === 'mesh') {
      model.meshes.set(frame.head.file, new MeshShape(frame));
    } else if (kind === 'hull') {
      this.hullCame(new HullShape(frame), frame.head.hullId);
    } else if (kind === 'body') {
      this.bodyCame(new Body(frame.head), frame.head.hullId);
    } else if (kind === 'simplified') {
      const hull = new HullShape(frame);
      this.shell.showSimplified(frame.head, hull);
      this.objectPanel.simplified(hull);
      return;
    } else {
      this.frameMissing(frame.head);
    }
    if (!model.isCrowd || this.awaited.size === 0) this.geometryChanged();
  }

  arrived(id, {revision}) {
    this.awaited.delete(id);
    this.fetchIfOlder(id);
    this.updateStatus(revision);
  }

  hullCame(hull, id) {
    const {model} = this;
    if (model.hulls.has(id) && !model.isNameless) this.keepForFlash(id);
    const wasAbsent = model.absent.has(id);
    model.setHull(id, hull);
    this.arrived(id, hull);
    if (wasAbsent) this.soon('tree', () => this.tree.rebuild());
  }

  // Keeps the previous shape of objects with this hull, so that new vertices flash after the views
  // are rebuilt.
  keepForFlash(id) {
    for (const object of this.model.objects) {
      const isConcerned = object.hullId === id || this.model.bodyOf(object)?.hullIds.has(id);
      const shape = isConcerned && !this.former.has(object.index) && this.model.hullOf(object);
      if (shape) this.former.set(object.index, shape);
    }
  }

  // Requests the pieces of a body like hulls of objects.
  bodyCame(body, id) {
    const {model} = this;
    model.setBody(id, body);
    this.arrived(id, body);
    this.fetchHulls([...body.hullIds].filter((piece) => !model.hulls.has(piece)));
    this.soon('tree', () => this.tree.rebuild());
  }

  frameMissing(head) {
    if (head.simplified) {
      this.objectPanel.simplifyFailed(head.message);
      return;
    }
    this.awaited.delete(head.hullId);
    const isPiece = this.model.bodiesWith(head.hullId).length > 0;
    if (isPiece) {
      this.model.setHull(head.hullId, null);
      this.soon('tree', () => this.tree.rebuild());
    }
    const known = this.model.info.get(head.hullId);
    if (known || isPiece || head.file !== undefined) this.say(head.message);
    if (head.hullId) this.setGone(head.hullId, true);
  }

  // Called when new shapes have arrived.
  geometryChanged() {
    this.soon('geometry', () => {
      const {model} = this;
      if (!this.fitted && this.awaited.size === 0) this.firstFit();
      this.rebuildViews();
      this.rebuildGround();
      const bounds = model.bounds();
      if (this.fitted && bounds) this.stage.keepInView(bounds);
      for (const [index, before] of this.former) {
        const shape = model.hullOf(model.objects[index]);
        // Waits until all pieces of a body have arrived.
        if (!shape) continue;
        const fresh = newVertices(before, shape);
        if (fresh.length) this.views.get(index)?.flash(shape, fresh);
        this.former.delete(index);
      }
      this.gizmo.update();
      this.marks.rebuild();
      this.motion.sweeps.rebuild();
      this.motion.panel.update();
      this.labels.rebuild();
      this.objectPanel.rebuild();
      this.answerPanel.update();
      this.controls.syncShown();
    });
  }

  // Called when all shapes have arrived: sets the origin and the unit, and selects a pair in a
  // small scene.
  firstFit() {
    const {model} = this;
    const bounds = model.bounds();
    if (!bounds) return;
    this.fitted = true;
    model.drawAround(bounds);
    this.stage.radius = bounds.radius;
    this.stage.flyTo(bounds, {jump: true, direction: this.stage.defaultView()});
    this.stage.isFitted = true;
    const hulls = model.objects.filter(({hullId, gone}) => hullId && !gone);
    const [moving] = model.moving;
    const [first, second] = model.named;
    if (hulls.length === 2)
      model.select(hulls[1].index, hulls[0].index);
    else if (model.objects.length === 1)
      model.select(0);
    else if (second !== undefined && !model.joints.length)
      model.select(second, first);
    else if (moving)
      model.select(moving.index);
    else if (model.collisions.pairs.length)
      this.chooseCollidingPair();
    else
      this.ask(true);
    // The fit already included hulls that appear later.
    if (this.watch.ownsHulls) this.watch.show(0);
    document.body.dataset.fitted = document.body.dataset.scene || 'yes';
  }

  // Selects the first pair that collides, if the user has not selected anything yet.
  chooseCollidingPair() {
    const [first] = this.model.collisions.pairs;
    if (!this.fitted || !first) return;
    this.mayChoosePair = false;
    if (this.model.selected === null) this.model.select(first[1], first[0]);
  }

  answer(message) {
    const {pair} = this.model;
    if (!pair || !this.isCurrent(message) || message.pair[0] !== pair[0] ||
        message.pair[1] !== pair[1])
      return;
    const before = this.model.decidingPieces();
    this.model.answer = message;
    this.marks.rebuild();
    this.answerPanel.update();
    this.objectPanel.compare();
    if (this.model.decidingPieces().some((piece, k) => piece !== before[k])) this.tree.rebuild();
  }

  // Returns true if a message answers a query about the current scene.
  isCurrent({update}) {
    return update >= this.firstUpdate;
  }

  collisions(message) {
    if (!this.isCurrent(message)) return;
    if (message.revision !== '0') this.updateStatus(message.revision);
    if (!this.watch.isOfPairs) this.model.setCollisions(message);
  }

  lost() {
    $('status').dataset.live = 'lost';
    $('status').textContent = 'ended';
    this.say(
        'hullctl has ended, or no longer accepts this page. ' +
        'The page keeps its content, but receives no more updates. ' +
        'Run hullctl view again for a new address.');
  }

  // --- Queries ---

  ask(rest) {
    const {model} = this;
    const objects = [...this.moved];
    this.moved.clear();
    this.connection.send({
      type: 'query',
      scene: model.number,
      update: ++this.update,
      objects,
      poses: objects.flatMap((index) => model.objects[index].pose),
      time: model.time,
      pair: model.pair || [],
      tolerance: model.tolerance,
      certificate: model.wantsCertificate(rest),
      rest,
    });
  }

  posesCame({scene, poses}) {
    if (scene !== this.model.number) return;
    this.joints.arrived(poses);
    const bounds = this.model.bounds();
    if (this.fitted && bounds) this.stage.keepInView(bounds);
  }

  simplify(object, side, maxError) {
    if (maxError === 0) {
      this.shell.clear();
      return;
    }
    this.shell.expect(object);
    this.connection.send({type: 'simplify', hullId: object.hullId, side, maxError, maxVertices: 0});
  }

  // --- Drawing ---

  clearViews() {
    for (const view of this.views.values()) view.dispose();
    this.views.clear();
    this.crowd?.dispose();
    this.crowd = null;
    this.stage.draw();
  }

  rebuildViews() {
    const {model, stage} = this;
    const isSingle = (object) => !model.isCrowd || object.index === model.selected ||
        object.index === model.other || object.opacity < 1 ||
        (object.file >= 0 && model.show.mesh) || model.roundedOf(object);
    const single = model.objects.filter(isSingle);
    const wanted = new Set(single.map(({index}) => index));
    for (const [index, view] of this.views) {
      if (wanted.has(index)) continue;
      view.dispose();
      this.views.delete(index);
    }
    for (const object of single) {
      if (!this.views.has(object.index))
        this.views.set(object.index, new ObjectView(model, stage, object));
      this.views.get(object.index).rebuild();
    }
    if (model.isCrowd) {
      this.crowd ??= new Crowd(model, stage);
      this.crowd.rebuild(wanted);
    }
    stage.draw();
  }

  // Rebuilds everything drawn or listed for each object.
  rebuildObjects() {
    this.rebuildViews();
    this.gizmo.update();
    this.marks.rebuild();
    this.labels.rebuild();
    this.tree.rebuild();
  }

  rebuildGround() {
    this.ground.rebuild(this.fitted ? this.model.bounds() : null);
  }

  // `direction`: as in Stage.flyTo.
  fit(direction = null) {
    const bounds = this.model.bounds();
    if (!bounds) return;
    this.stage.radius = bounds.radius;
    this.stage.flyTo(bounds, {direction});
    this.stage.isFitted = true;
    this.rebuildGround();
  }

  // Runs `work` once before the next frame, regardless of the number of calls.
  soon(name, work) {
    if (this.waiting.size === 0) {
      setTimeout(() => {
        const works = [...this.waiting.values()];
        this.waiting.clear();
        for (const each of works) each();
      });
    }
    this.waiting.set(name, work);
  }

  // --- The bar ---

  updateStatus(revision = undefined) {
    if (isNewer(revision, this.revision)) this.revision = revision;
    if ($('status').dataset.live === 'lost') return;
    const count = this.model.objects.filter(({gone}) => !gone).length;
    const objects = count === 1 ? '1 object' : `${grouped(count)} objects`;
    $('status').textContent = this.revision ? `${objects}, revision ${this.revision}` : objects;
  }

  say(text) {
    $('message').textContent = text;
    $('message').hidden = false;
    clearTimeout(this.silence);
    this.silence = setTimeout(() => {
      $('message').hidden = true;
    }, 12000);
  }

  setTheme(name) {
    this.theme = name;
    document.documentElement.dataset.theme = name;
    $('theme').textContent = name === 'dark' ? 'Light' : 'Dark';
    this.stage.setTheme(name);
    if (!this.views) return;
    this.rebuildViews();
    this.rebuildGround();
    this.ruler.rebuild();
    this.marks.rebuild();
    this.motion.sweeps.rebuild();
  }
}

try {
  // For the console and for tests.
  globalThis.hulldViewer = new Viewer();
} catch (error) {
  const message = $('message');
  message.textContent = `The picture cannot be drawn: ${error.message}`;
  message.hidden = false;
  throw error;
}
