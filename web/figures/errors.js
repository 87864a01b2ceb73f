// Position error of every run before and after, and pooled over training and hold-out.
import { fullName, html, nameOf } from '../dom.js';
import { isNumber, length, ratioInWords, significant, unknown } from '../format.js';
import { decades, percentOnDecades } from '../scale.js';
import { legend, scrolling, section, table } from '../section.js';
import { bar, decadeAxis, dot, strip } from '../strip.js';
import { text } from '../strings/en.js';

function dumbbell(before, after, axis, label) {
  const from = percentOnDecades(before, axis);
  if (!isNumber(after)) return strip(label, dot(from, 'before'));
  const to = percentOnDecades(after, axis);
  return strip(label, bar(from, to, 'thin plain'), dot(from, 'before', text.endpoints.before), dot(to, 'after', text.endpoints.after));
}

function cells(name, before, after, axis, { nees, nees_white_only: white }) {
  const pair = (key) => html('span', {}, html('span', { class: 'before' }, length(before[key])), ' → ', html('span', { class: 'after' }, after ? length(after[key]) : unknown));
  const words = ratioInWords(before.position_rms_m, after?.position_rms_m);
  return [name, dumbbell(before.position_rms_m, after?.position_rms_m, axis, words || text.errors.beforeOnly), pair('position_rms_m'), pair('position_max_m'), words || unknown, significant(nees, 2), significant(white, 2)];
}

function rowsOf(calibration, axis) {
  const rows = [];
  for (const kind of ['hold_out', 'training']) {
    const runs = calibration.runs.filter((run) => run.before && run.hold_out === (kind === 'hold_out'));
    const group = calibration.errors[kind];
    if (group) rows.push({ kind: 'group', cells: cells(text.errors.groups[kind], group.before, group.after, axis, group) });
    for (const run of runs) rows.push({ cells: cells(nameOf(fullName(run), 36), run.before, run.after, axis, run) });
  }
  return rows;
}

export function errors(calibration) {
  const shown = calibration.runs.flatMap((run) => [run.before?.position_rms_m, run.after?.position_rms_m]).filter(isNumber);
  if (shown.length === 0) return null;
  const axis = decades(shown, 0.01, 0.1);
  const metres = (exponent) => (exponent < 0 ? `${significant(10 ** (exponent + 3), 1)} mm` : `${10 ** exponent} m`);
  const columns = [{ head: text.errors.run, class: 'first' }, { head: decadeAxis(axis, metres), class: 'picture wide', label: '' }, { head: 'rms', class: 'number' },
    { head: text.errors.worst, class: 'number' }, { head: text.errors.change, class: 'number' }, { head: text.errors.nees, class: 'number' }, { head: text.errors.white, class: 'number' }];
  const rows = rowsOf(calibration, axis);
  return section(text.errors,
    scrolling(table(columns, rows, { class: `cards errors ${rows.length > 40 ? 'long' : ''}` }), text.errors.title),
    legend(['dot before', text.endpoints.before], ['dot after', text.endpoints.after]));
}
