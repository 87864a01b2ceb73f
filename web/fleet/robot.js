// A robot's own page: its parameters, their course over its runs, what stands out, and its logs.
import { html, svg } from '../dom.js';
import { decimalsFor, fixed } from '../format.js';
import { linear } from '../scale.js';
import { words } from '../strings/fleet.js';
import { estimateOf, fleet, historyOf, robots } from './data.js';
import { shownIn } from './units.js';

const [width, height] = [300, 96];

function row(...cells) {
  return html('tr', {}, cells.map((cell) => html('td', {}, cell)));
}

function table(titles, rows) {
  return html('div', { class: 'scrolling' }, html('table', {}, html('thead', {}, html('tr', {}, titles.map((title) => html('th', {}, title)))), html('tbody', {}, rows)));
}

function parameterRow(robot, { name, unit }, place) {
  const shown = shownIn(unit);
  const estimate = estimateOf(robot, place);
  const changes = robots.changes[robot].filter((change) => change[0] === name).map((change) => change[3]);
  if (!estimate) return row(name, words.robot.unobservable, '', '', changes.join('; '));
  const [value, low, high, z, outlying] = estimate;
  const number = (metric) => fixed(metric * shown.factor, decimalsFor(((high - low) / 4) * shown.factor));
  return row(name, `${number(value)} ${shown.unit}`, `${number(low)}…${number(high)} ${shown.unit}`,
    z === null ? '' : html('span', { class: outlying ? 'stands-out' : null }, words.robot.z(fixed(z, 1))), changes.join('; '));
}

const yearMs = 365.25 * 86400000;

// The runs of a trend, which ends where the next step is, with their values by its line.
function lineOf([, , log, , [start, slope]], runs, stepsAt) {
  const first = runs.findIndex((run) => run[1] === log);
  const end = Math.min(runs.length, ...stepsAt.filter((step) => step > first));
  return runs.slice(first, end).map(([date], i) => [first + i, start + (slope * (Date.parse(date) - Date.parse(runs[first][0]))) / yearMs]);
}

// The values of the robot's runs, evenly spaced by run, with their own 95 %; dashed where a step was found, a line along trends.
function course({ name, unit }, place, runs, changes) {
  const known = runs.map((run, i) => ({ i, date: run[0], estimate: run[4][place] })).filter(({ estimate }) => estimate);
  if (known.length === 0) return null;
  const shown = shownIn(unit);
  const own = changes.filter((change) => change[0] === name);
  const stepsAt = own.filter((change) => !change[4]).map((change) => runs.findIndex((run) => run[1] === change[2]));
  const low = Math.min(...known.map(({ estimate: [value, sigma] }) => value - 2 * sigma));
  const high = Math.max(...known.map(({ estimate: [value, sigma] }) => value + 2 * sigma));
  const x = linear([0, Math.max(1, runs.length - 1)], [8, width - 8]);
  const y = linear([low, high > low ? high : low + 1], [height - 18, 8]);
  const decimals = decimalsFor((high - low) * 0.2 * shown.factor);
  const texts = [[runs[0][0], 'start', 0], [runs.at(-1)[0], 'end', width]].map(([date, anchor, at]) => svg('text', { class: 'axis', x: at, y: height - 3, 'text-anchor': anchor }, date ?? ''));
  const steps = stepsAt.map((at) => svg('line', { class: 'changed', x1: x(at - 0.5), x2: x(at - 0.5), y1: 4, y2: height - 16 }));
  const trends = own.filter((change) => change[4]).map((change) => svg('polyline', { class: 'trend', points: lineOf(change, runs, stepsAt).map(([run, value]) => `${x(run)},${y(value)}`).join(' ') }));
  const marks = known.map(({ i, estimate: [value, sigma] }) => [svg('line', { class: 'whisker', x1: x(i), x2: x(i), y1: y(value - 2 * sigma), y2: y(value + 2 * sigma) }), svg('circle', { class: 'point', cx: x(i), cy: y(value), r: 2.5 })]);
  return html('figure', {}, html('h4', {}, `${name}, ${fixed(low * shown.factor, decimals)}…${fixed(high * shown.factor, decimals)} ${shown.unit}`),
    svg('svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': words.series(name) }, steps, trends, marks, texts));
}

export function makeRobotDialog() {
  const dialog = html('dialog', { class: 'own' });
  document.body.append(dialog);
  dialog.addEventListener('close', () => history.replaceState(null, '', '#'));
  dialog.addEventListener('click', (event) => event.target === dialog && dialog.close());
  return (robot) => {
    const { parameters, name: type } = fleet.types[robots.type[robot]];
    const [runs, changes] = [historyOf(robot), robots.changes[robot]];
    const close = html('button', { type: 'button' }, words.robot.close);
    close.addEventListener('click', () => dialog.close());
    const report = robots.report[robot];
    dialog.replaceChildren(...[
      html('header', {}, html('h2', {}, robots.name[robot]), html('span', { class: 'soft' }, type), report ? html('a', { href: report }, words.report) : null, close),
      html('p', { class: 'reasons' }, robots.reasons[robot].map((reason) => words.reasons[reason]).join(', ')),
      robots.needs[robot].length ? html('p', {}, `${words.robot.needs}: ${robots.needs[robot].map((need) => fleet.needs[need]).join('; ')}`) : null,
      table([words.robot.parameter, words.robot.value, words.robot.interval, words.robot.population, words.robot.change], parameters.map((parameter, i) => parameterRow(robot, parameter, i))),
      html('div', { class: 'multiples' }, parameters.map((parameter, i) => course(parameter, i, runs, changes))),
      table([words.robot.date, words.robot.log, words.robot.status, words.robot.findings, words.robot.line], runs.map(([date, log, status, warnings, , line]) => row(date ?? '', log, status, String(warnings), line))),
    ].filter(Boolean));
    history.replaceState(null, '', `#robot=${encodeURIComponent(robots.name[robot])}`);
    if (!dialog.open) dialog.showModal();
    dialog.scrollTop = 0;
  };
}
