// Drags, wheel, two fingers and keys on the picture, in CSS pixels.

const KEY_PIXELS = 16;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** `hands` has turn(right, down), sun(right, down), pan(right, down), zoom(factor), reset(), hover(x, y), leave() and dragsSun(). */
export function listen(canvas, hands) {
  const fingers = new Map();

  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, event);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) {
      const box = canvas.getBoundingClientRect();
      hands.hover((event.clientX - box.x) / box.width, (event.clientY - box.y) / box.height);
      return;
    }
    const [right, down] = [event.clientX - before.clientX, event.clientY - before.clientY];
    if (fingers.size === 2) {
      const [a, b] = fingers.values();
      const other = a.pointerId === event.pointerId ? b : a;
      const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
      hands.zoom(Math.max(apart(before), 1) / Math.max(apart(event), 1));
      // Each finger moves the middle by half of its way.
      hands.pan(right / 2, down / 2);
    } else if (fingers.size === 1) {
      // As in the native window: the left button turns the view, the middle one moves it, the right one turns the sun.
      if (before.button === 1 || (before.button === 0 && event.shiftKey)) hands.pan(right, down);
      else if (before.button === 2 || event.ctrlKey || hands.dragsSun()) hands.sun(right, down);
      else hands.turn(right, down);
    }
    // The button of a drag is that of its beginning.
    fingers.set(event.pointerId, {
      pointerId: event.pointerId, button: before.button, clientX: event.clientX, clientY: event.clientY,
    });
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
  }
  canvas.addEventListener("pointerleave", () => hands.leave());
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      // Lines, where a mouse counts in them, are about 16 pixels high.
      hands.zoom(Math.exp((event.deltaMode === 1 ? 16 : 1) * event.deltaY * 1e-3));
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (event) => {
    const arrow = ARROWS[event.key];
    if (event.altKey || event.metaKey || event.ctrlKey) return;
    if (arrow) (event.shiftKey ? hands.sun : hands.turn)(KEY_PIXELS * arrow[0], KEY_PIXELS * arrow[1]);
    else if (event.key === "+" || event.key === "=") hands.zoom(1 / 1.15);
    else if (event.key === "-") hands.zoom(1.15);
    else if (event.key === "r" || event.key === "R") hands.reset();
    else return;
    event.preventDefault();
  });
}
