// The table of robots. Only rows in view are in the page; they are moved and filled anew while it is scrolled.
import { html } from '../dom.js';
import { words } from '../strings/fleet.js';
import { filtered, sorted } from './data.js';

const spare = 6; // rows above and below the window, so that scrolling shows no gap

function setLink(node, address) {
  if (address) node.setAttribute('href', address);
  else node.removeAttribute('href');
}

export function makeTable(open, onChange) {
  const head = html('div', { class: 'head', role: 'row' });
  const body = html('div', { class: 'rows', role: 'rowgroup' });
  const box = html('div', { class: 'table', role: 'table', tabindex: 0, 'aria-label': words.columns.name }, head, body);
  const state = { columns: [], rows: [], by: 'attention', descending: true, filter: { words: '', type: null, reason: '' } };
  const pool = [];
  let height = 0;

  function fill(node, robot) {
    node.robot = robot;
    state.columns.forEach((column, i) => {
      const cell = node.children[i];
      const text = column.text(robot);
      const holder = column.link ? cell.firstChild : cell;
      if (holder.firstChild.data !== text) holder.firstChild.data = text;
      if (column.link) setLink(holder, column.link(robot));
      cell.className = `${column.kind ?? ''} ${column.mark?.(robot) ?? ''}`;
    });
  }

  function rowNode() {
    const node = html('div', { class: 'row', role: 'row', tabindex: 0 }, state.columns.map(({ link }) => html('span', { role: 'cell' }, link ? html('a', {}, ' ') : ' ')));
    body.append(node);
    return node;
  }

  function draw() {
    height ||= (pool[0] ??= rowNode()).getBoundingClientRect().height;
    const first = Math.max(0, Math.floor(box.scrollTop / height) - spare);
    const last = Math.min(state.rows.length, Math.ceil((box.scrollTop + box.clientHeight) / height) + spare);
    for (let i = 0; i < Math.max(pool.length, last - first); i += 1) {
      const node = (pool[i] ??= rowNode());
      const shown = first + i < last;
      node.hidden = !shown;
      node.style.display = shown ? '' : 'none';
      if (!shown) continue;
      node.style.transform = `translateY(${(first + i) * height}px)`;
      fill(node, state.rows[first + i]);
    }
  }

  function redo() {
    const column = state.columns.find(({ name }) => name === state.by) ?? state.columns[0];
    state.rows = sorted(filtered(state.filter), column.key, state.descending);
    draw();
    body.style.height = `${state.rows.length * height}px`;
    box.setAttribute('aria-rowcount', state.rows.length);
    for (const cell of head.children) {
      if (cell.dataset.name === state.by) cell.setAttribute('aria-sort', state.descending ? 'descending' : 'ascending');
      else cell.removeAttribute('aria-sort');
    }
    onChange(state.rows);
  }

  function sortBy(name) {
    state.descending = state.by === name ? !state.descending : Boolean(state.columns.find((column) => column.name === name).falls);
    state.by = name;
    box.scrollTop = 0;
    redo();
  }

  let asked = false;
  box.addEventListener('scroll', () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => { asked = false; draw(); });
  });
  const openAt = (event) => {
    const row = event.target.closest('.row');
    if (row && !event.target.closest('a[href]')) open(row.robot);
  };
  body.addEventListener('click', openAt);
  body.addEventListener('keydown', (event) => event.key === 'Enter' && openAt(event));
  new ResizeObserver(() => height && draw()).observe(box);

  return {
    box,
    setColumns(columns) {
      state.columns = columns;
      head.replaceChildren(...columns.map(({ name, title, help, kind }) => {
        const button = html('button', { type: 'button', title: help }, title);
        button.addEventListener('click', () => sortBy(name));
        return html('span', { class: kind, role: 'columnheader', 'data-name': name }, button);
      }));
      pool.length = 0;
      body.replaceChildren();
    },
    setFilter(filter) {
      Object.assign(state.filter, filter);
      box.scrollTop = 0;
      redo();
    },
  };
}
