// How fast a page is: node speed.mjs FILE. Prints the time to the first screen, to the map after one scrolls there, and
// frames a second while the map and charts are panned and zoomed, in software rendering; and what each costs in time of the processor, of all processes of the
// browser, for machines that have other work too.
import { readdirSync, readFileSync } from 'node:fs';
import { launch } from './browser.mjs';
import { pathToFileURL } from 'node:url';

// Milliseconds that this process's descendants have computed (Linux).
function computed() {
  const parents = new Map();
  const times = new Map();
  for (const id of readdirSync('/proc').filter((name) => /^\d+$/.test(name))) {
    try {
      const fields = readFileSync(`/proc/${id}/stat`, 'utf8').replace(/^.*\) /, '').split(' ');
      parents.set(id, fields[1]);
      times.set(id, 10 * (Number(fields[11]) + Number(fields[12])));
    } catch { /* it ended */ }
  }
  const ours = (id) => id !== undefined && (id === String(process.pid) || ours(parents.get(id)));
  return [...times].filter(([id]) => id !== String(process.pid) && ours(id)).reduce((sum, [, time]) => sum + time, 0);
}

const browser = await launch();
const before = computed();
const page = await (await browser.newContext({ viewport: { width: 1280, height: 900 } })).newPage();
await page.goto(pathToFileURL(process.argv[2]).href, { waitUntil: 'commit' });
await page.waitForSelector('.first-screen, main section', { timeout: 120000 });
await page.waitForFunction(() => !document.documentElement.hasAttribute('data-drawing'), null, { timeout: 120000 });
const drawn = await page.evaluate(() => new Promise((done) => { requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now()))); }));
const painted = await page.evaluate(() => performance.getEntriesByName('first-contentful-paint')[0]?.startTime);
console.log(`first contentful paint      ${painted?.toFixed(0)} ms`);
console.log(`first screen                ${drawn.toFixed(0)} ms, ${computed() - before} ms of the processor`);
const asked = Date.now();
await page.waitForFunction(() => { // what stands above the map is drawn on the way there
  (document.querySelector('.map') ?? [...document.querySelectorAll('.later')][0]).scrollIntoView({ behavior: 'instant' });
  return document.querySelector('canvas.still') && !document.documentElement.hasAttribute('data-drawing');
}, null, { timeout: 120000 });
console.log(`map, after scrolling there  ${Date.now() - asked} ms, ${computed() - before} ms of the processor in all`);

// Every frame one step; what counts is how many come in two seconds.
async function framesPerSecond(selector, keys) {
  if (await page.locator(selector).count() === 0) return 'not there';
  await page.locator(selector).first().scrollIntoViewIfNeeded();
  await page.locator(selector).first().focus();
  const start = computed();
  const { frames, seconds } = await page.evaluate(async (pressed) => {
    const node = document.activeElement;
    const start = performance.now();
    let frames = 0;
    while (performance.now() - start < 2000) {
      node.dispatchEvent(new KeyboardEvent('keydown', { key: pressed[frames % pressed.length], bubbles: true }));
      await new Promise(requestAnimationFrame);
      frames += 1;
    }
    return { frames, seconds: (performance.now() - start) / 1000 };
  }, keys);
  return `${(frames / seconds).toFixed(0)} frames/s, ${((computed() - start) / frames).toFixed(0)} ms of the processor each`;
}
const zooming = ['+', 'ArrowLeft', 'ArrowRight', '-'];
console.log(`map, pan and zoom           ${await framesPerSecond('.map', zooming)}`);
console.log(`slip over time, pan, zoom   ${await framesPerSecond('section:has(h3:text("Slip over time")) .chart', zooming)}`);
console.log(`error along the way         ${await framesPerSecond('section:has(h3:text("Error along the way")) .chart', zooming)}`);
await browser.close();
