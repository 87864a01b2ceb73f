// The fleet page: what stands out, small multiples of the parameters, the table of robots, and each robot's own page.
import { html } from '../dom.js';
import { decimalsFor, fixed, percent, unknown } from '../format.js';
import '../settings.js';
import { words } from '../strings/fleet.js';
import { estimateOf, filtered, fleet, robots, size } from './data.js';
import { histogram } from './multiples.js';
import { makeRobotDialog } from './robot.js';
import { makeTable } from './table.js';
import { shownIn } from './units.js';

const show = makeRobotDialog();
// The table is there before the page is read to its end, where the histories are that a robot's own page shows.
const open = (robot) => (document.readyState === 'loading' ? document.addEventListener('DOMContentLoaded', () => show(robot), { once: true }) : show(robot));
const largest = fleet.types.map((_, i) => robots.type.filter((type) => type === i).length).reduce((best, count, i, all) => (count > all[best] ? i : best), 0);

const fixedColumns = [
  { name: 'name', kind: 'words wide', key: (i) => robots.name[i], text: (i) => robots.name[i] },
  ...(robots.report.some(Boolean) ? [{ name: 'report', kind: 'words', falls: true, key: (i) => Number(Boolean(robots.report[i])), text: (i) => (robots.report[i] ? words.report : ''), link: (i) => robots.report[i] }] : []),
  { name: 'type', kind: 'words', key: (i) => fleet.types[robots.type[i]].name, text: (i) => fleet.types[robots.type[i]].name },
  { name: 'attention', kind: 'words wide reasons', falls: true, key: (i) => robots.score[i], text: (i) => robots.reasons[i].map((reason) => words.reasons[reason]).join(', ') },
  { name: 'runs', falls: true, key: (i) => robots.runs[i], text: (i) => String(robots.runs[i]) },
  { name: 'last', falls: true, key: (i) => robots.last[i], text: (i) => robots.last[i] ?? unknown },
  { name: 'rms', falls: true, key: (i) => robots.rms[i], text: (i) => (robots.rms[i] === null ? unknown : `${fixed(robots.rms[i] * 1000, 1)} mm`) },
  { name: 'slip', falls: true, key: (i) => robots.slip[i], text: (i) => (robots.slip[i] === null ? unknown : percent(robots.slip[i])) },
].map((column) => ({ ...column, title: words.columns[column.name], help: words.help[column.name] }));

function parameterColumn({ name, unit }, place) {
  const shown = shownIn(unit);
  return {
    name, title: name, falls: true, help: words.help.parameter(name, shown.unit || unit), key: (i) => estimateOf(i, place)?.[0] ?? null,
    text: (i) => {
      const estimate = estimateOf(i, place);
      if (!estimate) return unknown;
      return `${fixed(estimate[0] * shown.factor, decimalsFor(((estimate[2] - estimate[1]) / 4) * shown.factor))} ${shown.unit}`;
    },
    mark: (i) => (estimateOf(i, place)?.[4] ? 'stands-out' : ''),
  };
}

const multiples = html('div', { class: 'multiples' });
const shown = html('output', {});
let pictures = [];
let pending = 0;
const table = makeTable(open, (rows) => {
  shown.value = words.shown(rows.length, size);
  cancelAnimationFrame(pending); // the table first: pictures follow in the next frame
  pending = requestAnimationFrame(() => pictures.forEach((picture) => picture.show(rows)));
});

// Parameters are those of a type; of all types together, those of the one with the most robots.
function showType(type) {
  const { parameters } = fleet.types[type ?? largest];
  const single = type !== null || fleet.types.length === 1;
  table.setColumns([...fixedColumns, ...(single ? parameters.map(parameterColumn) : [])]);
  const all = filtered({ words: '', type: type ?? largest, reason: '' });
  pictures = parameters.map((parameter, place) => histogram(parameter, place, all));
  multiples.replaceChildren(...pictures.map(({ figure }) => figure));
}

function chooser(title, options, onChoice) {
  const select = html('select', {}, options.map(([value, text]) => html('option', { value }, text)));
  select.addEventListener('change', () => onChoice(select.value));
  return html('label', {}, title, select);
}

const search = html('input', { type: 'search', 'aria-label': words.search });
search.addEventListener('input', () => table.setFilter({ words: search.value }));
const reasons = [...new Set(robots.reasons.flat())].map((reason) => [reason, words.reasons[reason]]);
const filters = html('div', { class: 'filters', role: 'group' },
  html('label', {}, words.search, search),
  fleet.types.length > 1 ? chooser(words.type, [['', words.allTypes], ...fleet.types.map(({ name }, i) => [String(i), name || '(no name)'])], (value) => {
    const type = value === '' ? null : Number(value);
    showType(type);
    table.setFilter({ type });
  }) : null,
  chooser(words.only, [['', words.everything], ['any', words.anyReason], ...reasons], (reason) => table.setFilter({ reason })),
  shown);

document.getElementById('fleet').replaceChildren(
  html('h1', { class: 'title' }, words.title(size, fleet.logs, fleet.failed)),
  html('p', { class: 'from' }, `${words.attention(robots.reasons.filter((list) => list.length > 0).length)}. ${words.from(fleet.first, fleet.last, fleet.version)}`),
  filters, table.box,
  html('section', { class: 'section' }, html('h3', {}, words.multiples), html('figcaption', {}, words.multiplesHow(percent(fleet.rate))), multiples));
showType(fleet.types.length > 1 ? null : 0);
table.setFilter({});

const asked = decodeURIComponent(location.hash.replace('#robot=', ''));
if (location.hash.startsWith('#robot=') && robots.name.includes(asked)) open(robots.name.indexOf(asked));
