// The pages that the tests look at, made with the program.
import { execFileSync } from 'node:child_process';
import { cpSync, mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';

const work = process.env.TRUNDLE_BROWSER_WORK;
const source = resolve(import.meta.dirname ?? new URL('.', import.meta.url).pathname, '../..');
const demo = join(source, 'data/demo');

export const hostile = ['</script><script>window.hacked = 1</script>', '<img src=x onerror="window.hacked = 2">', `"'\`&amp;{{data}}<!-- -->`, '🤖👩‍🚀é', 'x'.repeat(10000)];

function trundle(...options) {
  execFileSync(process.env.TRUNDLE_PROGRAM, [...options, '--quiet'], { cwd: source, stdio: ['ignore', 'ignore', 'inherit'] });
}

function replaceIn(file, change) {
  writeFileSync(file, change(readFileSync(file, 'utf8')));
}

function replaceInJson(file, change) {
  const document = JSON.parse(readFileSync(file, 'utf8'));
  change(document);
  writeFileSync(file, JSON.stringify(document));
}

// Every name that can come from somebody else's files.
function makeHostile(folder) {
  const [script, image, quotes, emoji, long] = hostile;
  replaceInJson(join(folder, 'run.json'), (run) => {
    run.recording.name = script;
    run.recording.path = long;
    run.robot.given = image;
    run.stages.forEach((stage, i) => { stage.message = hostile[i % hostile.length]; });
    run.stages[1].status = 'failed';
    run.options = { [script]: quotes };
  });
  replaceInJson(join(folder, 'info.json'), (info) => {
    info.name = emoji;
    info.streams.forEach((stream, i) => { stream.stream = hostile[i % hostile.length]; });
    info.problems.forEach((problem, i) => { Object.assign(problem, { severity: 'warning', kind: image, place: script, message: hostile[i % hostile.length] }); });
  });
  replaceInJson(join(folder, 'calibration.json'), (calibration) => {
    calibration.robot.name = script;
    calibration.runs.forEach((run, i) => { run.name = hostile[i % hostile.length]; });
    calibration.warnings = hostile;
    calibration.cannot_tell = hostile;
    calibration.summary = image;
  });
  replaceInJson(join(folder, 'slip.json'), (slip) => {
    slip.events.forEach((event, i) => { Object.assign(event, { wheel: hostile[i % hostile.length], kind: image }); });
  });
  replaceIn(join(folder, 'slam/landmarks.csv'), (csv) => csv.replaceAll(/^(\d+),/gm, (line, name) => `${name === '1' ? '<script>alert(1)</script>' : `${emoji}${name}`},`));
  replaceIn(join(folder, 'trajectory.csv'), (csv) => `# ${script}\n${csv}`);
}

// A run of which nothing was measured from outside.
function withoutReference(run, folder) {
  mkdirSync(folder);
  for (const name of ['wheels.csv', 'gyro.csv']) cpSync(join(run, name), join(folder, name));
}

// {demo, many, two, hostile, alone, still, unmeasured, pair, grown, team}: files of pages; made once.
export function makePages() {
  mkdirSync(work, { recursive: true });
  const file = (name) => join(work, name);
  for (const name of ['demo', 'other', 'hostile', 'alone', 'still', 'unmeasured', 'unmeasured_run', 'grown', 'team']) rmSync(file(name), { recursive: true, force: true });
  trundle('run', join(demo, 'slip'), '--filter', 'fastslam2', '--robot', join(demo, 'robot.toml'), '--calibrate-on', ...[1, 2, 3].map((i) => join(demo, `session_0${i}`)),
    '--learn', join(demo, 'session_01/tour'), '-o', file('demo'));
  trundle('slam', join(demo, 'slip'), '--robot', join(file('demo'), 'calibrated.toml'), '--filter', 'ekf', '-o', file('other'));
  cpSync(join(file('demo'), 'reference.csv'), join(file('other'), 'reference.csv'));
  trundle('run', join(demo, 'session_01/square_cw_01'), '--robot', join(demo, 'robot.toml'), '-o', file('alone')); // calibrated on itself
  withoutReference(join(demo, 'session_01/square_cw_01'), file('unmeasured_run'));
  trundle('run', file('unmeasured_run'), '--robot', join(demo, 'robot.toml'), '-o', file('unmeasured'));
  trundle('slam', join(demo, 'session_01/tour'), '--robot', join(demo, 'robot.toml'), '-o', file('grown'));
  cpSync(join(demo, 'session_01/tour/reference.csv'), join(file('grown'), 'reference.csv'));
  trundle('slam', join(demo, 'session_01/tour'), join(demo, 'session_02/tour'), '--robot', join(demo, 'robot.toml'), '--together', '-o', file('team'));
  cpSync(file('demo'), file('hostile'), { recursive: true });
  makeHostile(file('hostile'));
  cpSync(file('alone'), file('still'), { recursive: true });
  replaceInJson(join(file('still'), 'info.json'), (info) => { // a gyro that reads exactly 0 at rest
    info.gyro_noise = { allan: [0.1, 1, 10].map((tau) => ({ tau_s: tau, deviation_rad_s: 0 })) };
  });
  for (const name of ['demo', 'hostile', 'alone', 'still', 'unmeasured', 'grown', 'team']) trundle('report', file(name), '-o', file(`${name}.html`));
  trundle('report', file('demo'), file('other'), '-o', file('two.html'));
  trundle('report', file('demo'), file('alone'), '-o', file('pair.html'));
  trundle('report', ...['demo', 'other', 'still', 'unmeasured', 'alone'].map(file), '-o', file('many.html'));
  return { demo: file('demo.html'), many: file('many.html'), two: file('two.html'), hostile: file('hostile.html'), alone: file('alone.html'), still: file('still.html'), unmeasured: file('unmeasured.html'), pair: file('pair.html'), grown: file('grown.html'), team: file('team.html') };
}
