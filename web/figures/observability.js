// What the runs see of each combination of parameters, against what was known before.
import { html, nameOf } from '../dom.js';
import { significant } from '../format.js';
import { decades, percentOnDecades } from '../scale.js';
import { legend, scrolling, section, table } from '../section.js';
import { bar, decadeAxis, dot, line, strip } from '../strip.js';
import { text } from '../strings/en.js';

function verdict(direction) {
  return direction.told ? html('span', {}, text.observability.told) : html('strong', { class: 'cannot' }, text.observability.cannot);
}

function row(direction, axis) {
  const value = direction.singular_value ?? 0;
  const kind = direction.told ? 'after' : 'outlier';
  const [limit, place] = [percentOnDecades(1, axis), percentOnDecades(value, axis)];
  const picture = strip(text.observability.bar(significant(value, 2)), bar(limit, place, `thick ${kind}`), line(limit, 'limit'), dot(place, kind));
  return { cells: [nameOf(direction.words, 80), picture, significant(value, 2), verdict(direction)] };
}

export function observability(calibration) {
  if (calibration.directions.length === 0) return null;
  const axis = decades(calibration.directions.map((direction) => direction.singular_value ?? 0), 0.1, 10);
  const columns = [{ head: text.observability.combination, class: 'first' }, { head: decadeAxis(axis), class: 'picture wide', label: '' }, { head: text.observability.value, class: 'number' }, { head: '' }];
  return section(text.observability,
    scrolling(table(columns, calibration.directions.map((direction) => row(direction, axis)), { class: 'cards observability' }), text.observability.contents),
    legend(['line limit', text.observability.limit], ['bar thick after', text.observability.told], ['bar thick outlier', text.observability.cannot]));
}
