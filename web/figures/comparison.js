// Several calibrations side by side: each parameter's value and intervals on one line, errors below.
import { html, nameOf } from '../dom.js';
import { decimalsFor, display, fixed, inUnit, isNumber, joined, length, ratioInWords, unknown } from '../format.js';
import { linear } from '../scale.js';
import { legend, scrolling, section, table } from '../section.js';
import { bar, dot, line, strip } from '../strip.js';

function valueText(parameter) {
  const shown = display(parameter.unit);
  const decimals = decimalsFor((parameter.sigma_within ?? parameter.sigma_prior) * shown.factor);
  return joined(fixed(parameter.value * shown.factor, decimals), shown.unit);
}

function heldText(parameter) {
  return inUnit(parameter.nominal, display(parameter.unit), 5);
}

function endsOf(parameter) {
  return [parameter.nominal, parameter.value, ...(parameter.interval95_within ?? []), ...(parameter.interval95_between ?? [])].filter(isNumber);
}

function picture(parameter, place) {
  const { interval95_within: within, interval95_between: between } = parameter;
  return strip('value and intervals on the scale of all results',
    between ? bar(place(between[0]), place(between[1]), 'thin after') : null,
    within ? bar(place(within[0]), place(within[1]), 'thick after') : null,
    isNumber(parameter.nominal) ? line(place(parameter.nominal), 'before', 'nominal') : null,
    parameter.observable && isNumber(parameter.value) ? dot(place(parameter.value), 'after') : null);
}

function parameterRows(results) {
  const names = [...new Set(results.flatMap(({ document }) => document.parameters.map((parameter) => parameter.name)))];
  return names.flatMap((name) => {
    const entries = results.map(({ label, document }) => ({ label, parameter: document.parameters.find((parameter) => parameter.name === name) })).filter(({ parameter }) => parameter);
    const ends = entries.flatMap(({ parameter }) => endsOf(parameter));
    const [low, high] = [Math.min(...ends), Math.max(...ends)];
    const place = high > low ? linear([low, high], [4, 96]) : () => 50;
    return entries.map(({ label, parameter }, i) => ({ kind: i === 0 ? 'first-of-group' : '', cells: [i === 0 ? nameOf(name) : '', nameOf(label, 32), parameter.observable ? valueText(parameter) : html('span', { class: 'soft' }, `${heldText(parameter)} (held)`), picture(parameter, place)] }));
  });
}

function change(before, after) {
  if (!isNumber(before)) return unknown;
  const text = `${length(before)} → ${length(after)}`;
  const words = ratioInWords(before, after);
  return html('span', {}, text, words ? html('span', { class: 'soft' }, ` ${words}`) : null);
}

function errorRow({ label, document: { errors, e_max: eMax } }) {
  const pair = (group) => (group ? change(group.before.position_rms_m, group.after?.position_rms_m) : unknown);
  return { cells: [nameOf(label, 32), pair(errors.hold_out), pair(errors.training), eMax ? change(eMax.before_m, eMax.after_m) : unknown] };
}

export function comparison(results) {
  if (results.length < 2) return null;
  const parameterColumns = [{ head: 'Parameter', class: 'first' }, { head: 'Result' }, { head: 'Value', class: 'number' }, { head: '', class: 'picture wide' }];
  const errorColumns = [{ head: 'Result', class: 'first' }, { head: 'Held-out runs, rms' }, { head: 'Training runs, rms' }, { head: ['E', html('sub', {}, 'max,syst')], label: 'E max,syst' }];
  return section('Parameters and errors', 'Parameters and errors',
    'Each parameter on one scale for all results: intervals between sessions that do not overlap mean that something about the robot changed.',
    scrolling(table(parameterColumns, parameterRows(results), { class: 'cards comparison' }), 'Parameters side by side'),
    legend(['line before', 'nominal'], ['dot after', 'value'], ['bar thick after', '95 % within'], ['bar thin after', '95 % between sessions']),
    scrolling(table(errorColumns, results.map(errorRow), { class: 'cards' }), 'Errors side by side'));
}
