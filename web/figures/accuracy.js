// Each trajectory against the reference, as a table: filter against filter, before against after.
import { html, nameOf } from '../dom.js';
import { inUnit, isNumber, length, percent, significant, unknown, display } from '../format.js';
import { scrolling, section, table } from '../section.js';
import { text } from '../strings/en.js';
import { nameOfTrack } from './from_above.js';

function row(error, result, several) {
  const { summary, alignment } = error;
  const nees = isNumber(summary.nees_mean) ? text.compareTable.nees(significant(summary.nees_mean, 2), error.nees_degrees_of_freedom) : unknown;
  const end = [length(summary.final_m), isNumber(summary.final_percent) ? ` (${significant(summary.final_percent, 2)} %)` : ''].join('');
  return { cells: [nameOf(nameOfTrack(error, result, several), 50), length(summary.position_rms_m), length(summary.position_max_m), end, inUnit(summary.heading_rms_rad, display('rad')), nees,
    isNumber(summary.share_inside_95) ? percent(summary.share_inside_95) : unknown, text.compareTable.alignments[alignment.kind]] };
}

// What the reference is taken for where covariances are judged.
function ofReference(results) {
  const judged = results.flatMap(({ errors }) => errors).map(({ summary }) => summary).filter(({ nees_mean: mean }) => isNumber(mean));
  const words = judged.map(({ reference_noise: noise }) => (noise ? text.compareTable.noise(length(noise.position_sigma_m), inUnit(noise.heading_sigma_rad, display('rad'))) : text.compareTable.exact));
  return [...new Set(words)].map((sentence) => html('p', { class: 'note' }, sentence));
}

export function accuracy(results) {
  const several = results.length > 1;
  const words = text.compareTable;
  const rows = results.flatMap((result) => result.errors.map((error) => row(error, result, several)));
  const left = results.flatMap(({ not_compared: list }) => list).map(({ name, reason }) => html('p', { class: 'note' }, words.notCompared(name, reason)));
  if (rows.length === 0 && left.length === 0) return null;
  const { track, rms, max, final, heading, nees, inside, aligned } = words.columns;
  const columns = [{ head: track, class: 'first' }, ...[rms, max, final, heading, nees, inside].map((head) => ({ head, class: 'number' })), { head: aligned }];
  return section(words, rows.length > 0 ? scrolling(table(columns, rows, { class: 'cards' }), words.title) : null, ofReference(results), left);
}
