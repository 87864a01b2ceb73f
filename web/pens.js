// Two pens with the same strokes: one draws on a canvas, one writes an SVG. Points are flat arrays [x0, y0, x1, y1, ...]
// in pixels; NaN lifts the pen.
import { svg } from './dom.js';

const plain = { colour: null, fill: null, width: 1, dash: [], opacity: 1, fillOpacity: 1 };

export function canvasPen(context) {
  const trace = (points, close) => {
    context.beginPath();
    let down = false;
    for (let i = 0; i < points.length; i += 2) {
      if (Number.isNaN(points[i])) down = false;
      else if (down) context.lineTo(points[i], points[i + 1]);
      else {
        context.moveTo(points[i], points[i + 1]);
        down = true;
      }
    }
    if (close) context.closePath();
  };
  const ink = (style) => {
    if (style.fill) {
      context.globalAlpha = style.opacity * style.fillOpacity;
      context.fillStyle = style.fill;
      context.fill();
    }
    if (style.colour) {
      context.globalAlpha = style.opacity;
      context.strokeStyle = style.colour;
      context.lineWidth = style.width;
      context.setLineDash(style.dash);
      context.stroke();
    }
    context.globalAlpha = 1;
  };
  return {
    clip({ left, top, right, bottom }) {
      context.save();
      context.beginPath();
      context.rect(left, top, right - left, bottom - top);
      context.clip();
    },
    unclip: () => context.restore(),
    line(points, given) {
      trace(points, false);
      ink({ ...plain, ...given, fill: null });
    },
    polygon(points, given) {
      trace(points, true);
      ink({ ...plain, ...given });
    },
    ellipse(x, y, major, minor, angle, given) {
      context.beginPath();
      context.ellipse(x, y, major, minor, angle, 0, 2 * Math.PI);
      ink({ ...plain, ...given });
    },
    text(x, y, words, { colour, align = 'left', size = 12, turn = 0 }) {
      context.save();
      context.translate(x, y);
      context.rotate(turn);
      context.fillStyle = colour;
      context.font = `${size}px system-ui, sans-serif`;
      context.textAlign = align;
      context.fillText(words, 0, 0);
      context.restore();
    },
  };
}

export function svgPen(picture) {
  let root = picture;
  const pathOf = (points, close) => {
    let path = '';
    let down = false;
    for (let i = 0; i < points.length; i += 2) {
      if (Number.isNaN(points[i])) down = false;
      else {
        path += `${down ? 'L' : 'M'}${points[i].toFixed(1)} ${points[i + 1].toFixed(1)}`;
        down = true;
      }
    }
    return close && path ? `${path}z` : path;
  };
  const inked = ({ colour, fill, width, dash, opacity, fillOpacity }) => ({
    fill: fill ?? 'none', 'fill-opacity': fill ? opacity * fillOpacity : null, stroke: colour ?? 'none', 'stroke-width': width,
    'stroke-opacity': opacity, 'stroke-dasharray': dash.length > 0 ? dash.join(' ') : null, 'stroke-linejoin': 'round' });
  return {
    clip({ left, top, right, bottom }) {
      root = svg('svg', { x: left, y: top, width: right - left, height: bottom - top, viewBox: `${left} ${top} ${right - left} ${bottom - top}` });
      picture.append(root);
    },
    unclip() {
      root = picture;
    },
    line: (points, given) => root.append(svg('path', { d: pathOf(points, false), ...inked({ ...plain, ...given, fill: null }) })),
    polygon: (points, given) => root.append(svg('path', { d: pathOf(points, true), ...inked({ ...plain, ...given }) })),
    ellipse: (x, y, rx, ry, angle, given) => root.append(svg('ellipse', { cx: x, cy: y, rx, ry, transform: `rotate(${(angle * 180) / Math.PI} ${x} ${y})`, ...inked({ ...plain, ...given }) })),
    text: (x, y, words, { colour, align = 'left', size = 12, turn = 0 }) => root.append(svg('text', { x, y, fill: colour, 'font-size': size, 'font-family': 'system-ui, sans-serif',
      'text-anchor': { left: 'start', center: 'middle', right: 'end' }[align], transform: turn ? `rotate(${(turn * 180) / Math.PI} ${x} ${y})` : null }, words)),
  };
}

// A drawing as an SVG of its own: `paint` gets the pen.
export function asSvg(width, height, paint, label) {
  const root = svg('svg', { width, height, viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': label });
  paint(svgPen(root));
  return root;
}
