// Puts the page together: for each result its figures in order. A new figure is one more entry in `figures`.
import { controls } from './controls.js';
import { html, nameOf, shortened } from './dom.js';
import { accuracy } from './figures/accuracy.js';
import { comparison } from './figures/comparison.js';
import { correlation } from './figures/correlation.js';
import { endpoints } from './figures/endpoints.js';
import { errorAlong } from './figures/error_along.js';
import { errors } from './figures/errors.js';
import { filter } from './figures/filter.js';
import { filters } from './figures/filters.js';
import { firstScreen } from './figures/first_screen.js';
import { gyro } from './figures/gyro.js';
import { health } from './figures/health.js';
import { growth } from './figures/growth.js';
import { headline } from './figures/headline.js';
import { influence } from './figures/influence.js';
import { learned } from './figures/learned.js';
import { fromAbove } from './figures/from_above.js';
import { nees } from './figures/nees.js';
import { nis } from './figures/nis.js';
import { observability } from './figures/observability.js';
import { parameters } from './figures/parameters.js';
import { provenance } from './figures/provenance.js';
import { residuals } from './figures/residuals.js';
import { slip } from './figures/slip.js';
import { trajectories } from './figures/trajectories.js';
import { prepared } from './result.js';
import { forgetSections } from './section.js';
import { onSettings } from './settings.js';
import { drawUnseen, fitAll, forgetListeners, soon, whenSeen } from './shared.js';
import { text } from './strings/en.js';

const ofCalibration = (figure) => ([{ calibration }]) => (calibration ? figure(calibration) : null);
const figures = [health, fromAbove, growth, accuracy, errorAlong, nees, slip, learned, gyro, filter, nis, ...[headline, parameters, influence, endpoints, trajectories, errors, residuals, observability, correlation].map(ofCalibration), provenance];
const together = [filters, accuracy, fromAbove, errorAlong, nees];

function titleOf({ run, health: info, calibration, label }) {
  const name = run?.recording?.name ?? info?.name;
  if (name) return text.titles.report(name);
  if (calibration) return text.titles.calibration(calibration.robot.name || text.titles.robot);
  return text.titles.report(label || text.titles.robot);
}

// Its heading, and what is drawn below it.
function articleOf(result, index, alone) {
  const id = `result-${index + 1}`;
  const title = titleOf(result);
  const heading = html(alone ? 'h1' : 'h2', { id: `${id}-title`, class: 'title' }, shortened(title, 80));
  const subtitle = alone ? null : html('p', { class: 'from' }, nameOf(result.label, 80));
  const article = html('article', { id, 'aria-labelledby': `${id}-title` }, heading, subtitle);
  return { article, title, first: () => firstScreen(result), sections: () => figures.map((figure) => figure([result])).filter(Boolean) };
}

function link(target, words) {
  return html('a', { href: `#${target}` }, words);
}

// Which program drew this page, and from which files.
function madeBy(made) {
  if (!made) return null;
  const files = made.inputs.map(({ path, sha256 }) => html('li', {}, html('span', { class: 'path' }, shortened(path, 120)), ' ', html('code', {}, sha256)));
  return html('footer', {}, html('details', {}, html('summary', {}, text.provenance.drawnBy(made.program, made.version, files.length)), html('ul', {}, files)));
}

// An empty place that becomes what it stands for when it comes into view; where it was in view before, at once.
const seen = new Set();
function later(name, draw) {
  if (seen.has(name)) return draw();
  const place = html('div', { class: 'later' });
  whenSeen(place, () => {
    seen.add(name);
    place.replaceWith(...draw());
  });
  return [place];
}

function figuresOfAll(results) {
  const ofCalibrations = (all) => comparison(all.filter(({ calibration }) => calibration));
  return [ofCalibrations, ...together].flatMap((figure, index) => later(`figure ${index}`, () => [figure(results)].filter(Boolean)));
}

// Puts up the headings, of one result its first screen, and returns what draws the rest.
function show(report, results) {
  forgetListeners();
  forgetSections();
  const alone = results.length === 1;
  const shown = results.map((result, index) => articleOf(result, index, alone));
  const title = alone ? null : html('h1', { class: 'title' }, text.titles.compare);
  const side = html('div');
  document.title = alone ? shortened(shown[0].title, 80) : text.titles.compare;
  document.getElementById('report').replaceChildren(...[title, side, ...shown.map(({ article }) => article), madeBy(report.provenance)].filter(Boolean));
  if (alone) shown[0].article.append(shown[0].first());
  return () => {
    const contents = document.getElementById('contents');
    if (alone) {
      const sections = shown[0].sections();
      shown[0].article.append(...sections);
      contents.replaceChildren(...sections.filter((node) => node.inContents).map((node) => link(node.id, node.inContents)));
      return;
    }
    side.append(...figuresOfAll(results));
    for (const { article, first, sections } of shown) article.append(...later(article.id, () => [first(), ...sections()]));
    contents.replaceChildren(...results.map(({ label }, index) => link(`result-${index + 1}`, shortened(label, 28))));
  };
}

// Units or colours have changed, or it goes to paper: all at once.
function showAnew(report, results) {
  const scrolled = scrollY;
  show(report, results)();
  if ('paper' in document.documentElement.dataset) drawUnseen();
  fitAll();
  scrollTo({ top: scrolled, behavior: 'instant' });
}

document.documentElement.lang = text.language;
const report = JSON.parse(document.getElementById('data').textContent);
const results = report.results.map(prepared);
document.getElementById('controls').replaceChildren(controls());
onSettings(() => showAnew(report, results));
const drawRest = show(report, results);
soon(() => setTimeout(() => soon(drawRest))); // the first screen is on the glass by then
