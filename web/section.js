// The frame that every figure stands in: a heading, one sentence on how to read it, the drawing.
import { html } from './dom.js';

let count = 0;

// `inContents`: the word for it in the list at the top of the page.
export function section(title, inContents, howToRead, ...content) {
  count += 1;
  const id = `section-${count}`;
  const node = html('section', { class: 'section', id, 'aria-labelledby': `${id}-title` },
    html('h3', { id: `${id}-title` }, title),
    html('figure', {}, html('figcaption', {}, howToRead), content));
  node.inContents = inContents;
  return node;
}

export function legend(...entries) {
  return html('ul', { class: 'legend' }, entries.map(([kind, text]) => html('li', {}, html('i', { class: `key ${kind}`, 'aria-hidden': 'true' }), text)));
}

// Wide or long tables scroll inside a box that the keyboard reaches.
export function scrolling(table, label) {
  return html('div', { class: 'scrolling', tabindex: '0', role: 'group', 'aria-label': label }, table);
}

// A cell that spans several columns.
export function wide(columns, content) {
  return { columns, content };
}

// A table: columns of {head, class}, rows of {cells, kind}; a cell is nodes, strings or wide().
export function table(columns, rows, attributes = {}) {
  const narrow = (content, i) => html('td', { class: columns[i].class, 'data-head': columns[i].label ?? textOf(columns[i].head) }, content);
  const cell = (content, i) => (content.columns ? html('td', { class: 'spanning', colspan: content.columns }, content.content) : narrow(content, i));
  const cellsOf = (cells) => cells.map((content, i) => cell(content, i + cells.slice(0, i).reduce((sum, { columns: more }) => sum + (more ? more - 1 : 0), 0)));
  return html('table', attributes,
    html('thead', {}, html('tr', {}, columns.map(({ head, class: kind }) => html('th', { scope: 'col', class: kind }, head)))),
    html('tbody', {}, rows.map((row) => html('tr', { class: row.kind }, cellsOf(row.cells)))));
}

function textOf(head) {
  return typeof head === 'string' ? head : '';
}
