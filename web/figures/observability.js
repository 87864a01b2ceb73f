// What the runs see of each combination of parameters, against what was known before.
import { html, nameOf } from '../dom.js';
import { significant } from '../format.js';
import { decades, percentOnDecades } from '../scale.js';
import { legend, scrolling, section, table } from '../section.js';
import { bar, decadeAxis, dot, line, strip } from '../strip.js';

function verdict(direction) {
  return direction.told ? html('span', {}, 'told') : html('strong', { class: 'cannot' }, 'cannot be told');
}

function row(direction, axis) {
  const value = direction.singular_value ?? 0;
  const kind = direction.told ? 'after' : 'outlier';
  const [limit, place] = [percentOnDecades(1, axis), percentOnDecades(value, axis)];
  const picture = strip(`${significant(value, 2)}, limit 1`, bar(limit, place, `thick ${kind}`), line(limit, 'limit'), dot(place, kind));
  return { cells: [nameOf(direction.words, 80), picture, significant(value, 2), verdict(direction)] };
}

export function observability(calibration) {
  if (calibration.directions.length === 0) return null;
  const axis = decades(calibration.directions.map((direction) => direction.singular_value ?? 0), 0.1, 10);
  const columns = [{ head: 'Combination', class: 'first' }, { head: decadeAxis(axis), class: 'picture wide', label: '' }, { head: 'Singular value', class: 'number' }, { head: '' }];
  return section('What the runs see', 'Observability',
    'Each bar is one combination of parameters: to the right of the line the runs know it that many times better than was known before them; to the left they do not, and it is held at nominal.',
    scrolling(table(columns, calibration.directions.map((direction) => row(direction, axis)), { class: 'cards observability' }), 'Observability'),
    legend(['line limit', 'limit: the runs know no more than was known before'], ['bar thick after', 'told'], ['bar thick outlier', 'cannot be told']));
}
