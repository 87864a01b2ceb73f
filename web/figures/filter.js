// How many particles still matter, how much the weightiest does, and when they were drawn anew.
import { chart } from '../chart.js';
import { html } from '../dom.js';
import { colour } from '../palette.js';
import { section, tooled } from '../section.js';
import { text } from '../strings/en.js';

export function filter([{ filter: found }]) {
  if (!found) return null;
  const { time_s: x, effective_particles: y, greatest_weight: greatest, resampled } = found.columns();
  if (!y.some((value) => value > 1)) return null; // a filter without particles
  const at = x.filter((time, i) => resampled[i] !== 0);
  const style = { colour: colour('after'), width: 1.4, dash: [] };
  const drawing = chart({ label: text.filter.title, height: 200, x: { name: text.plot.time, short: text.plot.timeShort, unit: 's', isTime: true }, y: { name: text.filter.name, unit: { factor: 1, unit: '' }, from: 0 },
    series: [{ name: text.filter.name, x, y, style },
      ...(greatest ? [{ name: text.filter.greatest, x, y: greatest.map((weight) => (weight > 0 ? 1 / weight : NaN)), style: { colour: colour('reference'), width: 1, dash: [4, 3] } }] : []),
      ...(at.length > 0 ? [{ name: '', x: at, y: new Float64Array(at.length), style: { colour: colour('before'), width: 1, dash: [] }, dots: true }] : [])] });
  return section(text.filter, tooled(drawing, text.filter.title), html('p', { class: 'note' }, text.filter.resampled(found.resampled_steps, found.steps)),
    found.drawn < found.steps ? html('p', { class: 'note' }, text.plot.drawn(found.drawn, found.steps)) : null);
}
