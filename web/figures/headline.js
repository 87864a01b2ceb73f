// What came out, what to beware of, what these runs cannot tell: in words, before any picture.
import { html } from '../dom.js';
import { isNumber, length, plural, ratioInWords } from '../format.js';

const statuses = {
  all_estimated: ['good', '●', 'All parameters estimated'],
  some_held: ['part', '◐', 'Some parameters held at nominal'],
  nothing_estimated: ['none', '○', 'Nothing estimated'],
};

const methods = {
  ml: 'maximum likelihood over all runs',
  classic: 'square runs, positions (Borenstein & Feng)',
  orientation: 'square runs, orientation errors',
};

function statusLine(calibration) {
  const [kind, sign, words] = statuses[calibration.status] ?? ['none', '○', calibration.status];
  return html('p', { class: 'status' },
    html('span', { class: `chip ${kind}` }, html('span', { 'aria-hidden': 'true' }, sign), ' ', words),
    html('span', { class: 'method' }, methods[calibration.method] ?? calibration.method));
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
  return group && tile(title, group.before.position_rms_m, group.after?.position_rms_m, plural(group.runs, 'run'));
}

function tiles(calibration) {
  const { errors, e_max: eMax, runs, sessions } = calibration;
  const heldOut = runs.filter((run) => run.hold_out).length;
  const shown = [
    errorTile('Position error, held-out runs, rms', errors.hold_out),
    errorTile('Position error, training runs, rms', errors.training),
    eMax && tile(['Square closing error, E', html('sub', {}, 'max,syst')], eMax.before_m, eMax.after_m, eMax.after_meaning),
    html('div', { class: 'tile' }, html('h4', {}, 'Runs'),
      html('p', { class: 'change' }, String(runs.length)),
      html('p', { class: 'note' }, [plural(sessions, 'session'), heldOut > 0 ? `${heldOut} held out` : 'none held out'].join(' · '))),
  ];
  return html('div', { class: 'tiles' }, shown);
}

function note(kind, title, sentences) {
  return sentences.length === 0 ? null : html('div', { class: `callout ${kind}`, role: 'note' }, html('h3', {}, title),
    html('ul', {}, sentences.map((sentence) => html('li', {}, sentence))));
}

export function headline(calibration) {
  return html('div', { class: 'headline' },
    calibration.summary ? html('p', { class: 'summary' }, calibration.summary) : null,
    statusLine(calibration),
    note('cannot', 'What these runs cannot tell', calibration.cannot_tell),
    note('warning', 'Warnings', calibration.warnings),
    note('plain', 'Notes', calibration.notes),
    tiles(calibration));
}
