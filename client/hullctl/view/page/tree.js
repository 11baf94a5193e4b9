// The list of objects: search, select, show and hide, color. IDs with slashes form groups.
import {element, grouped} from 'hulld/dom.js';
import {RELATIONS} from 'hulld/palette.js';

// More rows would slow down the page; the search finds the rest.
const MOST_ROWS = 400;

// Number of pieces up to which a body is expanded by default, and the maximum number of listed
// pieces.
const MOST_OPEN_PIECES = 8;
const MOST_PIECE_ROWS = 100;

const groupOf = (name) => name.slice(0, name.lastIndexOf('/') + 1);

export class Tree {
  constructor(model) {
    this.model = model;
    this.root = document.getElementById('tree');
    this.search = document.getElementById('search');
    this.closed = new Set();
    // Bodies expanded or collapsed contrary to the default.
    this.turned = new Set();
    this.search.addEventListener('input', () => this.rebuild());
    this.search.addEventListener('keydown', (event) => {
      if (event.key !== 'Enter') return;
      const [first] = this.found();
      if (first) model.select(first.index);
    });
  }

  found() {
    const words = this.search.value.trim().toLowerCase().split(/\s+/);
    return this.model.objects.filter(
        ({name}) => words.every((word) => name.toLowerCase().includes(word)));
  }

  rebuild() {
    const focused = document.activeElement?.dataset?.row;
    const found = this.found();
    const groups = new Map();
    for (const object of found) {
      const group = groupOf(object.name);
      if (!groups.has(group)) groups.set(group, []);
      groups.get(group).push(object);
    }
    const rows = [];
    for (const [group, members] of groups) {
      if (rows.length > MOST_ROWS) break;
      if (group) rows.push(this.groupRow(group, members));
      if (this.closed.has(group)) continue;
      const room = Math.max(MOST_ROWS - rows.length, 0);
      for (const object of members.slice(0, room)) {
        rows.push(this.row(object, Boolean(group)));
        if (this.isOpen(object)) rows.push(...this.pieceRows(object, Boolean(group)));
      }
    }
    const shown = rows.filter(({dataset}) => dataset.index !== undefined).length;
    const closed =
        [...groups].filter(([g]) => this.closed.has(g)).reduce((n, [, m]) => n + m.length, 0);
    const rest = found.length - shown - closed;
    if (rest > 0) {
      rows.push(
          element('div', {className: 'more'}, `and ${grouped(rest)} more: search to find them`));
    }
    if (!found.length) {
      const empty = this.model.objects.length ? 'No name has this in it.' : 'There is nothing yet.';
      rows.push(element('div', {className: 'more'}, empty));
    }
    this.root.replaceChildren(...rows);
    if (focused) this.root.querySelector(`[data-row="${CSS.escape(focused)}"]`)?.focus();
  }

  groupRow(group, members) {
    const closed = this.closed.has(group);
    const visible = members.some((object) => object.visible);
    return element(
        'div', {className: 'row group'},
        element(
            'button', {
              type: 'button',
              className: 'name',
              'aria-expanded': String(!closed),
              'data-row': `group ${group}`,
              onclick: () => {
                if (!this.closed.delete(group)) this.closed.add(group);
                this.rebuild();
              },
            },
            `${closed ? '\u25b8' : '\u25be'} ${group} `,
            element('span', {className: 'quiet'}, grouped(members.length))),
        this.eye(visible, group, `group-eye ${group}`, () => {
          for (const object of members) object.visible = !visible;
          this.model.tell('visibility');
        }));
  }

  isOpen({index, hullId}) {
    const body = this.model.bodies.get(hullId);
    const isShort = body?.pieces.length <= MOST_OPEN_PIECES && !this.model.isCrowd;
    return Boolean(body) && isShort !== this.turned.has(index);
  }

  // Expands and collapses the list of a body's pieces.
  opener(object) {
    const isOpen = this.isOpen(object);
    return element(
        'button', {
          type: 'button',
          className: 'eye',
          'aria-expanded': String(isOpen),
          'aria-label': `Pieces of ${object.name}`,
          'data-row': `pieces ${object.index}`,
          onclick: () => {
            if (!this.turned.delete(object.index)) this.turned.add(object.index);
            this.rebuild();
          },
        },
        isOpen ? '\u25be' : '\u25b8');
  }

  // Pieces cannot be selected or moved individually: the body is one object.
  pieceRows(object, nested) {
    const {model} = this;
    const {pieces} = model.bodies.get(object.hullId);
    const place = model.pair?.indexOf(object.index) ?? -1;
    const decider = place < 0 ? null : model.decidingPieces()[place];
    const rows = pieces.slice(0, MOST_PIECE_ROWS).map((piece, i) => {
      const isAbsent = model.absent.has(piece.hullId);
      return element(
          'div', {className: `row piece ${nested ? 'nested' : ''} ${isAbsent ? 'gone' : ''}`},
          element('span', {className: 'name', title: piece.hullId}, `${i}: ${piece.hullId}`),
          isAbsent && element('span', {className: 'tag quiet'}, 'missing'),
          piece === decider && element('span', {className: 'tag quiet'}, 'decides'));
    });
    const rest = pieces.length - rows.length;
    if (rest > 0) {
      rows.push(element('div', {className: 'more'}, `and ${grouped(rest)} pieces more`));
    }
    return rows;
  }

  row(object, nested) {
    const {model} = this;
    const isSelected = object.index === model.selected;
    const isOther = object.index === model.other && model.selected !== null;
    const relation = RELATIONS[model.relationOf.get(object.index)];
    const names = [
      'row', nested && 'nested', isSelected && 'selected', object.gone && 'gone',
      !object.visible && 'off'
    ];
    const row = element(
        'div', {className: names.filter(Boolean).join(' '), 'data-index': object.index},
        element('input', {
          type: 'color',
          value: object.color,
          'aria-label': `Color of ${object.name}`,
          oninput: ({target}) => {
            object.color = target.value;
            model.tell('color');
          },
        }),
        element(
            'button', {
              type: 'button',
              className: 'name',
              title: object.name,
              'aria-pressed': String(isSelected),
              'data-row': `name ${object.index}`,
              onclick: ({shiftKey}) => this.choose(object, shiftKey),
              ondblclick: () => model.tell('fly', [object]),
            },
            nested ? object.name.slice(groupOf(object.name).length) : object.name),
        relation &&
            element(
                'span', {className: `tag ${relation.style}`, title: relation.word},
                `${relation.sign} ${relation.word}`),
        object.gone && element('span', {className: 'tag quiet'}, 'deleted'),
        model.bodyOf(object) && this.opener(object),
        this.eye(object.visible, object.name, `eye ${object.index}`, () => {
          object.visible = !object.visible;
          model.tell('visibility');
        }));
    if (isOther) row.title = 'The other one of the pair';
    return row;
  }

  choose(object, asOther) {
    const {model} = this;
    if (asOther && model.selected !== null && model.selected !== object.index) {
      model.select(model.selected, object.index);
    } else {
      model.select(object.index);
    }
  }

  eye(visible, name, key, toggle) {
    return element(
        'button', {
          type: 'button',
          className: 'eye',
          'data-row': key,
          'aria-label': `${visible ? 'Hide' : 'Show'} ${name}`,
          onclick: toggle,
        },
        visible ? 'hide' : 'show');
  }
}
