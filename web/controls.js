// Units and colours, at the top of the page.
import { html } from './dom.js';
import { choose, setting } from './settings.js';
import { text } from './strings/en.js';

function chooser(name) {
  const { name: title, ...options } = text.controls[name];
  const select = html('select', {}, Object.entries(options).map(([value, words]) => html('option', { value, selected: value === setting(name) }, words)));
  select.addEventListener('change', () => choose(name, select.value));
  return html('label', {}, html('span', {}, title), select);
}

export function controls() {
  const print = html('button', { type: 'button' }, text.controls.print);
  print.addEventListener('click', () => window.print());
  return html('div', { class: 'controls', role: 'group', 'aria-label': text.controls.label }, chooser('lengths'), chooser('angles'), chooser('theme'), print);
}
