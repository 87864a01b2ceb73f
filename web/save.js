// Figures and tables as files.
import { bytesOf } from './column.js';
import { html } from './dom.js';
import { colour } from './palette.js';

const kept = ['fill', 'fill-opacity', 'stroke', 'stroke-width', 'stroke-opacity', 'stroke-dasharray', 'stroke-linecap', 'stroke-linejoin',
  'opacity', 'font-size', 'font-family', 'font-weight', 'text-anchor'];

function offer(blob, name) {
  const address = URL.createObjectURL(blob);
  const link = html('a', { download: name });
  link.href = address;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

// A name that every file system takes.
export function fileName(title, extension) {
  const plain = title.toLowerCase().replace(/[^a-z0-9]+/g, '-').replace(/^-|-$/g, '').slice(0, 60);
  return `${plain || 'figure'}.${extension}`;
}

// A copy that needs no style sheet, on the page's ground. A drawing that is not in the page has no style but its own.
export function standalone(drawing) {
  const copy = drawing.cloneNode(true);
  if (drawing.isConnected) {
    const originals = [drawing, ...drawing.querySelectorAll('*')];
    const copies = [copy, ...copy.querySelectorAll('*')];
    originals.forEach((original, i) => {
      const style = getComputedStyle(original);
      for (const property of kept) copies[i].setAttribute(property, style.getPropertyValue(property));
      copies[i].removeAttribute('class');
    });
  }
  copy.setAttribute('xmlns', drawing.namespaceURI);
  copy.setAttribute('style', `background:${colour('ground')}`);
  return copy;
}

export function saveSvg(drawing, title) {
  const text = new XMLSerializer().serializeToString(standalone(drawing));
  offer(new Blob([text], { type: 'image/svg+xml' }), fileName(title, 'svg'));
}

export async function savePng(drawing, title) {
  const scale = 2;
  const text = new XMLSerializer().serializeToString(standalone(drawing));
  const picture = new Image();
  await new Promise((resolve, reject) => {
    picture.onload = resolve;
    picture.onerror = reject;
    picture.setAttribute('src', `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`);
  });
  const canvas = html('canvas', { width: scale * drawing.getAttribute('width'), height: scale * drawing.getAttribute('height') });
  const pen = canvas.getContext('2d');
  pen.fillStyle = colour('ground');
  pen.fillRect(0, 0, canvas.width, canvas.height);
  pen.drawImage(picture, 0, 0, canvas.width, canvas.height);
  const [, base64] = canvas.toDataURL('image/png').split(','); // toBlob would wait for an idle moment
  offer(new Blob([bytesOf(base64)], { type: 'image/png' }), fileName(title, 'png'));
}

function cell(text) {
  // A sheet must not take a name for a formula.
  const plain = /^[=+@\t]/.test(text) ? `'${text}` : text;
  return /[",\n]/.test(plain) ? `"${plain.replaceAll('"', '""')}"` : plain;
}

export function saveCsv(table, title) {
  const textOf = (node) => (node.dataset.value ?? node.textContent).trim().replaceAll('−', '-');
  const lines = [...table.rows].map((row) => [...row.cells].filter((node) => !node.classList.contains('picture')).map((node) => cell(textOf(node))).join(','));
  offer(new Blob([`${lines.join('\n')}\n`], { type: 'text/csv' }), fileName(title, 'csv'));
}
