// Keyboard access to every action of the pointer.
import {element} from 'hulld/panels/dom.js';

// Binds keys to the controls of the page and to `actions`, and lists them.
export function bindKeys(actions) {
  // Keys; description; the selector of the button that acts, or a function, or null for keys
  // handled by special(); text between the keys.
  const table = [
    [['0', '7'], 'show a demo scene', null, '\u2013'],
    [['F'], 'show everything', '#fit'],
    [['C'], 'fly to the selected object', actions.flyToSelected],
    [['J'], 'select the next object', () => actions.step(1)],
    [['K'], 'select the previous object', () => actions.step(-1)],
    [['B'], 'pair the selected object with the next one', actions.nextOther],
    [['N'], 'fly to the next pair that collides', actions.nextCollision],
    [['Esc'], 'clear the selection', actions.deselect],
    [['G'], 'show handles for moving', () => actions.mode('translate')],
    [['R'], 'show handles for turning', () => actions.mode('rotate')],
    [['X', 'Y', 'Z'], 'move the object a step along an axis; with Shift back', null, ' '],
    [['Backspace'], 'return the object to its original pose', '#mode-reset'],
    [['.'], 'play the timeline', '#play'],
    [[','], 'go to the first contact of a motion', '#contact'],
    [['U'], 'undo the last move; also Ctrl+Z', '#undo'],
    [['\u2190', '\u2191', '\u2193', '\u2192'], 'orbit; with Shift pan', null, ' '],
    [['+', '\u2212'], 'zoom', null, ' '],
    [['I'], 'isometric view', '[data-view=isometric]'],
    [['A'], 'view from the front', '[data-view=front]'],
    [['T'], 'view from the top', '[data-view=top]'],
    [['S'], 'view from the right', '[data-view=right]'],
    [['O'], 'orthographic view', '#orthographic'],
    [['Q'], 'measure between two points', '#measure'],
    [['W'], 'save the picture', '#save'],
    [['P'], 'points', '#show-points'],
    [['M'], 'mesh', '#show-mesh'],
    [['H'], 'hull', '#show-hull'],
    [['E'], 'edges', '#show-edges'],
    [['L'], 'labels', '#show-labels'],
    [['#'], 'ground grid', '#show-grid'],
    [['V'], 'hide or show the selected object', actions.toggleVisible],
    [['/'], 'search', actions.search],
    [['D'], 'light or dark theme', '#theme'],
    [['?'], 'show this list', '#help'],
  ];
  const click = (selector) => document.querySelector(selector).click();
  const list = document.getElementById('keys-list');
  const plain = new Map();
  for (const [keys, text, act, between] of table) {
    const names = keys.flatMap((key, i) => [...(i ? [between] : []), element('kbd', {}, key)]);
    list.append(element('dt', {}, ...names), element('dd', {}, text));
    if (act) plain.set(keys[0].toLowerCase(), typeof act === 'string' ? () => click(act) : act);
  }
  plain.set('escape', plain.get('esc'));

  addEventListener('keydown', (event) => {
    const isUndo = (event.ctrlKey || event.metaKey) && event.key === 'z';
    if ((event.ctrlKey || event.metaKey || event.altKey) && !isUndo) return;
    const typing =
        event.target.matches?.('input:not([type="checkbox"]):not([type="color"]), select');
    if (typing) {
      if (event.key === 'Escape') event.target.blur();
      return;
    }
    if (document.querySelector('dialog[open]')) return;
    const act =
        isUndo ? plain.get('u') : special(event, actions) || plain.get(event.key.toLowerCase());
    if (!act) return;
    event.preventDefault();
    act();
  });
}

function special({key, shiftKey}, actions) {
  const TURN = 0.12;
  const arrows = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};
  if (arrows[key]) {
    const [x, y] = arrows[key];
    return () => (shiftKey ? actions.pan(x, y) : actions.orbit(TURN * x, -TURN * y));
  }
  if (/^[xyz]$/i.test(key)) return () => actions.nudge(key.toLowerCase(), shiftKey ? -1 : 1);
  if (/^[0-7]$/.test(key)) return () => actions.scene(key);
  if (key === '+' || key === '=') return () => actions.zoom(0.85);
  if (key === '-' || key === '_') return () => actions.zoom(1 / 0.85);
  return null;
}
