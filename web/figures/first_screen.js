// What was asked, the answer in at most five numbers, and what needs attention, in words.
import { html, shortened } from '../dom.js';
import { display, inUnit, isNumber, joined, length, lengthWithSigma, percent, ratioInWords, significant, withSigma } from '../format.js';
import { text } from '../strings/en.js';

const mostSentences = 6;

function sentence(words) {
  return words.charAt(0).toUpperCase() + words.slice(1);
}

// A number, and how sure it is.
function measured(value, sigma, unit) {
  const [number, doubt] = withSigma(value, sigma, { ...unit, unit: '' }).split(' ± ');
  return doubt ? [html('span', { class: 'value' }, joined(number, unit.unit)), html('span', { class: 'sigma' }, ` ± ${joined(doubt, unit.unit)}`)] : joined(number, unit.unit);
}

function tile(title, value, ...notes) {
  return html('div', { class: 'tile' }, html('h4', {}, title), html('p', { class: 'change' }, value), notes.filter(Boolean).map((note) => html('p', { class: 'note' }, note)));
}

function change(before, after) {
  return [isNumber(before) ? [html('span', { class: 'before' }, length(before)), html('span', { class: 'arrow' }, ' → ')] : null, html('span', { class: 'after' }, length(after))];
}

function away({ sigmas_from_nominal: sigmas }, nominal) {
  return isNumber(sigmas) ? text.answers.away(significant(Math.abs(sigmas), 2), nominal) : null;
}

function diameter({ wheel, value, sigma }) {
  return text.answers.wheel_ratio.diameter(wheel, withSigma(value, sigma, display('m')));
}

// What an estimate is in proportion to, where nothing told it.
function exact({ taken_as_exact: names }, { calibration }) {
  if (names.length === 0) return null;
  const diameters = names.filter((name) => name.endsWith('.diameter'));
  const all = diameters.length > 1 && diameters.length === calibration.robot.wheels.length;
  const others = all ? names.filter((name) => !diameters.includes(name)) : names;
  return text.answers.exact([all ? text.answers.exactDiameters : null, ...others.map((name) => text.answers.exactOne(text.parameter(name)))].filter(Boolean));
}

const percentUnit = { factor: 100, unit: '%' };

const tiles = {
  track_error: (answer, { run }) => tile(text.answers.track_error.title(text.roles[answer.role]), change(answer.before_m, answer.after_m),
    [ratioInWords(answer.before_m, answer.after_m), answer.before_role && text.answers.track_error.from(text.roles[answer.before_role])].filter(Boolean).join(' · '),
    [text.answers.track_error.note(length(answer.path_m)), run?.held_out === false ? text.answers.track_error.onItself : null].filter(Boolean).join(', ')),
  calibration_error: (answer) => tile(text.answers.calibration_error.title(answer.held_out), change(answer.after_m === null ? null : answer.before_m, answer.after_m ?? answer.before_m),
    [ratioInWords(answer.before_m, answer.after_m), text.answers.calibration_error.note(answer.runs)].filter(Boolean).join(' · ')),
  wheel_ratio: (answer) => tile(text.answers.wheel_ratio.title, measured(Math.abs(answer.value), answer.sigma, percentUnit),
    text.answers.wheel_ratio.value(answer.second, answer.first, answer.value >= 0), away(answer, percent(answer.nominal)), ...answer.diameters_m.map(diameter)),
  parameter: (answer, result) => tile(sentence(text.parameter(answer.name)), measured(answer.value, answer.sigma, display(answer.unit)), away(answer, inUnit(answer.nominal, display(answer.unit), 5)), exact(answer, result)),
  slip: (answer) => (answer.count === 0 ? tile(text.answers.slip.title, text.answers.slip.none(answer.unclear))
    : tile(text.answers.slip.title, text.answers.slip.value(answer.count), text.answers.slip.note(lengthWithSigma(answer.excess_m, answer.excess_sigma_m), answer.worst_wheel, isNumber(answer.worst_share) ? percent(answer.worst_share) : ''))),
  map: (answer) => tile(text.answers.map.title, text.answers.map.value(answer.landmarks), isNumber(answer.median95_m) ? text.answers.map.note(length(answer.median95_m)) : null),
  gyro_bias: (answer) => tile(text.answers.gyro_bias.title, measured(answer.value, answer.sigma, display('rad/s')),
    answer.rest_s > 0 ? text.answers.gyro_bias.note(significant(answer.rest_s, 3)) : text.answers.gyro_bias.noRest),
};

const sentences = {
  wheel_ratio: (item) => text.attention.wheel_ratio(item.second, item.first, item.value >= 0, percent(Math.abs(item.value)), percent(item.sigma, 1), significant(Math.abs(item.sigmas_from_nominal), 2)),
  wheel_scale: (item) => text.attention.wheel_scale(item.value >= 0, percent(Math.abs(item.value)), percent(item.sigma, 1), significant(Math.abs(item.sigmas_from_nominal), 2), item.diameters_m.map(diameter), item.diameters_m.map(({ nominal }) => inUnit(nominal, display('m'), 5))),
  parameter: (item) => text.attention.parameter(sentence(text.parameter(item.name)), withSigma(item.value, item.sigma, display(item.unit)), inUnit(item.nominal, display(item.unit), 5), significant(Math.abs(item.sigmas_from_nominal), 2)),
  slip: (item) => text.attention.slip(item.count, lengthWithSigma(item.excess_m, item.excess_sigma_m), item.worst_share > 0.5 ? item.worst_wheel : null),
  overconfident: (item) => text.attention.overconfident(text.roles[item.role] ?? item.name, percent(item.share_inside_95), item.reference_is_exact),
  nis: (item) => text.attention.nis(significant(item.mean, 3), significant(item.expected, 2)),
  stage: (item) => text.attention.stage(item.name, item.words),
  problem: (item) => text.attention.problem(shortened(item.place ?? '', 60), item.words),
  cannot_tell: (item) => text.attention.cannot_tell(item.words),
  warning: (item) => text.attention.warning(item.words),
};

function attention(items) {
  if (items.length === 0) return html('p', { class: 'calm' }, text.attention.none);
  const list = (some) => html('ul', {}, some.map((item) => html('li', { class: item.kind }, sentences[item.kind]?.(item) ?? item.words)));
  const rest = items.slice(mostSentences);
  return html('div', { class: 'callout warning', role: 'note' }, html('h3', {}, text.attention.title), list(items.slice(0, mostSentences)),
    rest.length > 0 ? html('details', {}, html('summary', {}, text.attention.all(items.length)), list(rest)) : null);
}

const signs = { done: '●', skipped: '○', failed: '▲' };

function stages(list) {
  if (list.length === 0) return null;
  const line = ({ name, status }) => html('span', { class: `stage ${status}` }, html('span', { 'aria-hidden': 'true' }, signs[status] ?? '○'), ` ${name} `, status === 'done' ? null : html('span', { class: 'soft' }, text.stages[status] ?? status));
  const entry = ({ name, status, message }) => html('li', {}, html('strong', {}, name), ` ${text.stages[status] ?? status}`, message ? `: ${message}` : null);
  return html('details', { class: 'asked' }, html('summary', {}, html('span', {}, text.asked.stages), list.map(line)), html('ul', { class: 'stages' }, list.map(entry)));
}

// Which clock all plots and tables go by.
function clock({ origin_s: origin, span_s: span }) {
  return span ? html('p', { class: 'note' }, text.asked.clock(origin)) : null;
}

function asked(run) {
  if (!run) return null;
  const { recording, robot, held_out: heldOut } = run;
  const parts = [recording?.path && text.asked.recording(shortened(recording.path, 80)), robot?.given && text.asked.robot(shortened(robot.given, 80)), typeof heldOut === 'boolean' ? text.asked.heldOut(heldOut) : null];
  return html('p', { class: 'from' }, parts.filter(Boolean).join(' · '));
}

export function firstScreen(result) {
  return html('div', { class: 'first-screen' }, asked(result.run), clock(result), stages(result.stages),
    html('div', { class: 'tiles' }, result.answers.map((answer) => tiles[answer.kind]?.(answer, result)).filter(Boolean)), attention(result.attention));
}
