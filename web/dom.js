// Elements by name. Every text goes in as a text node: nothing from the data is ever read as markup.

import { on, soon } from './shared.js';

// Taken from the page itself, so that no address stands in the script.
const svgNamespace = document.querySelector('svg').namespaceURI;

function filled(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined && value !== false) node.setAttribute(name, value === true ? '' : value);
  }
  node.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return node;
}

export function html(name, attributes = {}, ...children) {
  return filled(document.createElement(name), attributes, children);
}

export function svg(name, attributes = {}, ...children) {
  return filled(document.createElementNS(svgNamespace, name), attributes, children);
}

// A drawing that is redrawn to the width it gets: text keeps its size on a narrow screen.
export function responsive(draw) {
  const box = html('div', { class: 'drawing' });
  let drawn = 0;
  const redraw = () => {
    const width = Math.round(box.clientWidth);
    if (width > 0 && width !== drawn) {
      drawn = width;
      box.replaceChildren(draw(width));
    }
  };
  box.redraw = () => {
    drawn = 0;
    redraw();
  };
  new ResizeObserver(() => soon(redraw)).observe(box);
  on('fit', redraw);
  return box;
}

// Is any of it in the window?
export function isSeen(node) {
  const { top, bottom } = node.getBoundingClientRect();
  return bottom > 0 && top < innerHeight;
}

// A name that may be a long path, shortened in its middle; the whole of it on hover.
export function nameOf(name, longest = 44) {
  const letters = Array.from(name);
  if (letters.length <= longest) return html('span', { class: 'name' }, name || '(no name)');
  const short = shortened(name, longest);
  return html('span', { class: 'name', title: letters.slice(0, 2000).join('') }, short);
}

// A run by the name that tells it from those of other sessions.
export function fullName(run) {
  return run.session && !run.name.includes(run.session) ? `${run.session}/${run.name}` : run.name;
}

export function shortened(name, longest = 44) {
  const letters = Array.from(name);
  if (letters.length <= longest) return name;
  const head = Math.ceil(longest / 3);
  return letters.slice(0, head).join('') + '…' + letters.slice(letters.length - (longest - head - 1)).join('');
}
