// How well each run agrees with the calibrated robot, and how much it was trusted.
import { html, nameOf } from '../dom.js';
import { isNumber, significant, unknown } from '../format.js';
import { decades, percentOnDecades } from '../scale.js';
import { legend, scrolling, section, table } from '../section.js';
import { bar, decadeAxis, dot, line, strip } from '../strip.js';
import { text } from '../strings/en.js';

function trust(weight) {
  if (!isNumber(weight)) return unknown;
  const percent = Math.max(0, Math.min(100, weight * 100));
  return [strip(text.residuals.weightIs(significant(percent, 2)), bar(0, 100, 'track'), bar(0, percent, 'thick plain')), html('span', { class: 'weight' }, `${significant(percent, 2)} %`)];
}

function row(run, axis) {
  const chi2 = run.chi2_per_dof;
  const place = percentOnDecades(chi2, axis);
  const one = percentOnDecades(1, axis);
  const kind = run.outlier ? 'outlier' : 'after';
  const picture = isNumber(chi2) ? strip(text.residuals.bar(significant(chi2, 2)), bar(one, place, `thin ${run.outlier ? 'outlier' : 'plain'}`), line(one, 'limit'), dot(place, kind)) : '';
  const badge = run.outlier ? html('span', { class: 'chip part' }, text.residuals.outlierChip) : null;
  return { kind: run.outlier ? 'outlier' : '', cells: [[nameOf(run.name, 36), badge].filter(Boolean), nameOf(run.session || '–', 24), picture, significant(chi2, 2), trust(run.weight), run.remark] };
}

export function residuals(calibration) {
  const runs = calibration.runs.filter((run) => !run.hold_out);
  if (runs.length < 2) return null; // of a single run the noise is measured on itself: it always agrees
  const axis = decades(runs.map((run) => run.chi2_per_dof), 0.1, 10);
  const columns = [{ head: text.residuals.run, class: 'first' }, { head: text.residuals.session }, { head: decadeAxis(axis), class: 'picture', label: '' }, { head: text.residuals.chi2, class: 'number' },
    { head: text.residuals.weight, class: 'weights' }, { head: text.residuals.remark, class: 'remarks' }];
  const rows = runs.map((run) => row(run, axis));
  return section(text.residuals,
    scrolling(table(columns, rows, { class: `cards residuals ${rows.length > 40 ? 'long' : ''}` }), text.residuals.title),
    legend(['dot after', text.residuals.one], ['dot outlier', text.residuals.outlier], ['line limit', text.residuals.expected]));
}
