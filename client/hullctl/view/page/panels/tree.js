// The tree of objects: search, select, show and hide, color. The prefixes of IDs, up to a slash,
// form groups.
import {RELATIONS} from 'hulld/palette.js';
import {button, element, grouped, tag} from 'hulld/panels/dom.js';

// More rows would slow down the page; the search finds the rest.
const MAX_ROWS = 400;

// Number of pieces up to which a body is expanded by default, and the maximum number of listed
// pieces.
const MAX_OPEN_PIECES = 8;
const MAX_PIECE_ROWS = 100;

const INDENT = 12;

// Groups objects by the segments of their names. Returns {prefix, members, groups}: `members` lie
// directly under the prefix, and `groups` contain the remaining objects. A group whose only content
// is another group is merged with it.
function treeOf(objects, prefix = '') {
  const members = [];
  const rest = new Map();
  for (const object of objects) {
    const end = object.name.indexOf('/', prefix.length) + 1;
    const key = object.name.slice(0, end);
    if (end === 0 || end === object.name.length) {
      members.push(object);
    } else {
      if (!rest.has(key)) rest.set(key, []);
      rest.get(key).push(object);
    }
  }
  if (!members.length && rest.size === 1 && prefix) {
    const [[key, inside]] = rest;
    return treeOf(inside, key);
  }
  return {prefix, members, objects, groups: [...rest].map(([key, inside]) => treeOf(inside, key))};
}

const quietTag = (text) => element('span', {className: 'tag quiet'}, text);

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
    const rows = [];
    const left = this.addRows(treeOf(found), 0, rows);
    if (left > 0) {
      rows.push(
          element('div', {className: 'more'}, `and ${grouped(left)} more: search to find them`));
    }
    if (!found.length) {
      const empty = this.model.objects.length ? 'No name contains this text.' : 'Nothing here yet.';
      rows.push(element('div', {className: 'more'}, empty));
    }
    this.root.replaceChildren(...rows);
    if (focused) this.root.querySelector(`[data-row="${CSS.escape(focused)}"]`)?.focus();
  }

  // Adds the rows of a group's content. Returns the number of objects without a row, except those
  // in collapsed groups.
  addRows({members, groups, prefix}, depth, rows) {
    let left = 0;
    const add = (row) => {
      row.style.paddingLeft = `${6 + INDENT * depth}px`;
      rows.push(row);
    };
    for (const group of groups) {
      if (rows.length >= MAX_ROWS) {
        left += group.objects.length;
        continue;
      }
      add(this.groupRow(group.prefix, group.prefix.slice(prefix.length), group.objects));
      if (!this.closed.has(group.prefix)) left += this.addRows(group, depth + 1, rows);
    }
    for (const object of members) {
      if (rows.length >= MAX_ROWS) {
        ++left;
        continue;
      }
      add(this.row(object, prefix));
      if (this.isOpen(object)) this.pieceRows(object).forEach(add);
    }
    return left;
  }

  groupRow(group, name, members) {
    const closed = this.closed.has(group);
    const visible = members.some((object) => object.visible);
    return element(
        'div', {className: 'row group'},
        button(
            {
              className: 'name',
              'aria-expanded': String(!closed),
              'data-row': `group ${group}`,
              onclick: () => this.toggle(this.closed, group),
            },
            `${closed ? '\u25b8' : '\u25be'} ${name} `,
            element('span', {className: 'quiet'}, grouped(members.length))),
        this.eye(
            visible, group, `group-eye ${group}`, () => this.model.setVisible(members, !visible)));
  }

  isOpen({index, hullId}) {
    const body = this.model.bodies.get(hullId);
    const isShort = body?.pieces.length <= MAX_OPEN_PIECES && !this.model.isCrowd;
    return Boolean(body) && isShort !== this.turned.has(index);
  }

  toggle(set, key) {
    if (!set.delete(key)) set.add(key);
    this.rebuild();
  }

  // Expands and collapses the list of a body's pieces.
  opener(object) {
    const isOpen = this.isOpen(object);
    return button(
        {
          className: 'eye',
          'aria-expanded': String(isOpen),
          'aria-label': `Pieces of ${object.name}`,
          'data-row': `pieces ${object.index}`,
          onclick: () => this.toggle(this.turned, object.index),
        },
        isOpen ? '\u25be' : '\u25b8');
  }

  // Pieces cannot be selected or moved individually: the body is one object.
  pieceRows(object) {
    const {model} = this;
    const {pieces} = model.bodies.get(object.hullId);
    const place = model.pair?.indexOf(object.index) ?? -1;
    const decider = place < 0 ? null : model.decidingPieces()[place];
    const rows = pieces.slice(0, MAX_PIECE_ROWS).map((piece, i) => {
      const isAbsent = model.absent.has(piece.hullId);
      return element(
          'div', {className: `row piece ${isAbsent ? 'gone' : ''}`},
          element('span', {className: 'name', title: piece.hullId}, `${i}: ${piece.hullId}`),
          isAbsent && quietTag('missing'), piece === decider && quietTag('decides'));
    });
    const rest = pieces.length - rows.length;
    if (rest > 0) {
      rows.push(element('div', {className: 'more'}, `and ${grouped(rest)} more pieces`));
    }
    return rows;
  }

  // `prefix`: that of the object's group.
  row(object, prefix) {
    const {model} = this;
    const isSelected = object.index === model.selected;
    const isOther = object.index === model.other && model.selected !== null;
    const relation = RELATIONS[model.relationOf.get(object.index)];
    const names =
        ['row', isSelected && 'selected', object.gone && 'gone', !object.visible && 'off'];
    const row = element(
        'div', {className: names.filter(Boolean).join(' '), 'data-index': object.index},
        element('input', {
          type: 'color',
          value: model.colorOf(object),
          'aria-label': `Color of ${object.name}`,
          oninput: ({target}) => {
            object.color = target.value;
            model.tell('color');
          },
        }),
        button(
            {
              className: 'name',
              title: object.name,
              'aria-pressed': String(isSelected),
              'data-row': `name ${object.index}`,
              onclick: ({shiftKey}) => this.choose(object, shiftKey),
              ondblclick: () => model.tell('fly', [object]),
            },
            object.name.slice(prefix.length)),
        relation && tag(relation), object.gone && quietTag('deleted'),
        model.bodyOf(object) && this.opener(object),
        this.eye(
            object.visible, object.name, `eye ${object.index}`,
            () => model.setVisible([object], !object.visible)));
    if (isOther) row.title = 'The other object of the pair';
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
    return button(
        {
          className: 'eye',
          'data-row': key,
          'aria-label': `${visible ? 'Hide' : 'Show'} ${name}`,
          onclick: toggle,
        },
        visible ? 'hide' : 'show');
  }
}
