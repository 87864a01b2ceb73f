// Position error of every run before and after, and pooled over training and hold-out.
import { fullName, html, nameOf } from '../dom.js';
import { isNumber, length, ratioInWords, significant, unknown } from '../format.js';
import { decades, percentOnDecades } from '../scale.js';
import { legend, scrolling, section, table } from '../section.js';
import { bar, decadeAxis, dot, strip } from '../strip.js';

const groupNames = { training: 'All training runs', hold_out: 'All held-out runs' };

function dumbbell(before, after, axis, label) {
  const from = percentOnDecades(before, axis);
  if (!isNumber(after)) return strip(label, dot(from, 'before'));
  const to = percentOnDecades(after, axis);
  return strip(label, bar(from, to, 'thin plain'), dot(from, 'before', 'before'), dot(to, 'after', 'after'));
}

function cells(name, before, after, axis, { nees, nees_white_only: white }) {
  const pair = (key) => html('span', {}, html('span', { class: 'before' }, length(before[key])), ' → ', html('span', { class: 'after' }, after ? length(after[key]) : unknown));
  const words = ratioInWords(before.position_rms_m, after?.position_rms_m);
  const honest = isNumber(nees) ? `${significant(nees, 2)}${isNumber(white) ? ` (${significant(white, 2)})` : ''}` : unknown;
  return [name, dumbbell(before.position_rms_m, after?.position_rms_m, axis, words || 'before only'), pair('position_rms_m'), pair('position_max_m'), words || unknown, honest];
}

function rowsOf(calibration, axis) {
  const rows = [];
  for (const kind of ['hold_out', 'training']) {
    const runs = calibration.runs.filter((run) => run.before && run.hold_out === (kind === 'hold_out'));
    const group = calibration.errors[kind];
    if (group) rows.push({ kind: 'group', cells: cells(groupNames[kind], group.before, group.after, axis, group) });
    for (const run of runs) rows.push({ cells: cells(nameOf(fullName(run), 36), run.before, run.after, axis, run) });
  }
  return rows;
}

export function errors(calibration) {
  const shown = calibration.runs.flatMap((run) => [run.before?.position_rms_m, run.after?.position_rms_m]).filter(isNumber);
  if (shown.length === 0) return null;
  const axis = decades(shown, 0.01, 0.1);
  const metres = (exponent) => (exponent < 0 ? `${significant(10 ** (exponent + 3), 1)} mm` : `${10 ** exponent} m`);
  const columns = [{ head: 'Run', class: 'first' }, { head: decadeAxis(axis, metres), class: 'picture wide', label: '' }, { head: 'rms', class: 'number' },
    { head: 'worst point', class: 'number' }, { head: 'Change of rms', class: 'number' }, { head: 'NEES', class: 'number' }];
  const rows = rowsOf(calibration, axis);
  return section('Errors before and after', 'Errors',
    'Distance between odometry and reference, both laid on their common start; held-out runs took no part in the calibration, so they tell what it is worth. NEES near 3 means that the stated uncertainty is honest (in brackets: without the part that comes from the parameters).',
    scrolling(table(columns, rows, { class: `cards errors ${rows.length > 40 ? 'long' : ''}` }), 'Errors before and after'),
    legend(['dot before', 'before'], ['dot after', 'after']));
}
