// Creates elements: element('dt', {className: 'quiet'}, 'text', child).
export function element(name, properties = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (key.startsWith('on'))
      made.addEventListener(key.slice(2), value);
    else if (key.includes('-'))
      made.setAttribute(key, value);
    else
      made[key] = value;
  }
  made.append(...children.filter((child) => child || child === 0));
  return made;
}

export const button = (properties, ...children) =>
    element('button', {type: 'button', ...properties}, ...children);

// A remark below the facts, or in their place.
export const quiet = (text) => element('p', {className: 'quiet'}, text);

// The text in place of an answer that has not arrived.
export const missingAnswer = (live) =>
    live ? 'Waiting for the answer\u2026' : 'Not recorded in this file.';

// A relation (palette.js) as a sign and a word.
export const tag = ({word, sign, style}) =>
    element('span', {className: `tag ${style}`, title: word}, `${sign} ${word}`);

// Creates a block that the user opens and closes.
export const details = (summary, open, content) => element(
    'details', {className: 'command', open: Boolean(open)}, element('summary', {}, summary),
    content);

// Creates a slider with a label and the parts that follow the label's text.
export function slider(text, properties, ...parts) {
  const input = element('input', {type: 'range', ...properties});
  return element('div', {className: 'slider'}, element('label', {}, text, ...parts, input));
}

// Formats "1234567" as "1 234 567", with thin spaces.
export const grouped = (count) => String(count).replace(/\B(?=(\d{3})+$)/g, '\u2009');

// Rounds to a few digits, for people.
export const short = (value) => Number(Number(value).toPrecision(4)).toString();

// Shows rounded numbers; the title has texts that read back as the same doubles.
export const rounded = (...values) => element(
    'span', {className: 'number', title: values.map((value) => String(Number(value))).join(' ')},
    values.map(short).join(' '));

// Puts a text on the clipboard. Falls back to an older method in browsers that deny permission.
export async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const area = element('textarea', {value: text});
    (document.querySelector('dialog[open]') || document.body).append(area);
    area.select();
    document.execCommand('copy');
    area.remove();
  }
}

// Makes a list of facts; omits rows without a value.
export function facts(rows) {
  const list = element('dl', {className: 'facts'});
  for (const [name, ...values] of rows) {
    if (values[0] === undefined || values[0] === null) continue;
    list.append(element('dt', {}, name), element('dd', {}, ...values));
  }
  return list;
}
