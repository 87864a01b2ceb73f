// Several calibrations side by side: each parameter's value and intervals on one line, errors below.
import { html, nameOf } from '../dom.js';
import { display, inUnit, isNumber, length, ratioInWords, unknown, withSigma } from '../format.js';
import { linear } from '../scale.js';
import { intervalLegend, legend, scrolling, section, table } from '../section.js';
import { bar, dot, line, strip } from '../strip.js';
import { text } from '../strings/en.js';

function valueText(parameter) {
  return withSigma(parameter.value, parameter.sigma_total ?? parameter.sigma_within, display(parameter.unit));
}

function heldText(parameter) {
  return inUnit(parameter.nominal, display(parameter.unit), 5);
}

function endsOf(parameter) {
  return [parameter.nominal, parameter.value, ...(parameter.interval95_within ?? []), ...(parameter.interval95_between ?? [])].filter(isNumber);
}

function picture(parameter, place) {
  const { interval95_within: within, interval95_between: between } = parameter;
  return strip(text.comparison.picture,
    between ? bar(place(between[0]), place(between[1]), 'thin after') : null,
    within ? bar(place(within[0]), place(within[1]), 'thick after') : null,
    isNumber(parameter.nominal) ? line(place(parameter.nominal), 'before', text.parameters.nominal) : null,
    parameter.observable && isNumber(parameter.value) ? dot(place(parameter.value), 'after') : null);
}

function parameterRows(results) {
  const names = [...new Set(results.flatMap(({ calibration: document }) => document.parameters.map((parameter) => parameter.name)))];
  return names.flatMap((name) => {
    const entries = results.map(({ label, calibration: document }) => ({ label, parameter: document.parameters.find((parameter) => parameter.name === name) })).filter(({ parameter }) => parameter);
    const ends = entries.flatMap(({ parameter }) => endsOf(parameter));
    const [low, high] = [Math.min(...ends), Math.max(...ends)];
    const place = high > low ? linear([low, high], [4, 96]) : () => 50;
    return entries.map(({ label, parameter }, i) => ({ kind: i === 0 ? 'first-of-group' : '', cells: [i === 0 ? nameOf(name) : '', nameOf(label, 32), parameter.observable ? valueText(parameter) : html('span', { class: 'soft' }, text.comparison.held(heldText(parameter))), picture(parameter, place)] }));
  });
}

function change(before, after) {
  if (!isNumber(before)) return unknown;
  const both = `${length(before)} → ${length(after)}`;
  const words = ratioInWords(before, after);
  return html('span', {}, both, words ? html('span', { class: 'soft' }, ` ${words}`) : null);
}

function errorRow({ label, calibration: { errors, e_max: eMax } }) {
  const pair = (group) => (group ? change(group.before.position_rms_m, group.after?.position_rms_m) : unknown);
  return { cells: [nameOf(label, 32), pair(errors.hold_out), pair(errors.training), eMax ? change(eMax.before_m, eMax.after_m) : unknown] };
}

export function comparison(results) {
  if (results.length < 2) return null;
  const words = text.comparison;
  const parameterColumns = [{ head: words.parameter, class: 'first' }, { head: words.result }, { head: words.value, class: 'number' }, { head: '', class: 'picture wide' }];
  const errorColumns = [{ head: words.result, class: 'first' }, { head: words.heldOut }, { head: words.training }, { head: ['E', html('sub', {}, 'max,syst')], label: 'E max,syst' }];
  return section(words, scrolling(table(parameterColumns, parameterRows(results), { class: 'cards comparison' }), words.parametersTable),
    legend(...intervalLegend()),
    scrolling(table(errorColumns, results.map(errorRow), { class: 'cards' }), words.errorsTable));
}
