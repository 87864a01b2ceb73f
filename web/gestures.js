// Pan and zoom by pointer, wheel and keyboard, for charts and maps. The wheel zooms with Ctrl, or when the plot has the
// focus; else the page scrolls.

const keys = {
  ArrowLeft: (moves) => moves.pan(-0.15, 0), ArrowRight: (moves) => moves.pan(0.15, 0),
  ArrowUp: (moves) => moves.pan(0, -0.15), ArrowDown: (moves) => moves.pan(0, 0.15),
  '+': (moves) => moves.zoom(1.4), '=': (moves) => moves.zoom(1.4), '-': (moves) => moves.zoom(1 / 1.4), 0: (moves) => moves.reset(),
};

function between(pointers) {
  const [a, b] = [...pointers.values()];
  return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, distance: Math.hypot(a.x - b.x, a.y - b.y) };
}

// `moves`: pan(dx, dy) in shares of the plot, zoom(factor, at?) around {x, y} in shares, reset(), tap?(at).
export function listen(node, focusable, moves) {
  const pointers = new Map();
  let moved = 0;
  const share = (event) => {
    const box = node.getBoundingClientRect();
    return { x: (event.clientX - box.left) / box.width, y: (event.clientY - box.top) / box.height };
  };
  node.addEventListener('wheel', (event) => {
    if (!event.ctrlKey && !event.metaKey && document.activeElement !== focusable) return;
    event.preventDefault();
    moves.zoom(Math.exp(-Math.sign(event.deltaY) * Math.min(0.5, Math.abs(event.deltaY) / 300)), share(event));
  }, { passive: false });
  node.addEventListener('pointerdown', (event) => {
    if (event.button !== 0) return;
    pointers.set(event.pointerId, share(event));
    moved = 0;
    if (event.pointerType === 'mouse') node.setPointerCapture(event.pointerId);
  });
  node.addEventListener('pointermove', (event) => {
    if (!pointers.has(event.pointerId)) return;
    const last = pointers.get(event.pointerId);
    const now = share(event);
    const before = pointers.size === 2 ? between(pointers) : null;
    pointers.set(event.pointerId, now);
    moved += Math.hypot(now.x - last.x, now.y - last.y);
    if (before) {
      const after = between(pointers);
      moves.zoom(after.distance / Math.max(1e-6, before.distance), after);
    } else if (moved > 0.006) moves.pan(last.x - now.x, last.y - now.y);
  });
  const release = (event) => {
    if (pointers.delete(event.pointerId) && moved <= 0.006 && event.type === 'pointerup' && moves.tap) moves.tap(share(event));
  };
  node.addEventListener('pointerup', release);
  node.addEventListener('pointercancel', release);
  node.addEventListener('dblclick', () => moves.reset());
  focusable.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
    event.preventDefault();
    keys[event.key](moves);
  });
}
