// User input: the bar, the tools, the keys, and clicks.
import {pick} from 'hulld/drawing/picking.js';
import {savePicture} from 'hulld/drawing/picture.js';
import {bindKeys} from 'hulld/panels/keys.js';

const $ = (id) => document.getElementById(id);

export class Controls {
  constructor(viewer) {
    this.viewer = viewer;
    const {model, stage, ruler, gizmo, connection} = viewer;
    Object.assign(this, {model, stage, ruler, gizmo, connection});
    this.bindControls();
  }

  bindControls() {
    const {model, stage, viewer} = this;
    for (const key of Object.keys(model.show)) {
      $(`show-${key}`).addEventListener('change', ({target}) => {
        model.show[key] = target.checked;
        model.tell('shown');
      });
    }
    const actions = {
      fit: () => viewer.fit(),
      theme: () => viewer.setTheme(viewer.theme === 'dark' ? 'light' : 'dark'),
      help: () => $('keys').showModal(),
      'mode-move': () => this.mode('translate'),
      'mode-turn': () => this.mode('rotate'),
      'mode-reset': () => this.reset(),
      undo: () => model.undo(),
      orthographic: () => this.setOrthographic(!stage.isOrthographic),
      measure: () => this.toggleRuler(),
      save: () => savePicture(stage, 'hulld.png'),
    };
    for (const [id, act] of Object.entries(actions)) $(id).addEventListener('click', act);
    $('scene-choice').addEventListener('change', ({target}) => {
      this.connection.send({type: 'show', key: target.value});
      $('canvas').focus();
    });
    for (const button of document.querySelectorAll('[data-view]')) {
      button.addEventListener('click', () => viewer.fit(button.dataset.view));
    }
    for (const tab of document.querySelectorAll('.tabs button')) {
      tab.addEventListener('click', () => this.showPanel(tab.dataset.panel));
    }
    this.showPanel('answer');
    this.bindPicking();
    bindKeys({
      flyToSelected: () => model.object && model.tell('fly', [model.object]),
      step: (by) => this.step(by),
      nextOther: () => this.nextOther(),
      nextCollision: () => this.nextCollision(),
      deselect: () => (this.ruler.on ? this.toggleRuler() : model.select(null)),
      mode: (mode) => this.mode(mode),
      toggleVisible: () => this.toggleVisible(),
      search: () => {
        this.showPanel('objects');
        $('search').focus();
      },
      pan: (x, y) => stage.pan(x, y),
      orbit: (around, over) => stage.orbit(around, over),
      zoom: (factor) => stage.zoom(factor),
      nudge: (axis, steps) => this.connection.live && this.gizmo.nudge(axis, steps),
      scene: (key) => viewer.scenes?.length > 1 && this.connection.send({type: 'show', key}),
    });
  }

  // Selects on a click, but not on a drag.
  bindPicking() {
    const canvas = $('canvas');
    let down = null;
    canvas.addEventListener('pointerdown', ({clientX, clientY, button}) => {
      down = button === 0 ? [clientX, clientY] : null;
      this.gizmo.dragged = false;
      canvas.focus();
    });
    canvas.addEventListener('pointerup', ({clientX, clientY, shiftKey, offsetX, offsetY}) => {
      if (!down || this.gizmo.dragged || this.gizmo.handles.dragging) return;
      if (Math.hypot(clientX - down[0], clientY - down[1]) > 4) return;
      if (this.ruler.on) {
        this.ruler.take(offsetX, offsetY);
        return;
      }
      const hit = pick(this.model, this.stage, offsetX, offsetY);
      if (hit)
        this.viewer.tree.choose(this.model.objects[hit.index], shiftKey);
      else
        this.model.select(null);
    });
  }

  updateTools() {
    const {object} = this.model;
    const can = Boolean(object?.hullId) && this.connection.live && !object.isDriven;
    for (const [id, mode] of [['mode-move', 'translate'], ['mode-turn', 'rotate']]) {
      $(id).disabled = !can;
      $(id).setAttribute('aria-pressed', String(can && this.gizmo.mode === mode));
    }
    $('mode-reset').disabled = !can || object.pose === object.start;
    $('undo').disabled = !this.model.history.length;
    if (!this.connection.live) document.querySelector('.tools').hidden = true;
    this.gizmo.handles.enabled = this.connection.live;
    if (!this.connection.live) this.gizmo.handles.detach();
  }

  syncShown() {
    const {model} = this;
    for (const [key, on] of Object.entries(model.show)) $(`show-${key}`).checked = on;
    $('show-mesh').disabled = !model.files.length;
  }

  showPanel(name) {
    document.querySelector('main').dataset.panel = name;
    for (const tab of document.querySelectorAll('.tabs button')) {
      tab.setAttribute('aria-selected', String(tab.dataset.panel === name));
    }
  }

  setOrthographic(on) {
    this.stage.setOrthographic(on);
    $('orthographic').setAttribute('aria-pressed', String(on));
  }

  toggleRuler() {
    this.ruler.toggle();
    $('measure').setAttribute('aria-pressed', String(this.ruler.on));
  }

  mode(mode) {
    this.gizmo.setMode(mode);
    this.updateTools();
  }

  reset() {
    const {object} = this.model;
    if (object && !object.isDriven) this.model.setPose(object.index, object.start, true);
  }

  toggleVisible() {
    const {object} = this.model;
    if (object) this.model.setVisible([object], !object.visible);
  }

  step(by) {
    const present = this.model.objects.filter(({gone}) => !gone);
    if (!present.length) return;
    const at = present.findIndex(({index}) => index === this.model.selected);
    const next =
        at < 0 ? (by > 0 ? 0 : present.length - 1) : (at + by + present.length) % present.length;
    this.model.select(present[next].index);
  }

  nextOther() {
    const {model} = this;
    const others = model.objects.filter(
        ({hullId, gone, index}) => hullId && !gone && index !== model.selected);
    if (model.selected === null || !others.length) return;
    const at = others.findIndex(({index}) => index === model.other);
    model.select(model.selected, others[(at + 1) % others.length].index);
  }

  nextCollision() {
    const {pairs} = this.model.collisions;
    if (!pairs.length) return;
    this.visited = ((this.visited ?? -1) + 1) % pairs.length;
    this.viewer.answerPanel.visit(pairs[this.visited][0], pairs[this.visited][1]);
  }
}
