// The parameter card: value, both 95 % intervals, nominal, how far away.
import { html, nameOf, shortened } from '../dom.js';
import { decimalsFor, display, fixed, inUnit, isNumber, joined, significant, unknown } from '../format.js';
import { linear } from '../scale.js';
import { intervalLegend, legend, scrolling, section, table, wide } from '../section.js';
import { bar, dot, line, strip } from '../strip.js';
import { text } from '../strings/en.js';

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
  return strip(text.parameters.picture(shortened(parameter.name)),
    between ? bar(place(between[0]), place(between[1]), 'thin after', text.parameters.between) : null,
    within ? bar(place(within[0]), place(within[1]), 'thick after', text.parameters.within) : null,
    isNumber(parameter.nominal) ? line(place(parameter.nominal), 'before', text.parameters.nominal) : null,
    parameter.observable ? dot(place(parameter.value), 'after', text.parameters.value) : null);
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
    return { kind: 'held', cells: [[name, html('span', { class: 'chip none' }, text.parameters.held)], nominal, wide(4, parameter.reason_held ?? ''), pictureOf(parameter)] };
  }
  const nominal = joined(fixed(parameter.nominal * shown.factor, decimals), shown.unit);
  const value = joined(fixed(parameter.value * shown.factor, decimals), shown.unit);
  const between = parameter.interval95_between ? interval(parameter.interval95_between, shown, decimals)
    : html('span', { class: 'soft' }, sessions < 2 ? text.parameters.oneSession : text.parameters.unknown);
  return { cells: [name, html('strong', {}, value), interval(parameter.interval95_within, shown, decimals), between, nominal, away(parameter), pictureOf(parameter)] };
}

export function parameters(calibration) {
  if (calibration.parameters.length === 0) return null;
  const columns = [{ head: text.parameters.parameter, class: 'first' }, { head: text.parameters.valueHead, class: 'number' }, { head: text.parameters.within, class: 'number' },
    { head: text.parameters.between, class: 'number' }, { head: text.parameters.nominalHead, class: 'number' }, { head: text.parameters.away, class: 'number' }, { head: '', class: 'picture' }];
  const rows = calibration.parameters.map((parameter) => row(parameter, calibration.sessions));
  return section(text.parameters,
    scrolling(table(columns, rows, { class: 'cards parameters' }), text.parameters.title),
    legend(...intervalLegend()));
}
