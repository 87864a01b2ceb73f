// What was recorded, how regularly, and what is wrong with it.
import { html, nameOf } from '../dom.js';
import { fixed, isNumber, significant, unknown } from '../format.js';
import { linear } from '../scale.js';
import { scrolling, section, table } from '../section.js';
import { bar, strip } from '../strip.js';
import { text } from '../strings/en.js';

function streamRow(stream, place) {
  const known = isNumber(stream.start_s) && isNumber(stream.end_s);
  const label = text.health.label(stream.stream, fixed(stream.start_s, 1), fixed(stream.end_s, 1));
  const picture = known ? strip(label, bar(place(stream.start_s), place(stream.end_s), `thick ${stream.gaps > 0 ? 'outlier' : 'after'}`)) : '';
  return { cells: [nameOf(stream.stream, 30), picture, String(stream.rows), isNumber(stream.rate_hz) ? `${significant(stream.rate_hz, 3)} Hz` : unknown,
    isNumber(stream.gaps) ? String(stream.gaps) : unknown, isNumber(stream.longest_step_s) ? `${significant(stream.longest_step_s, 3)} s` : unknown] };
}

function streams(list) {
  const words = text.health;
  const ends = list.flatMap(({ start_s: start, end_s: end }) => [start, end]).filter(isNumber);
  const place = linear([Math.min(...ends), Math.max(...ends)], [0, 100]);
  const columns = [{ head: words.stream, class: 'first' }, { head: '', class: 'picture wide' }, { head: words.rows, class: 'number' }, { head: words.rate, class: 'number' }, { head: words.gaps, class: 'number' }, { head: words.longest, class: 'number' }];
  return scrolling(table(columns, list.map((stream) => streamRow(stream, place)), { class: 'cards' }), words.title);
}

function problems(list) {
  const words = text.health;
  if (list.length === 0) return html('p', { class: 'calm' }, words.none);
  const sorted = [...list.filter(({ severity }) => severity === 'warning'), ...list.filter(({ severity }) => severity !== 'warning')];
  const columns = [{ head: words.kind, class: 'first' }, { head: words.words }, { head: words.place }, { head: words.times, class: 'number' }];
  const kind = ({ severity, kind: name }) => [nameOf(name, 30), html('span', { class: `chip ${severity === 'warning' ? 'part' : 'none'}` }, words[severity] ?? severity)];
  const rows = sorted.map((problem) => ({ cells: [kind(problem), problem.message, nameOf(problem.place, 40), String(problem.count)] }));
  return scrolling(table(columns, rows, { class: 'cards problems' }), words.problems);
}

export function health([{ health: info }]) {
  if (!info) return null;
  const missing = info.missing.length > 0 ? html('div', { class: 'callout plain' }, html('h3', {}, text.health.missing), html('ul', {}, info.missing.map((words) => html('li', {}, words)))) : null;
  return section(text.health, streams(info.streams), html('h4', {}, text.health.problems), problems(info.problems), missing);
}
