// Filter against filter: what each made of the same sightings.
import { nameOf } from '../dom.js';
import { isNumber, length, percent, significant, unknown } from '../format.js';
import { scrolling, section, table } from '../section.js';
import { text } from '../strings/en.js';

function errorOf(result, roles) {
  return result.errors.find(({ role }) => roles.includes(role))?.summary;
}

function row(result) {
  const { options, seed, landmarks, sightings, nis, smallest_effective_share: share } = result.slam;
  const online = errorOf(result, ['online', 'result']);
  const whole = errorOf(result, ['smoothed', 'path']);
  const method = [options.filter, options.particles ? text.filters.particles(options.particles) : null, options.particles && isNumber(seed) ? text.filters.seed(seed) : null].filter(Boolean).join(', ');
  const number = (value, digits) => (isNumber(value) ? significant(value, digits) : unknown);
  return { cells: [nameOf(result.label, 32), method, length(online?.position_rms_m), length(whole?.position_rms_m), number(online?.nees_mean, 2), isNumber(online?.share_inside_95) ? percent(online.share_inside_95) : unknown,
    number(nis.mean, 3), String(landmarks), `${sightings.rejected} / ${sightings.matched + sightings.rejected}`, options.particles && isNumber(share) ? percent(share) : unknown] };
}

export function filters(results) {
  const shown = results.filter(({ slam }) => slam);
  if (shown.length < 2) return null;
  const words = text.filters;
  const { result, method, online, whole, nees, inside, nis, landmarks, rejected, effective } = words.columns;
  const columns = [{ head: result, class: 'first' }, { head: method }, ...[online, whole, nees, inside, nis, landmarks, rejected, effective].map((head) => ({ head, class: 'number' }))];
  return section(words, scrolling(table(columns, shown.map(row), { class: 'cards' }), words.title));
}
