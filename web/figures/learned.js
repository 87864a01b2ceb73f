// The residuals of clean driving: histogram, and quantiles against the normal distribution's.
import { html, responsive, svg } from '../dom.js';
import { significant } from '../format.js';
import { linear, ticks, tickText } from '../scale.js';
import { section, tooledSvg } from '../section.js';
import { text } from '../strings/en.js';

const height = 280;

function frame(width, x, y, names, label) {
  const inner = { left: 46, right: width - 10, top: 12, bottom: height - 44 };
  const toX = linear(x, [inner.left, inner.right]);
  const toY = linear(y, [inner.bottom, inner.top]);
  const columns = ticks(...x, (inner.right - inner.left) / 60);
  const rows = ticks(...y, 5);
  const step = (values) => values[1] - values[0] || 1;
  const root = svg('svg', { class: 'plot', width, height, viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': label },
    columns.map((value) => svg('text', { class: 'tick', x: toX(value), y: inner.bottom + 16, 'text-anchor': 'middle' }, tickText(value, step(columns)))),
    rows.map((value) => [svg('path', { class: 'grid', d: `M${inner.left} ${toY(value)}H${inner.right}` }), svg('text', { class: 'tick', x: inner.left - 6, y: toY(value) + 4, 'text-anchor': 'end' }, tickText(value, step(rows)))]),
    svg('text', { class: 'axis', x: (inner.left + inner.right) / 2, y: inner.bottom + 36, 'text-anchor': 'middle' }, names.x),
    svg('text', { class: 'axis', x: 11, y: (inner.top + inner.bottom) / 2, 'text-anchor': 'middle', transform: `rotate(-90 11 ${(inner.top + inner.bottom) / 2})` }, names.y));
  return { root, toX, toY, inner };
}

function histogram(bins, width) {
  const step = bins.length > 1 ? bins[1].centre - bins[0].centre : 1;
  const { root, toX, toY, inner } = frame(width, [bins[0].centre - step, bins.at(-1).centre + step], [0, Math.max(...bins.map(({ count }) => count))],
    { x: text.learned.residual, y: text.learned.count }, text.learned.histogram);
  for (const { centre, count } of bins) {
    const [from, to] = [toX(centre - 0.46 * step), toX(centre + 0.46 * step)];
    root.append(svg('rect', { class: 'column', x: from, y: toY(count), width: to - from, height: inner.bottom - toY(count) }, svg('title', {}, `${significant(centre, 3)}: ${count}`)));
  }
  return root;
}

function quantiles(pairs, width) {
  const least = Math.min(...pairs.map(([normal, sample]) => Math.min(normal, sample)));
  const most = Math.max(...pairs.map(([normal, sample]) => Math.max(normal, sample)));
  const { root, toX, toY } = frame(width, [least, most], [least, most], { x: text.learned.normalQuantile, y: text.learned.sampleQuantile }, text.learned.quantiles);
  root.append(svg('path', { class: 'diagonal', d: `M${toX(least)} ${toY(least)}L${toX(most)} ${toY(most)}` }));
  for (const [normal, sample] of pairs) root.append(svg('circle', { class: 'end after', cx: toX(normal), cy: toY(sample), r: 3 }));
  return root;
}

// The published method's residuals are angles, far from unit sigma: both axes in their own standard deviations.
function standardised({ quantiles: pairs, normality: { mean, variance } }) {
  const sigma = Math.sqrt(variance);
  return sigma > 0 ? pairs.map(([normal, sample]) => [normal, (sample - mean) / sigma]) : pairs;
}

export function learned([{ slip }]) {
  const found = slip?.learned;
  if (!found || found.histogram.length === 0 || found.quantiles.length === 0) return null;
  const words = text.learned;
  const { normal, u1, u2, limit } = found.normality;
  const verdict = (normal ? words.normal : words.notNormal)(significant(u1, 2), significant(u2, 2), significant(limit, 3));
  const panel = (title, draw) => html('div', { class: 'panel' }, html('h4', {}, title), tooledSvg(responsive(draw), title));
  const pairs = standardised(found);
  return section(words, html('p', {}, verdict), html('div', { class: 'panels' }, panel(words.histogram, (width) => histogram(found.histogram, width)), panel(words.quantiles, (width) => quantiles(pairs, width))));
}
