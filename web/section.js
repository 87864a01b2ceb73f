// The frame that every figure stands in: a heading, one sentence on how to read it, the drawing, and tools to zoom and to
// save it.
import { html } from './dom.js';
import { asSvg } from './pens.js';
import { saveCsv, savePng, saveSvg } from './save.js';
import { text } from './strings/en.js';

let count = 0;

// Before the page is drawn anew: the same sections get the same addresses.
export function forgetSections() {
  count = 0;
}

function button(name, sign, press) {
  const node = html('button', { type: 'button', class: 'tool', 'aria-label': name, title: name }, sign);
  node.addEventListener('click', press);
  return node;
}

// `words`: {title, contents, how}; `contents` stands in the list at the top of the page.
export function section(words, ...content) {
  count += 1;
  const id = `section-${count}`;
  const node = html('section', { class: 'section', id, 'aria-labelledby': `${id}-title` },
    html('h3', { id: `${id}-title` }, words.title),
    html('figure', {}, html('figcaption', {}, words.how), content));
  node.inContents = words.contents;
  return node;
}

// A drawing that can be saved, and zoomed if it says how: {node, svg(), zoom?(), reset?()}.
export function tooled(drawing, title) {
  const zooms = drawing.zoom ? [button(text.tools.zoomIn, '+', () => drawing.zoom(1.6)), button(text.tools.zoomOut, '−', () => drawing.zoom(1 / 1.6)),
    button(text.tools.reset, '↺', drawing.reset)] : [];
  const saves = [button(text.tools.png(title), 'PNG', () => savePng(drawing.svg(), title)), button(text.tools.svg(title), 'SVG', () => saveSvg(drawing.svg(), title))];
  return html('div', { class: 'tooled' }, html('div', { class: 'tools' }, zooms, saves), drawing.node);
}

// The same for an SVG that fits the width it gets.
export function tooledSvg(box, title) {
  return tooled({ node: box, svg: () => box.querySelector('svg') }, title);
}

export function legend(...entries) {
  return html('ul', { class: 'legend' }, entries.map(([kind, words]) => html('li', {}, html('i', { class: `key ${kind}`, 'aria-hidden': 'true' }), words)));
}

// Of the pictures of a parameter's intervals.
export function intervalLegend() {
  const words = text.parameters;
  return [['line before', words.nominal], ['dot after', words.value], ['bar thick after', words.within], ['bar thin after', words.between]];
}

export function lineSample(style) {
  const sample = asSvg(34, 12, (pen) => pen.line([1, 6, 33, 6], style), '');
  for (const name of ['role', 'aria-label']) sample.removeAttribute(name);
  sample.setAttribute('aria-hidden', 'true');
  return sample;
}

// A legend of lines in the colours of a chart's series.
export function lineLegend(entries) {
  return html('ul', { class: 'legend' }, entries.map(([style, words]) => html('li', {}, lineSample(style), words)));
}

// Wide or long tables scroll inside a box that the keyboard reaches; any table can be saved.
export function scrolling(table, label) {
  return html('div', { class: 'tooled' }, html('div', { class: 'tools' }, button(text.tools.csv(label), 'CSV', () => saveCsv(table, label))),
    html('div', { class: 'scrolling', tabindex: '0', role: 'group', 'aria-label': label }, table));
}

// A cell that spans several columns.
export function wide(columns, content) {
  return { columns, content };
}

// A table: columns of {head, class}, rows of {cells, kind, press?}; a cell is nodes, strings or wide().
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
