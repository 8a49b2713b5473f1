// The BRDF map: the BRDF f_r over all viewing directions for one direction of the light. It shows the hemisphere from
// above: a unit vector [x, y, z] is at the point (x, y) of the unit disc, with x to the right and y up.
//
// A map is {rgb, side, wi}: f_r in 1/sr as linear sRGB, three numbers for each of side² pixels, rows from the top, and
// the unit vector to the light. `wo` is the unit vector to the viewer.

import { svg } from "./svg.js";

/** One degree in radians. */
const DEGREE = Math.PI / 180;
/** Radius, just inside the horizon at 1, from which on a step of the arrow keys is ignored. */
const KEY_RADIUS_MAX = 0.995;
/** Steps of the arrow keys without and with the shift key, as fractions of the disc's radius. */
const [KEY_STEP, KEY_STEP_LARGE] = [0.02, 0.1];

/** The unit vector with the angle theta to the normal and the azimuth phi, from +x towards +y. */
export function direction(theta_deg, phi_deg) {
  const sine = Math.sin(theta_deg * DEGREE);
  return [sine * Math.cos(phi_deg * DEGREE), sine * Math.sin(phi_deg * DEGREE), Math.cos(theta_deg * DEGREE)];
}

/** Angle to the normal and azimuth of a unit vector: {theta_deg, phi_deg}. The azimuth of the normal is 0. */
export function angles([x, y, z]) {
  const theta_deg = Math.acos(Math.min(1, Math.max(-1, z))) / DEGREE;
  const isNormal = Math.hypot(x, y) < 1e-9;
  return { theta_deg, phi_deg: isNormal ? 0 : Math.atan2(y, x) / DEGREE };
}

/** The half vector of two directions; the normal if they are opposite. */
export function halfway(wi, wo) {
  const sum = wi.map((value, i) => value + wo[i]);
  const length = Math.hypot(...sum);
  return length > 0 ? sum.map((value) => value / length) : [0, 0, 1];
}

/** Direction at a point of the map's square. Coordinates are in [0, 1] from the upper left. Null outside the disc. */
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

/** The map on its canvas, with marks. */
export class MapView {
  #canvas;
  // Marks of the mirror direction, the viewer and the half vector.
  #mirror = svg("circle", { class: "mirror", r: 0.045 });
  #viewer = svg("path", { class: "read", d: "M-.08 0H.08M0-.08V.08" });
  #half = svg("path", { class: "half", d: "M0-.055 .055 0 0 .055-.055 0Z" });

  /**
   * Draws the map into a canvas and marks into the SVG element `marks`, whose units are the disc's radius. `read` is
   * called with the direction under the pointer or chosen by keys.
   */
  constructor(canvas, marks, read) {
    this.#canvas = canvas;
    for (const theta_deg of [30, 60]) marks.append(svg("circle", { class: "grid", r: Math.sin(theta_deg * DEGREE) }));
    marks.append(svg("path", { class: "grid", d: "M-1 0H1M0-1V1" }), this.#mirror, this.#half, this.#viewer);
    this.mark(null, null);
    // The point of the disc that was read last.
    let current = [0, 0];
    const readPointer = (event) => {
      const box = canvas.getBoundingClientRect();
      const found = directionAt((event.clientX - box.x) / box.width, (event.clientY - box.y) / box.height);
      if (found) {
        current = [found[0], found[1]];
        read(found);
      }
    };
    canvas.addEventListener("pointermove", readPointer);
    canvas.addEventListener("pointerdown", readPointer);
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!step) return;
      event.preventDefault();
      const size = event.shiftKey ? KEY_STEP_LARGE : KEY_STEP;
      const next = [current[0] + size * step[0], current[1] + size * step[1]];
      if (Math.hypot(...next) >= KEY_RADIUS_MAX) return;
      current = next;
      read([...next, Math.sqrt(1 - next[0] ** 2 - next[1] ** 2)]);
    });
  }

  /** Shows side² pixels of RGBA bytes (a Uint8Array), rows from the top. */
  show(rgba, side) {
    // `rgba` has a buffer of its own, without an offset.
    this.#canvas.width = this.#canvas.height = side;
    this.#canvas.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(rgba.buffer), side, side), 0, 0);
  }

  /** Marks the mirror direction of the light, the viewer, and the half vector of both. Null hides the marks. */
  mark(wi, wo) {
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
