// The BRDF map: the BRDF f_r for one direction of the light and all directions of the viewer. It shows the hemisphere
// from above: a unit vector [x, y, z] is at the point (x, y) of the unit disc, with x to the right and y up.
//
// A map is an object {rgb, side, wi}:
//
// - rgb: f_r in 1/sr as linear sRGB, three numbers for each pixel, rows from the top;
// - side: pixels along each side;
// - wi: the unit vector to the light.
//
// `wo` is the unit vector to the viewer.

import { svg } from "./svg.js";

/** One degree in radians. */
const DEGREE = Math.PI / 180;
/** Radius at which the arrow keys stop, chosen just inside the horizon: pixels at 1 may lie outside the disc. */
const KEY_RADIUS_MAX = 0.995;
/**
 * Steps of the arrow keys without and with the shift key, as fractions of the disc's radius. Chosen: larger steps cross
 * the disc faster, smaller ones find narrow orders.
 */
const [KEY_STEP, KEY_STEP_LARGE] = [0.02, 0.1];

/** The unit vector with the angle theta to the normal and the azimuth phi from +x towards +y, in degrees. */
export function direction(theta_deg, phi_deg) {
  const sine = Math.sin(theta_deg * DEGREE);
  return [sine * Math.cos(phi_deg * DEGREE), sine * Math.sin(phi_deg * DEGREE), Math.cos(theta_deg * DEGREE)];
}

/**
 * Angle to the normal and azimuth of a unit vector, {theta_deg, phi_deg}; the azimuth lies in (−180, 180]. Within 1e-9
 * of the z axis, where it is not defined, it is 0.
 */
export function angles([x, y, z]) {
  const theta_deg = Math.acos(Math.min(1, Math.max(-1, z))) / DEGREE;
  const isOnAxis = Math.hypot(x, y) < 1e-9;
  return { theta_deg, phi_deg: isOnAxis ? 0 : Math.atan2(y, x) / DEGREE };
}

/** The half vector of two directions; the normal if they are opposite. */
export function halfway(wi, wo) {
  const sum = wi.map((value, i) => value + wo[i]);
  const length = Math.hypot(...sum);
  return length > 0 ? sum.map((value) => value / length) : [0, 0, 1];
}

/**
 * Direction at a point of the map's square, null outside the disc. Coordinates are fractions of the side, from the
 * upper left corner.
 */
export function directionAt(right, down) {
  const [x, y] = [2 * right - 1, 1 - 2 * down];
  const radiusSquared = x * x + y * y;
  return radiusSquared < 1 ? [x, y, Math.sqrt(1 - radiusSquared)] : null;
}

/** The map's value in a direction, linear sRGB in 1/sr: that of the pixel that contains the direction. */
export function colourAt({ rgb, side }, [x, y]) {
  const column = Math.min(side - 1, Math.floor((0.5 + 0.5 * x) * side));
  const row = Math.min(side - 1, Math.floor((0.5 - 0.5 * y) * side));
  return rgb.slice(3 * (row * side + column), 3 * (row * side + column) + 3);
}

/** The map on its canvas, with marks. Sizes of marks are in radii of the disc. */
export class MapView {
  #canvas;
  // Point of the disc from which arrow keys step: that of the viewer marked last.
  #current = [0, 0];
  // Marks of the mirror direction, the viewer and the half vector.
  #mirror = svg("circle", { class: "mirror", r: 0.045 });
  #viewer = svg("path", { class: "read", d: "M-.08 0H.08M0-.08V.08" });
  #half = svg("path", { class: "half", d: "M0-.055 .055 0 0 .055-.055 0Z" });

  /**
   * Puts a grid and hidden marks into the SVG element `marks`, whose unit is the disc's radius, and listens to events
   * of `canvas`. `onDirection` is called with the direction, a unit vector, under the pointer or chosen by arrow keys.
   */
  constructor(canvas, marks, onDirection) {
    this.#canvas = canvas;
    for (const theta_deg of [30, 60]) marks.append(svg("circle", { class: "grid", r: Math.sin(theta_deg * DEGREE) }));
    marks.append(svg("path", { class: "grid", d: "M-1 0H1M0-1V1" }), this.#mirror, this.#half, this.#viewer);
    this.mark(null, null);
    const readPointer = (event) => {
      const box = canvas.getBoundingClientRect();
      const found = directionAt((event.clientX - box.x) / box.width, (event.clientY - box.y) / box.height);
      if (found) onDirection(found);
    };
    canvas.addEventListener("pointermove", readPointer);
    // A touch without movement is no pointermove.
    canvas.addEventListener("pointerdown", readPointer);
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!step) return;
      event.preventDefault();
      const size = event.shiftKey ? KEY_STEP_LARGE : KEY_STEP;
      const next = [this.#current[0] + size * step[0], this.#current[1] + size * step[1]];
      // Points beyond KEY_RADIUS_MAX move back to this radius.
      const excess = Math.hypot(...next) / KEY_RADIUS_MAX;
      if (excess > 1) [next[0], next[1]] = [next[0] / excess, next[1] / excess];
      onDirection([...next, Math.sqrt(1 - next[0] ** 2 - next[1] ** 2)]);
    });
  }

  /** Shows side² pixels of RGBA bytes, rows from the top: a Uint8Array with a buffer of its own, without an offset. */
  show(rgba, side) {
    this.#canvas.width = this.#canvas.height = side;
    this.#canvas.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(rgba.buffer), side, side), 0, 0);
  }

  /**
   * Marks the mirror direction of the light, the viewer, and the half vector of light and viewer. A direction that is
   * null hides the marks that need it.
   */
  mark(wi, wo) {
    if (wo) this.#current = [wo[0], wo[1]];
    const put = (element, point) => {
      element.style.display = point ? "" : "none";
      // y is downwards in SVG.
      if (point) element.setAttribute("transform", `translate(${point[0]} ${-point[1]})`);
    };
    put(this.#mirror, wi && [-wi[0], -wi[1]]);
    put(this.#viewer, wo);
    put(this.#half, wi && wo && halfway(wi, wo));
  }
}
