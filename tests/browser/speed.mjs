// How fast a page is: node speed.mjs FILE. Prints the time to the first picture, and frames a second while the map and a
// chart are panned and zoomed, in software rendering.
import { launch } from './browser.mjs';
import { pathToFileURL } from 'node:url';

const browser = await launch();
const page = await (await browser.newContext({ viewport: { width: 1280, height: 900 } })).newPage();
const started = Date.now();
await page.goto(pathToFileURL(process.argv[2]).href, { waitUntil: 'commit' });
await page.waitForSelector('canvas.still', { timeout: 60000 });
const drawn = await page.evaluate(() => new Promise((done) => { requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now()))); }));
const painted = await page.evaluate(() => performance.getEntriesByName('first-contentful-paint')[0]?.startTime);
console.log(`first contentful paint      ${painted?.toFixed(0)} ms`);
console.log(`all figures drawn           ${drawn.toFixed(0)} ms   (whole load ${Date.now() - started} ms)`);

// Every frame one step; what counts is how many come in two seconds.
async function framesPerSecond(selector, keys) {
  await page.locator(selector).first().scrollIntoViewIfNeeded();
  await page.locator(selector).first().focus();
  return page.evaluate(async (pressed) => {
    const node = document.activeElement;
    const start = performance.now();
    let frames = 0;
    while (performance.now() - start < 2000) {
      node.dispatchEvent(new KeyboardEvent('keydown', { key: pressed[frames % pressed.length], bubbles: true }));
      await new Promise(requestAnimationFrame);
      frames += 1;
    }
    return (1000 * frames) / (performance.now() - start);
  }, keys);
}
const zooming = ['+', 'ArrowLeft', 'ArrowRight', '-'];
console.log(`map, pan and zoom           ${(await framesPerSecond('.map', zooming)).toFixed(0)} frames/s`);
console.log(`slip over time, pan, zoom   ${(await framesPerSecond('section:has(h3:text("Slip over time")) .chart', zooming)).toFixed(0)} frames/s`);
console.log(`error along the way         ${(await framesPerSecond('section:has(h3:text("Error along the way")) .chart', zooming)).toFixed(0)} frames/s`);
await browser.close();
