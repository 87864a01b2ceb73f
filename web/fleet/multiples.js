// A histogram of each parameter: all robots of the type, and those that the table shows.
import { html, svg } from '../dom.js';
import { fixed, decimalsFor } from '../format.js';
import { linear } from '../scale.js';
import { words } from '../strings/fleet.js';
import { estimateOf } from './data.js';
import { shownIn } from './units.js';

const [width, height, foot] = [300, 84, 16];
const bins = 48;

function rangeOf(values, fit) {
  const ascending = Float64Array.from(values).sort();
  const at = (share) => ascending[Math.min(ascending.length - 1, Math.floor(share * ascending.length))];
  const middle = fit ? fit[0] : at(0.5);
  // All of them, but not so far that what is usual becomes one bar.
  const reach = fit ? 8 * fit[3] : Infinity;
  const [low, high] = [Math.max(ascending[0], middle - reach), Math.min(ascending.at(-1), middle + reach)];
  return high > low ? [low, high] : [low - 1e-9 - Math.abs(low) * 1e-6, high + 1e-9 + Math.abs(high) * 1e-6];
}

function countIn(values, [low, high]) {
  const counts = new Uint32Array(bins);
  for (const value of values) counts[Math.min(bins - 1, Math.max(0, Math.floor(((value - low) / (high - low)) * bins)))] += 1;
  return counts;
}

function captionOf({ fit, unit }) {
  if (!fit) return words.noPopulation;
  const shown = shownIn(unit);
  const [mean, low, high, spread, least, most] = fit.map((value) => value * shown.factor);
  const number = (value, sigma) => fixed(value, decimalsFor(sigma));
  const half = (high - low) / 2;
  return words.population(`${number(mean, half)} ${shown.unit}`, `${number(low, half)}…${number(high, half)}`, `${number(spread, spread)} ${shown.unit}`, `${number(least, spread)}…${number(most, spread)}`);
}

// Draws the histogram of `all`; what it returns shows which of them are in the table.
export function histogram(parameter, place, all) {
  const valueOf = (robot) => estimateOf(robot, place)?.[0];
  const values = all.map(valueOf).filter((value) => value !== undefined);
  const figure = html('figure', {}, html('h4', {}, parameter.name));
  if (values.length === 0) {
    figure.append(html('p', {}, words.robot.unobservable));
    return { figure, show() {} };
  }
  const range = rangeOf(values, parameter.fit);
  const [whole, shown] = [countIn(values, range), shownIn(parameter.unit)];
  const x = linear(range, [0, width]);
  const y = linear([0, Math.max(...whole)], [height - foot, 4]);
  const bars = (className) => Array.from(whole, () => svg('rect', { class: className, width: width / bins - 0.6 }));
  const [back, front] = [bars('tower'), bars('tower shown')];
  const raise = (rects, counts) => rects.forEach((rect, i) => {
    const top = y(counts[i]);
    rect.setAttribute('x', (i * width) / bins);
    rect.setAttribute('y', top);
    rect.setAttribute('height', height - foot - top);
  });
  raise(back, whole);
  const marks = [];
  if (parameter.fit) {
    const [mean, , , spread] = parameter.fit;
    const [left, right] = [x(Math.max(range[0], mean - 2 * spread)), x(Math.min(range[1], mean + 2 * spread))];
    marks.push(svg('rect', { class: 'spread', x: left, width: Math.max(0, right - left), y: 0, height: height - foot }));
    marks.push(svg('line', { class: 'mean', x1: x(mean), x2: x(mean), y1: 0, y2: height - foot }));
  }
  const decimals = decimalsFor((range[1] - range[0]) * shown.factor * 0.2);
  const tick = (value, anchor, at) => svg('text', { class: 'axis', x: at, y: height - 4, 'text-anchor': anchor }, `${fixed(value * shown.factor, decimals)} ${shown.unit}`);
  figure.append(svg('svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': words.label(parameter.name, values.length) }, marks, back, front,
    svg('line', { class: 'base', x1: 0, x2: width, y1: height - foot, y2: height - foot }), tick(range[0], 'start', 0), tick(range[1], 'end', width)), html('p', {}, captionOf(parameter)));
  return { figure, show: (rows) => raise(front, countIn(rows.map(valueOf).filter((value) => value !== undefined), range)) };
}
