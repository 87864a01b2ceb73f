// Puts the page together: for each result its figures in order. A new kind of result is one more entry in `kinds`.
import { html, nameOf, shortened } from './dom.js';
import { comparison } from './figures/comparison.js';
import { correlation } from './figures/correlation.js';
import { endpoints } from './figures/endpoints.js';
import { errors } from './figures/errors.js';
import { headline } from './figures/headline.js';
import { observability } from './figures/observability.js';
import { parameters } from './figures/parameters.js';
import { provenance } from './figures/provenance.js';
import { residuals } from './figures/residuals.js';
import { trajectories } from './figures/trajectories.js';

const kinds = {
  'trundle-calibration': {
    title: (document) => `Calibration of ${document.robot.name || 'a robot'}`,
    figures: [headline, parameters, endpoints, trajectories, errors, residuals, observability, correlation, provenance],
  },
};

function articleOf({ label, document }, index, alone) {
  const kind = kinds[document.format];
  const title = kind.title(document);
  const sections = kind.figures.map((figure) => figure(document)).filter(Boolean);
  const id = `result-${index + 1}`;
  const heading = html(alone ? 'h1' : 'h2', { id: `${id}-title`, class: 'title' }, shortened(title, 80));
  const subtitle = alone ? null : html('p', { class: 'from' }, nameOf(label, 80));
  const article = html('article', { id, 'aria-labelledby': `${id}-title` }, heading, subtitle, sections);
  return { article, sections, title };
}

function link(target, text) {
  return html('a', { href: `#${target}` }, text);
}

// Which program drew this page, and from which files.
function madeBy(provenance) {
  if (!provenance) return null;
  const { program, version, inputs } = provenance;
  const files = inputs.map(({ path, sha256 }) => html('li', {}, html('span', { class: 'path' }, shortened(path, 120)), ' ', html('code', {}, sha256)));
  return html('footer', {}, html('p', {}, `Drawn by ${program} ${version} from`), html('ul', {}, files));
}

function show(page) {
  const alone = page.results.length === 1;
  const shown = page.results.map((result, index) => articleOf(result, index, alone));
  const compared = comparison(page.results.filter((result) => result.document.format === 'trundle-calibration'));
  const title = alone ? null : html('h1', { class: 'title' }, 'Results side by side');
  document.title = alone ? shortened(shown[0].title, 80) : title.textContent;
  document.getElementById('report').replaceChildren(...[title, compared, ...shown.map(({ article }) => article), madeBy(page.provenance)].filter(Boolean));
  const links = alone ? shown[0].sections.filter((node) => node.inContents).map((node) => link(node.id, node.inContents))
    : page.results.map(({ label }, index) => link(`result-${index + 1}`, shortened(label, 28)));
  document.getElementById('contents').replaceChildren(...links);
}

show(JSON.parse(document.getElementById('data').textContent));
