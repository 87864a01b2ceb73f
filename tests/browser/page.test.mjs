// What a person does with the report page, done in a real browser.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, describe, test } from 'node:test';
import { axe, drawn, inkIn, launch, open, pixelsOf, readThrough } from './browser.mjs';
import { makePages } from './pages.mjs';

let browser;
let pages;
let demo; // for those who only read
const loud = (page) => [page.troubles, page.requests];
const silent = [[], []];

before(async () => {
  pages = makePages();
  browser = await launch();
  demo = await open(browser, pages.demo);
});
after(() => browser?.close());

// A page of its own for each test, closed after it, and silent all the while.
function look(name, file, options, body) {
  test(name, async () => {
    const page = await open(browser, pages[file], options);
    await body(page);
    assert.deepEqual(loud(page), silent);
    await page.context().close();
  });
}

// A test that only reads, wherever the page is scrolled to: all of them share one, which takes seconds to open.
function read(name, body) {
  test(name, async () => {
    await body(demo);
    assert.deepEqual(loud(demo), silent);
  });
}

const section = (page, title) => page.locator('section', { has: page.getByRole('heading', { level: 3, name: title, exact: true }) });

const sections = ['Health of the recording', 'Trajectories from above', 'Trajectories against the reference', 'Error along the way',
  'Is the stated uncertainty consistent? (NEES)', 'Slip over time', 'What clean driving looks like', 'Gyro bias', 'Effective particles',
  'Do sightings agree with the filter? (NIS)', 'Calibration', 'Notes', 'Parameters', 'Convergence with the number of runs', 'End points of the closed runs', 'Runs of the calibration',
  'Errors before and after', 'Residual of each training run', 'Observability', 'Correlation of the estimates', 'Where this comes from'];

describe('the report page', { concurrency: 3 }, () => {
  look('the first screen says what was asked, the answers and what needs attention', 'demo', {}, async (page) => {
    const first = page.locator('.first-screen');
    assert.match(await page.locator('h1').innerText(), /slip/);
    assert.match(await first.locator('.from').innerText(), /data\/demo\/slip/);
    assert.doesNotMatch(await first.locator('.tile', { hasText: 'Position error' }).innerText(), /calibrated on/);
    assert.equal(await first.locator('.tile').count(), 5);
    assert.match(await first.locator('.tiles').innerText(), /±/);
    assert.match(await first.locator('.callout').innerText(), /wheel is .* smaller than/);
    assert.match(await first.locator('.tile', { hasText: 'Wheel diameters' }).innerText(), /left \d+\.\d+ ± \d+\.\d+ mm\s+right \d+\.\d+ ± \d+\.\d+ mm/);
    assert.match(await first.locator('.callout').innerText(), /In the mean the wheels are .* % (smaller|larger) \(± .* σ away: left /);
    const { y, height } = await first.locator('.callout').boundingBox();
    assert.ok(y + height <= 900, 'without scrolling');
  });

  look('an Allan deviation of zero throughout is a chart without a curve', 'still', {}, async (page) => {
    await section(page, 'Gyro bias').locator('figure').scrollIntoViewIfNeeded();
    await drawn(page);
    assert.equal(await section(page, 'Gyro bias').locator('h4').count(), 1);
  });

  for (const colorScheme of ['light', 'dark']) {
    look(`every section is drawn, ${colorScheme}`, 'demo', { colorScheme }, async (page) => {
      assert.deepEqual(await page.locator('section h3').allInnerTexts(), sections);
      for (const title of sections) {
        const figure = section(page, title).locator('figure');
        await figure.scrollIntoViewIfNeeded();
        await drawn(page);
        assert.ok((await inkIn(page, await figure.screenshot())).drawn > 0.01, title);
        assert.ok((await figure.locator('figcaption').innerText()).length > 20, `${title} says how to read it`);
        for (const canvas of await figure.locator('canvas:not(.moving)').all()) assert.ok((await pixelsOf(canvas)).share > 0.005, title);
      }
    });
  }

  read('the map shows tracks, landmarks and slips', async (page) => {
    const still = page.locator('canvas.still');
    for (const colour of ['reference', 'track-nominal', 'track-corrected', 'track-smoothed', 'landmark', 'slip']) {
      const { coloured } = await pixelsOf(still, colour);
      assert.ok(coloured > 30, `${colour}: ${coloured} pixels`);
    }
  });

  look('the online estimate plays as it grew', 'grown', {}, async (page) => {
    const figure = section(page, 'The online estimate as it grew');
    await figure.scrollIntoViewIfNeeded();
    await drawn(page);
    const [slider, readout, canvas] = [figure.locator('input'), figure.locator('output'), figure.locator('.growth canvas')];
    const end = (await pixelsOf(canvas, 'track-online')).coloured;
    assert.ok((await pixelsOf(canvas, 'landmark')).coloured > 30);
    await slider.focus();
    await page.keyboard.press('Home');
    assert.match(await readout.innerText(), /^t 0\.0 s · 12 landmarks$/);
    const start = (await pixelsOf(canvas, 'track-online')).coloured;
    assert.ok(start > 10 && start < end / 4, `${start} of ${end}`);
    await figure.getByRole('button', { name: 'Play' }).click();
    const frames = await page.evaluate(async () => {
      const times = [];
      for (let last = performance.now(), end = last + 3000; last < end;) {
        await new Promise(requestAnimationFrame);
        const now = performance.now();
        times.push(now - last);
        last = now;
      }
      return times.sort((a, b) => a - b);
    });
    assert.ok(frames[frames.length >> 1] < 50, `a frame takes ${frames[frames.length >> 1]} ms`);
    await figure.getByRole('button', { name: 'Pause' }).click();
    const stopped = await readout.innerText();
    assert.ok(Number(/^t ([\d.]+)/.exec(stopped)[1]) > 10, stopped);
    await page.waitForTimeout(200);
    assert.equal(await readout.innerText(), stopped);
  });

  look('the estimates of several robots play side by side', 'team', {}, async (page) => {
    const figure = section(page, 'The online estimate as it grew');
    await figure.scrollIntoViewIfNeeded();
    await drawn(page);
    const [slider, readout, canvas] = [figure.locator('input'), figure.locator('output'), figure.locator('.growth canvas')];
    assert.match(await readout.innerText(), /^t [\d.]+ s · tour: 12 landmarks · tour_2: 12 landmarks$/);
    const coloured = async () => [(await pixelsOf(canvas, 'result-0')).coloured, (await pixelsOf(canvas, 'result-1')).coloured];
    const end = await coloured();
    await slider.focus();
    await page.keyboard.press('Home');
    const start = await coloured();
    for (const robot of [0, 1]) assert.ok(start[robot] > 10 && start[robot] < end[robot], `${start} of ${end}`);
  });

  look('the cursor is shared by all plots', 'demo', {}, async (page) => {
    const chart = section(page, 'Slip over time').locator('.u-over');
    await chart.scrollIntoViewIfNeeded();
    const moving = page.locator('canvas.moving');
    assert.equal((await pixelsOf(moving)).any, 0);
    await chart.hover();
    await drawn(page);
    const others = await page.locator('.u-cursor-x').evaluateAll((lines) => lines.map((line) => line.getBoundingClientRect().x - line.parentNode.getBoundingClientRect().x));
    const inside = others.filter((x) => x > 20);
    assert.ok(inside.length >= 6, `cursors at ${others}`);
    assert.ok((await pixelsOf(moving)).any > 50, 'the robot on the map');
    assert.match(await section(page, 'Gyro bias').locator('.readout').first().innerText(), /^t \d/);
  });

  look('the window of time is shared by plots over time, by keyboard too', 'demo', {}, async (page) => {
    const slip = section(page, 'Slip over time').locator('.chart');
    const bias = section(page, 'Gyro bias').locator('.chart').first().locator('canvas');
    const picture = async () => {
      await bias.scrollIntoViewIfNeeded();
      await drawn(page);
      return bias.evaluate((canvas) => canvas.toDataURL());
    };
    const before = await picture();
    await slip.focus();
    await page.keyboard.press('+');
    await page.keyboard.press('ArrowRight');
    assert.notEqual(await picture(), before);
    await slip.focus();
    await page.keyboard.press('0');
    assert.equal(await picture(), before);
  });

  for (const [name, press] of Object.entries({
    'in the table': async (page) => page.locator('.show-slip').nth(2).click(),
    'in the plot': async (page) => {
      const over = section(page, 'Slip over time').locator('.u-over');
      await over.scrollIntoViewIfNeeded();
      const { x, y, width, height } = await over.boundingBox();
      await page.mouse.click(x + (20.4 / 92.8) * width, y + height / 2); // the slip of the left wheel
    },
  })) {
    look(`a slip pressed ${name} moves the map there`, 'demo', {}, async (page) => {
      const still = page.locator('canvas.still');
      const before = await pixelsOf(still, 'slip');
      await press(page);
      await drawn(page);
      const after = await pixelsOf(still, 'slip');
      assert.ok(after.coloured > 2 * before.coloured + 100, `${before.coloured} -> ${after.coloured} pixels of slip`);
      assert.ok((await pixelsOf(page.locator('canvas.moving'))).any > 50, 'with the robot on it');
    });
  }

  look('the wheel zooms with Ctrl, and dragging moves', 'demo', {}, async (page) => {
    const still = page.locator('canvas.still');
    const picture = () => still.evaluate((canvas) => canvas.toDataURL());
    await still.scrollIntoViewIfNeeded();
    const { x, y, width, height } = await page.locator('.map').boundingBox();
    const whole = await picture();
    await page.mouse.move(x + width / 2, y + height / 2);
    await page.keyboard.down('Control');
    await page.mouse.wheel(0, -300);
    await page.keyboard.up('Control');
    await drawn(page);
    const zoomed = await picture();
    assert.notEqual(zoomed, whole);
    await page.mouse.down();
    await page.mouse.move(x + width / 2 + 80, y + height / 2, { steps: 4 });
    await page.mouse.up();
    await drawn(page);
    assert.notEqual(await picture(), zoomed);
    await section(page, 'Trajectories from above').getByRole('button', { name: 'Show all' }).click();
    await drawn(page);
    assert.equal(await picture(), whole);
  });

  // A browser takes ten downloads a second at most.
  async function saved(page, button) {
    await new Promise((done) => { setTimeout(done, 110); });
    const [download] = await Promise.all([page.waitForEvent('download'), button.click()]);
    return { name: download.suggestedFilename(), content: readFileSync(await download.path()) };
  }

  async function checkSaved(page, kind, { name, content }) {
    assert.match(name, new RegExp(`^[a-z0-9-]+\\.${kind.toLowerCase()}$`));
    if (kind === 'CSV') {
      const [head, ...rows] = content.toString().trim().split('\n');
      assert.ok(head.includes(',') && rows.length > 0, name);
      return;
    }
    const type = kind === 'PNG' ? 'image/png' : 'image/svg+xml';
    const ink = await inkIn(page, content, type);
    assert.ok(ink.drawn > 0.003 && ink.black < 0.001, `${name}: ${JSON.stringify(ink)}`);
    if (kind === 'SVG') assert.equal(await page.evaluate((text) => new DOMParser().parseFromString(text, 'image/svg+xml').querySelectorAll('parsererror, script').length, content.toString()), 0);
  }

  for (const kind of ['PNG', 'SVG', 'CSV']) {
    look(`everything is saved as ${kind}, and opens`, 'demo', {}, async (page) => {
      await page.locator('details').evaluateAll((all) => all.forEach((one) => { one.open = true; }));
      await drawn(page);
      const buttons = await page.getByRole('button', { name: new RegExp(`as ${kind}$`) }).all();
      assert.ok(buttons.length >= 10, `${buttons.length} buttons`);
      for (const button of buttons) await checkSaved(page, kind, await saved(page, button));
    });
  }

  look('a chart is saved with its curves', 'demo', {}, async (page) => {
    const { content } = await saved(page, page.getByRole('button', { name: 'Save “Error along the way” as SVG' }));
    const curves = content.toString().match(/<path d="[^"]{2000,}" fill="none"/g);
    const errors = await page.evaluate(() => JSON.parse(document.getElementById('data').textContent).results.flatMap((result) => result.errors));
    assert.ok(errors.length >= 4);
    assert.equal(curves.length, errors.length);
  });

  look('hostile names are text', 'hostile', {}, async (page) => {
    assert.equal(await page.evaluate(() => window.hacked), undefined);
    assert.equal(await page.locator('img, main script, iframe, object').count(), 0);
    assert.match(await page.locator('h1').innerText(), /<\/script><script>/);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'nothing sticks out');
    for (const button of await page.getByRole('button', { name: /as CSV$/ }).all()) if (await button.isVisible()) await checkSaved(page, 'CSV', await saved(page, button));
  });

  look('units follow the reader', 'demo', {}, async (page) => {
    const tile = page.locator('.tile', { hasText: 'rack' });
    const metric = await tile.innerText();
    assert.deepEqual(await page.getByLabel('Lengths').locator('option').allInnerTexts(), ['mm and m', 'inches']);
    assert.match(metric, /mm/);
    await page.getByLabel('Lengths').selectOption('imperial');
    assert.match(await page.locator('.tile', { hasText: 'rack' }).innerText(), / in\b/);
    await page.getByLabel('Angles').selectOption('radians');
    assert.match(await section(page, 'Parameters').innerText(), /rad\/s/);
    await page.getByLabel('Colours').selectOption('dark');
    assert.equal(await page.evaluate(() => getComputedStyle(document.documentElement).colorScheme), 'dark');
    await page.getByLabel('Lengths').selectOption('metric');
    assert.equal(await page.locator('.tile', { hasText: 'rack' }).innerText(), metric);
  });

  for (const [name, file, options] of [['light', 'demo', {}], ['dark', 'demo', { colorScheme: 'dark' }], ['narrow', 'demo', { width: 360, height: 740 }], ['several results', 'two', {}]]) {
    look(`nothing serious for those who see or move differently: ${name}`, file, options, async (page) => {
      await readThrough(page);
      await page.evaluate(axe);
      const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ['violations'] }));
      const serious = violations.filter(({ impact }) => ['serious', 'critical'].includes(impact));
      assert.deepEqual(serious.map(({ id, nodes }) => `${id}: ${nodes.slice(0, 3).map(({ html }) => html.slice(0, 160)).join(' | ')}`), []);
    });
  }

  look('a narrow window is usable', 'demo', { width: 360, height: 740 }, async (page) => {
    const wide = await page.evaluate(() => [...document.querySelectorAll('main *')].filter((node) => !node.closest('.scrolling, pre, svg') && node.getBoundingClientRect().right > innerWidth + 1).map((node) => node.outerHTML.slice(0, 120)));
    assert.deepEqual(wide, []);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
    for (const canvas of await page.locator('canvas:not(.moving)').all()) assert.ok((await pixelsOf(canvas)).share > 0.005);
  });

  look('paper: white, without controls, nothing cut off', 'demo', { colorScheme: 'dark' }, async (page) => {
    const pdf = await page.pdf({ format: 'A4' });
    assert.equal(pdf.subarray(0, 5).toString(), '%PDF-');
    await page.setViewportSize({ width: 720, height: 1000 }); // of an A4 sheet within its margins
    await page.emulateMedia({ media: 'print' });
    // What is not drawn at once is not on the paper.
    const blank = await page.evaluate(async () => {
      dispatchEvent(new Event('beforeprint'));
      await null;
      return [...document.querySelectorAll('canvas:not(.moving)')].filter((node) => !node.getContext('2d').getImageData(0, 0, node.width, node.height).data.some((value) => value !== 0)).length
        + [...document.querySelectorAll('.drawing')].filter((node) => !node.firstElementChild).length;
    });
    assert.equal(blank, 0);
    for (const hidden of ['nav', '#controls', '.tools']) assert.equal(await page.locator(hidden).first().isVisible(), false, hidden);
    assert.equal(await page.evaluate(() => getComputedStyle(document.body).backgroundColor), 'rgb(255, 255, 255)');
    const cut = await page.evaluate(() => [...document.querySelectorAll('main canvas, main table, main svg')].filter((node) => node.getBoundingClientRect().right > innerWidth + 1).map((node) => node.parentNode.outerHTML.slice(0, 120)));
    assert.deepEqual(cut, []);
  });

  look('one run alone: no section that needs several', 'alone', {}, async (page) => {
    const titles = await page.locator('section h3').allInnerTexts();
    assert.ok(titles.includes('Parameters'));
    assert.match(await page.locator('.first-screen .tile', { hasText: 'Position error' }).innerText(), /on the run it was calibrated on/);
    for (const title of ['Residual of each training run', 'Convergence with the number of runs']) assert.ok(!titles.includes(title), title);
  });

  read('one clock, that of the files, and it is named', async (page) => {
    assert.match(await page.locator('.first-screen').innerText(), /Times are the recording’s own stamps/);
    const slips = await page.evaluate(() => JSON.parse(document.getElementById('data').textContent).results[0].slip.events.map((event) => event.start_s));
    const starts = await section(page, 'Slip over time').locator('tbody tr td:first-child').allInnerTexts();
    assert.deepEqual(starts, slips.map((start) => `${start.toFixed(2)} s`));
  });

  read('what covariances are judged by is said', async (page) => {
    assert.match(await section(page, 'Trajectories against the reference').innerText(), /count the noise that recording\.toml states of the reference: 1\.?0* mm/);
    assert.match(await section(page, 'Is the stated uncertainty consistent? (NEES)').innerText(), /judged from where it moves/);
  });

  read('brackets at a NEES mean one thing: what is expected', async (page) => {
    const accuracy = section(page, 'Trajectories against the reference');
    assert.match(await accuracy.locator('thead').innerText(), /NEES \(expected\)/);
    for (const cell of await accuracy.locator('td[data-head^=NEES]').allInnerTexts()) assert.match(cell, /^(\d[\d.]* \(3\)|–)$/);
    const errors = section(page, 'Errors before and after');
    assert.match(await errors.locator('thead').innerText(), /NEES\s+NEES without parameters/);
    for (const cell of await errors.locator('td[data-head^=NEES]').allInnerTexts()) assert.match(cell, /^(\d[\d.]*|–)$/);
  });

  read('what slip the sensors cannot see stands under its heading', async (page) => {
    const note = section(page, 'Slip over time').getByRole('note');
    assert.equal(await note.locator('h4').innerText(), 'What these sensors cannot see or tell apart');
    const all = await page.evaluate(() => JSON.parse(document.getElementById('data').textContent).results[0].slip.cannot_see);
    assert.ok(all.length > 0);
    assert.deepEqual(await note.locator('li').allInnerTexts(), all);
  });

  look('the bias fills its plot, though its band is wide before the first rest', 'demo', {}, async (page) => {
    const { content } = await saved(page, page.getByRole('button', { name: 'Save “Gyro bias” as SVG' }));
    const band = content.toString().match(/<path d="([^"]+)"[^>]*fill-opacity="0\.15"/)[1]; // there along its lower edge, back along its upper
    const heights = [...band.matchAll(/[ML][\d.]+[ ,]([\d.]+)/g)].map(([, y]) => Number(y));
    const last = heights.length / 2;
    const [wide, plot] = [Math.abs(heights[last - 1] - heights[last]), Math.max(...heights) - Math.min(...heights)];
    assert.ok(wide > 0.2 * plot, `at the end ${wide} pixels of ${plot}`);
  });

  look('the nominal odometry has its 95 % when they are chosen', 'demo', {}, async (page) => {
    const still = page.locator('canvas.still');
    const bands = page.getByRole('button', { name: '95 % of nominal odometry' });
    assert.equal(await bands.getAttribute('aria-pressed'), 'false');
    const picture = () => still.evaluate((canvas) => canvas.toDataURL());
    const before = await picture();
    await bands.click();
    await drawn(page);
    assert.equal(await bands.getAttribute('aria-pressed'), 'true');
    assert.notEqual(await picture(), before);
    await bands.click();
    await drawn(page);
    assert.equal(await picture(), before);
  });

  read('the correlation has a cell for every pair', async (page) => {
    const figure = section(page, 'Correlation of the estimates');
    await figure.scrollIntoViewIfNeeded();
    await drawn(page);
    const { names } = await page.evaluate(() => JSON.parse(document.getElementById('data').textContent).results[0].calibration.correlation);
    assert.ok(names.length >= 2);
    assert.equal(await figure.locator('.cell').count(), names.length ** 2);
  });

  look('a track says what it is in proportion to, where nothing measured that', 'unmeasured', {}, async (page) => {
    assert.match(await page.locator('.tile', { hasText: 'Track width' }).innerText(), /taking the wheel diameters and the gyro scale as exact/);
  });

  read('a track says nothing of it where all was estimated', async (page) => {
    assert.doesNotMatch(await page.locator('.tile', { hasText: 'Track width' }).innerText(), /as exact/);
  });

  look('calibrations side by side have their ±', 'pair', {}, async (page) => {
    await readThrough(page);
    assert.match(await section(page, 'Parameters and errors').first().locator('tbody').first().innerText(), /\d ± \d/);
  });

  look('several results lie over each other', 'two', {}, async (page) => {
    assert.match(await page.locator('h1').innerText(), /side by side/);
    await readThrough(page);
    const still = page.locator('canvas.still').first();
    for (const colour of ['result-0', 'result-1']) assert.ok((await pixelsOf(still, colour)).coloured > 100, colour);
    assert.match(await section(page, 'Filter against filter').locator('tbody').innerText(), /fastslam2, 100 particles, seed 1[\s\S]*ekf/);
    const rows = section(page, 'Trajectories against the reference').first().locator('tbody tr');
    assert.ok(await rows.count() >= 6);
    const names = await rows.locator('td:first-child').allInnerTexts();
    assert.ok(names.every((name) => /^(demo|other): /.test(name)), names.join('; '));
  });

  look('of many results what is looked at is drawn, and on paper all', 'many', {}, async (page) => {
    const drawnOf = () => page.evaluate(() => [...document.querySelectorAll('article')].map((node) => node.querySelectorAll('section').length));
    assert.deepEqual(await drawnOf(), [0, 0, 0, 0, 0]);
    assert.ok(await page.evaluate(() => document.querySelectorAll('canvas').length) < 10);
    await page.locator('#contents a').last().click();
    await page.locator('#result-5 section').first().waitFor();
    await drawn(page);
    const [first, , , , last] = await drawnOf();
    assert.equal(first, 0);
    assert.ok(last > 5);
    const { y } = await page.locator('#result-5-title').boundingBox();
    assert.ok(y > -10 && y < 900, `the link leads there: ${y}`);
    await page.getByLabel('Lengths').selectOption('imperial');
    await drawn(page);
    assert.equal((await drawnOf())[4], last, 'what was drawn stays');
    assert.equal((await drawnOf())[0], 0, 'and nothing else is');
    await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
    assert.ok((await drawnOf()).every((count) => count > 5));
    assert.equal(await page.locator('.later').count(), 0);
  });
});
