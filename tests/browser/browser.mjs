// A browser, pages in it that remember what went wrong, and pictures counted by their pixels.
import { createRequire } from 'node:module';
import { readFileSync } from 'node:fs';
import { pathToFileURL } from 'node:url';

const require = createRequire(`${process.env.TRUNDLE_BROWSER_WORK}/package.json`);
const { chromium } = require('playwright-core');
export const axe = readFileSync(require.resolve('axe-core/axe.min.js'), 'utf8');

export async function launch() {
  const asRoot = process.getuid?.() === 0;
  return chromium.launch({ executablePath: process.env.CHROMIUM, args: asRoot ? ['--no-sandbox'] : [] });
}

// A warning that the tests themselves cause.
const readsPixels = /willReadFrequently/;

// Opens a file; the page carries `troubles` (errors and warnings of the console) and `requests` (all but the file itself).
export async function open(browser, file, { width = 1280, height = 900, colorScheme = 'light' } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, colorScheme, acceptDownloads: true, reducedMotion: 'reduce' });
  const page = await context.newPage();
  page.setDefaultTimeout(30000);
  page.troubles = [];
  page.requests = [];
  const address = pathToFileURL(file).href;
  page.on('console', (message) => ['error', 'warning'].includes(message.type()) && !readsPixels.test(message.text()) && page.troubles.push(message.text()));
  page.on('pageerror', (error) => page.troubles.push(error.stack));
  page.on('request', (request) => request.url() !== address && page.requests.push(request.url()));
  await page.goto(address);
  await drawn(page);
  return page;
}

// Plots draw in the frames after they get their size.
export async function drawn(page) {
  await page.evaluate(() => new Promise((done) => {
    let frames = 4;
    const next = () => {
      if (!document.documentElement.hasAttribute('data-drawing')) frames -= 1;
      return frames > 0 ? requestAnimationFrame(next) : done();
    };
    next();
  }));
}

// From top to bottom, as a reader: what comes into view is drawn.
export async function readThrough(page) {
  for (let before = -1, top = 0; top > before; before = top, top = await page.evaluate(() => scrollY)) {
    await page.evaluate(() => scrollBy({ top: innerHeight / 2, behavior: 'instant' }));
    await drawn(page);
  }
}

// Of a picture's pixels the share that differ from its first one, and the share that are black: the page has no black of
// its own, but what lost its colour is black.
export async function inkIn(page, picture, type = 'image/png') {
  return page.evaluate(async (address) => {
    const image = new Image();
    image.src = address;
    await image.decode();
    const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight);
    const pen = canvas.getContext('2d');
    pen.drawImage(image, 0, 0);
    const pixels = new Uint32Array(pen.getImageData(0, 0, canvas.width, canvas.height).data.buffer);
    let [drawn, black] = [0, 0];
    for (let i = 0; i < pixels.length; i += 1) {
      if (pixels[i] !== pixels[0]) drawn += 1;
      if (pixels[i] === 0xff000000) black += 1;
    }
    return { drawn: drawn / pixels.length, black: black / pixels.length };
  }, `data:${type};base64,${picture.toString('base64')}`);
}

// How many pixels of a canvas are drawn at all, and how many in the colour of that name (or near it).
export async function pixelsOf(canvas, name = 'ink') {
  return canvas.evaluate((node, colourName) => {
    const probe = document.createElement('i');
    probe.style.color = `var(--${colourName})`;
    document.body.append(probe);
    const [red, green, blue] = getComputedStyle(probe).color.match(/[\d.]+/g).map(Number);
    probe.remove();
    const { data } = node.getContext('2d').getImageData(0, 0, node.width, node.height);
    let [any, coloured] = [0, 0];
    for (let i = 0; i < data.length; i += 4) {
      if (data[i + 3] === 0) continue;
      any += 1;
      if (Math.abs(data[i] - red) + Math.abs(data[i + 1] - green) + Math.abs(data[i + 2] - blue) < 60) coloured += 1;
    }
    return { any, coloured, share: any / (node.width * node.height) };
  }, name);
}
