// The parameter card: value, both 95 % intervals, nominal, how far away.
import { html, nameOf, shortened } from '../dom.js';
import { decimalsFor, display, fixed, inUnit, isNumber, joined, significant, unknown } from '../format.js';
import { linear } from '../scale.js';
import { legend, scrolling, section, table, wide } from '../section.js';
import { bar, dot, line, strip } from '../strip.js';

function interval(ends, shown, decimals) {
  return ends ? `${fixed(ends[0] * shown.factor, decimals)} … ${joined(fixed(ends[1] * shown.factor, decimals), shown.unit)}` : unknown;
}

function pictureOf(parameter) {
  const ends = [parameter.nominal, parameter.value, ...(parameter.interval95_within ?? []), ...(parameter.interval95_between ?? [])].filter(isNumber);
  if (ends.length === 0) return '';
  const low = Math.min(...ends);
  const high = Math.max(...ends);
  const place = high > low ? linear([low, high], [6, 94]) : () => 50;
  const between = parameter.interval95_between;
  const within = parameter.interval95_within;
  return strip(`${shortened(parameter.name)}: nominal, value and intervals on one line`,
    between ? bar(place(between[0]), place(between[1]), 'thin after', '95 % between sessions') : null,
    within ? bar(place(within[0]), place(within[1]), 'thick after', '95 % within') : null,
    isNumber(parameter.nominal) ? line(place(parameter.nominal), 'before', 'nominal') : null,
    parameter.observable ? dot(place(parameter.value), 'after', 'value') : null);
}

function away(parameter) {
  return isNumber(parameter.sigmas_from_nominal) ? `${significant(parameter.sigmas_from_nominal, 2)} σ` : unknown;
}

function row(parameter, sessions) {
  const shown = display(parameter.unit);
  const decimals = decimalsFor(parameter.sigma_within * shown.factor);
  const name = html('span', { class: 'parameter-name' }, nameOf(parameter.name));
  if (!parameter.observable) {
    const nominal = inUnit(parameter.nominal, shown, 5);
    return { kind: 'held', cells: [[name, html('span', { class: 'chip none' }, 'held')], nominal, wide(4, parameter.reason_held ?? ''), pictureOf(parameter)] };
  }
  const nominal = joined(fixed(parameter.nominal * shown.factor, decimals), shown.unit);
  const value = joined(fixed(parameter.value * shown.factor, decimals), shown.unit);
  const between = parameter.interval95_between ? interval(parameter.interval95_between, shown, decimals)
    : html('span', { class: 'soft' }, sessions < 2 ? 'unknown: one session' : 'unknown');
  return { cells: [name, html('strong', {}, value), interval(parameter.interval95_within, shown, decimals), between, nominal, away(parameter), pictureOf(parameter)] };
}

export function parameters(calibration) {
  if (calibration.parameters.length === 0) return null;
  const columns = [{ head: 'Parameter', class: 'first' }, { head: 'Value', class: 'number' }, { head: '95 % within', class: 'number' },
    { head: '95 % between sessions', class: 'number' }, { head: 'Nominal', class: 'number' }, { head: 'From nominal', class: 'number' }, { head: '', class: 'picture' }];
  const rows = calibration.parameters.map((parameter) => row(parameter, calibration.sessions));
  return section('Parameters', 'Parameters',
    'Within: what the noise of these runs allows. Between sessions: where a further session of this robot is expected, the interval to rely on; the two differ when tyres, load or floor change from day to day.',
    scrolling(table(columns, rows, { class: 'cards parameters' }), 'Parameters'),
    legend(['line before', 'nominal'], ['dot after', 'value'], ['bar thick after', '95 % within'], ['bar thin after', '95 % between sessions']));
}
