// What the calibration came to, in words and in a few numbers.
import { html } from '../dom.js';
import { isNumber, length, ratioInWords } from '../format.js';
import { section } from '../section.js';
import { text } from '../strings/en.js';

const signs = { all_estimated: ['good', '●'], some_held: ['part', '◐'], nothing_estimated: ['none', '○'] };

function statusLine(calibration) {
  const [kind, sign] = signs[calibration.status] ?? ['none', '○'];
  const words = text.headline.statuses[calibration.status] ?? calibration.status;
  return html('p', { class: 'status' },
    html('span', { class: `chip ${kind}` }, html('span', { 'aria-hidden': 'true' }, sign), ' ', words),
    html('span', { class: 'method' }, text.headline.methods[calibration.method] ?? calibration.method));
}

function tile(title, before, after, note) {
  return html('div', { class: 'tile' },
    html('h4', {}, title),
    html('p', { class: 'change' },
      html('span', { class: 'before' }, length(before)),
      isNumber(after) ? [html('span', { class: 'arrow' }, ' → '), html('span', { class: 'after' }, length(after))] : null),
    html('p', { class: 'note' }, [ratioInWords(before, after), note].filter(Boolean).join(' · ')));
}

function errorTile(title, group) {
  return group && tile(title, group.before.position_rms_m, group.after?.position_rms_m, text.headline.runs(group.runs));
}

function tiles(calibration) {
  const { errors, e_max: eMax, runs, sessions } = calibration;
  const heldOut = runs.filter((run) => run.hold_out).length;
  const shown = [
    errorTile(text.headline.heldOutError, errors.hold_out),
    errorTile(text.headline.trainingError, errors.training),
    eMax && tile([text.headline.square, html('sub', {}, 'max,syst')], eMax.before_m, eMax.after_m, eMax.after_meaning),
    html('div', { class: 'tile' }, html('h4', {}, text.headline.runsTitle),
      html('p', { class: 'change' }, String(runs.length)),
      html('p', { class: 'note' }, [text.headline.sessions(sessions), text.headline.heldOut(heldOut)].join(' · '))),
  ];
  return html('div', { class: 'tiles' }, shown);
}

function note(kind, title, sentences) {
  return sentences.length === 0 ? null : html('div', { class: `callout ${kind}`, role: 'note' }, html('h3', {}, title),
    html('ul', {}, sentences.map((sentence) => html('li', {}, sentence))));
}

export function headline(calibration) {
  return section(text.headline,
    calibration.summary ? html('p', { class: 'summary' }, calibration.summary) : null,
    statusLine(calibration), tiles(calibration), note('plain', text.headline.notes, calibration.notes));
}
