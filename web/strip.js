// A one-dimensional picture inside a table row: marks at places in per cent, so it fits any width.
import { html } from './dom.js';
import { percentOnDecades, powerText } from './scale.js';

export function dot(at, kind, title) {
  return html('i', { class: `mark dot ${kind}`, style: `left:${at.toFixed(2)}%`, title });
}

export function line(at, kind, title) {
  return html('i', { class: `mark line ${kind}`, style: `left:${at.toFixed(2)}%`, title });
}

export function bar(from, to, kind, title) {
  const [low, high] = from < to ? [from, to] : [to, from];
  return html('i', { class: `mark bar ${kind}`, style: `left:${low.toFixed(2)}%;width:${(high - low).toFixed(2)}%`, title });
}

export function strip(label, ...marks) {
  return html('span', { class: 'strip', role: 'img', 'aria-label': label }, ...marks);
}

// The axis above a column of strips on decades.
export function decadeAxis([least, most], unitOf = powerText) {
  const labels = [];
  const every = Math.max(1, Math.ceil((most - least) / 5));
  for (let exponent = least; exponent <= most; exponent += every) {
    labels.push(html('span', { style: `left:${percentOnDecades(10 ** exponent, [least, most]).toFixed(2)}%` }, unitOf(exponent)));
  }
  return html('span', { class: 'strip-axis', 'aria-hidden': 'true' }, labels);
}
