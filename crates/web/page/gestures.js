// Gestures on the picture: drags, wheel, two fingers and keys. Lengths are in CSS pixels. `right` and `down` are those
// of a movement, negative to the left and upwards.

/** Length of the drag that equals one press of an arrow key. A longer one turns faster, a shorter one more finely. */
const KEY_PIXELS = 16;
/** Usual height of a line, for mice whose wheels count lines. */
const LINE_PIXELS = 16;
/** Factor on the camera's distance for the keys plus and minus: five presses double or halve it. */
const KEY_ZOOM = 1.15;
/** Logarithm of the factor on the camera's distance per pixel of the wheel. A usual notch of 100 changes it by 10 %. */
const WHEEL_ZOOM = 1e-3;
/** Directions [right, down] of the arrow keys. */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/**
 * Listens to gestures on a canvas and calls the functions of `actions`:
 *
 * - turn(right, down), sun(right, down), pan(right, down): turn the view, turn the sun, move the view;
 * - zoom(factor): multiplies the camera's distance, so that factors below 1 move it nearer;
 * - reset(): sets the view to its default;
 * - hover(x, y): the pointer is over this point, with coordinates in [0, 1) from the upper left;
 * - leave(): the pointer has left the canvas;
 * - dragsSun(): whether a drag with the left button turns the sun.
 */
export function listenToGestures(canvas, actions) {
  // Pressed pointers (fingers, or the mouse) by id, where they were last: {pointerId, button, clientX, clientY}.
  const pressed = new Map();

  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  // The middle button would scroll the page while the mouse moves.
  canvas.addEventListener("mousedown", (event) => {
    if (event.button === 1) event.preventDefault();
  });
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pressed.set(event.pointerId, event);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pressed.get(event.pointerId);
    if (!before) {
      const box = canvas.getBoundingClientRect();
      actions.hover((event.clientX - box.x) / box.width, (event.clientY - box.y) / box.height);
      return;
    }
    const [right, down] = [event.clientX - before.clientX, event.clientY - before.clientY];
    // `before` is the last position, so each event is a small drag. Three and more fingers do nothing.
    if (pressed.size === 2) {
      const [a, b] = pressed.values();
      const other = a.pointerId === event.pointerId ? b : a;
      // Fingers at the same point count as one pixel apart, so that the factor stays finite.
      const distance = (pointer) => Math.hypot(pointer.clientX - other.clientX, pointer.clientY - other.clientY);
      actions.zoom(Math.max(distance(before), 1) / Math.max(distance(event), 1));
      // The picture follows the middle of both fingers. It moves by half the way of one finger.
      actions.pan(right / 2, down / 2);
    } else if (pressed.size === 1) {
      // The left button turns the view, the middle one or shift moves it, and the right one or ctrl turns the sun, as
      // in the native window.
      if (before.button === 1 || (before.button === 0 && event.shiftKey)) actions.pan(right, down);
      else if (before.button === 2 || event.ctrlKey || actions.dragsSun()) actions.sun(right, down);
      else actions.turn(right, down);
    }
    // The event of a movement does not tell which button is pressed, so the button is copied.
    pressed.set(event.pointerId, {
      pointerId: event.pointerId, button: before.button, clientX: event.clientX, clientY: event.clientY,
    });
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, (event) => pressed.delete(event.pointerId));
  }
  canvas.addEventListener("pointerleave", () => actions.leave());
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      // Wheels that count pages are read as if they counted pixels.
      const pixels = (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE_PIXELS : 1) * event.deltaY;
      actions.zoom(Math.exp(WHEEL_ZOOM * pixels));
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (event) => {
    const arrow = ARROWS[event.key];
    // These keys belong to shortcuts of the browser.
    if (event.altKey || event.metaKey || event.ctrlKey) return;
    if (arrow) (event.shiftKey ? actions.sun : actions.turn)(KEY_PIXELS * arrow[0], KEY_PIXELS * arrow[1]);
    else if (event.key === "+" || event.key === "=") actions.zoom(1 / KEY_ZOOM);
    else if (event.key === "-") actions.zoom(KEY_ZOOM);
    else if (event.key === "r" || event.key === "R") actions.reset();
    else return;
    event.preventDefault();
  });
}
