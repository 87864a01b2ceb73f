// The statistic of every interval with its limit, the slips shaded; a slip leads to its place on the map.
import { chart } from '../chart.js';
import { html, nameOf } from '../dom.js';
import { display, fixed, isNumber, lengthUnit, percent, unknown, withSigma } from '../format.js';
import { colour } from '../palette.js';
import { scrolling, section, table, tooled } from '../section.js';
import { lookAt } from '../shared.js';
import { text } from '../strings/en.js';

function show(event) {
  lookAt({ time: (event.start_s + event.end_s) / 2, points: [event.start, event.end].filter(Boolean).map(({ x_m: x, y_m: y }) => ({ x, y })) });
}

function chartOf({ timeline, events }) {
  const { end_s: x, value } = timeline.columns();
  const delta = timeline.statistic === 'delta_rad';
  const y = delta ? value : value.map((one) => Math.max(one, 0.01)); // the axis is logarithmic
  const name = text.slip.statistic[timeline.statistic];
  return chart({
    label: text.slip.title, height: 240,
    x: { name: text.plot.time, short: text.plot.timeShort, unit: 's', isTime: true },
    y: { name, unit: delta ? display('rad') : { factor: 1, unit: '' }, log: !delta },
    series: [{ name, x, y, style: { colour: colour('after'), width: 1.3, dash: [] } }],
    limits: [timeline.lower, timeline.upper].filter(isNumber).map((value) => ({ value, inView: true })),
    stretches: events.map((event) => ({ from: event.start_s, to: event.end_s, colour: colour('slip'), alpha: 0.3 })),
    onTap: (time) => {
      const near = events.find((event) => time >= event.start_s - 0.5 && time <= event.end_s + 0.5);
      if (near) show(near);
    },
  });
}

function eventTable(events) {
  const words = text.slip;
  if (events.length === 0) return html('p', { class: 'calm' }, words.none);
  const unit = lengthUnit(events.map(({ excess_m: excess }) => excess));
  const { start, duration, wheel, kind, excess, confidence, byChance } = words.columns;
  const columns = [{ head: start, class: 'number first' }, { head: duration, class: 'number' }, { head: wheel }, { head: kind }, { head: excess, class: 'number' }, { head: confidence, class: 'number' }, { head: byChance, class: 'number' }, { head: '', class: 'picture press' }];
  const press = (event) => {
    const button = html('button', { type: 'button', class: 'tool show-slip' }, words.show);
    button.addEventListener('click', () => show(event));
    return event.start ? button : '';
  };
  const rows = events.map((event) => ({ cells: [`${fixed(event.start_s, 2)} s`, `${fixed(event.end_s - event.start_s, 2)} s`, event.wheel === 'ambiguous' ? html('span', { class: 'soft' }, words.ambiguous) : nameOf(event.wheel, 24),
    words.kinds[event.kind] ?? event.kind, withSigma(event.excess_m, event.excess_sigma_m, unit), event.wheel === 'ambiguous' ? unknown : percent(event.confidence), isNumber(event.by_chance) ? percent(event.by_chance) : unknown, press(event)] }));
  return scrolling(table(columns, rows, { class: `cards ${rows.length > 40 ? 'long' : ''}` }), words.table);
}

function unseen(sentences) {
  if (sentences.length === 0) return null;
  return html('div', { class: 'callout plain', role: 'note' }, html('h4', {}, text.slip.unseen), html('ul', {}, sentences.map((words) => html('li', {}, words))));
}

export function slip([{ slip: found }]) {
  if (!found) return null;
  const how = found.timeline ? text.slip.how : text.slip.howEvents;
  return section({ ...text.slip, how }, found.timeline ? tooled(chartOf(found), text.slip.title) : null, eventTable(found.events), unseen(found.cannot_see));
}
