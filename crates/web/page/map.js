// The BRDF map: f_r over all viewing directions for one direction of the light. It shows the hemisphere from above: a
// unit vector (x, y, z) is at the point (x, y) of the unit disc, with x to the right and y up.

import { svg } from "./svg.js";

/** One degree in radians. */
const RADIAN = Math.PI / 180;
/** Largest radius that arrow keys reach. Chosen just inside the horizon, which is at 1. */
const KEY_RADIUS_MAX = 0.995;

/** The unit vector of a polar angle and an azimuth. */
export function direction(theta_deg, phi_deg) {
  const sine = Math.sin(theta_deg * RADIAN);
  return [sine * Math.cos(phi_deg * RADIAN), sine * Math.sin(phi_deg * RADIAN), Math.cos(theta_deg * RADIAN)];
}

/** Polar angle and azimuth in degrees of a unit vector. */
export function angles([x, y, z]) {
  const theta = Math.acos(Math.min(1, Math.max(-1, z))) / RADIAN;
  return { theta_deg: theta, phi_deg: Math.hypot(x, y) < 1e-9 ? 0 : Math.atan2(y, x) / RADIAN };
}

/** The direction halfway between two. */
export function halfway(wi, wo) {
  const sum = wi.map((value, i) => value + wo[i]);
  const length = Math.hypot(...sum);
  return length > 0 ? sum.map((value) => value / length) : [0, 0, 1];
}

/** The direction at a point of the map, each coordinate in [0, 1] from the upper left; null outside the disc. */
export function directionAt(x, y) {
  const [u, v] = [2 * x - 1, 1 - 2 * y];
  const square = u * u + v * v;
  return square < 1 ? [u, v, Math.sqrt(1 - square)] : null;
}

/** The colour of the map in a direction, linear sRGB in 1/sr. */
export function colourAt({ rgb, side }, [x, y]) {
  const column = Math.min(side - 1, Math.floor((0.5 + 0.5 * x) * side));
  const row = Math.min(side - 1, Math.floor((0.5 - 0.5 * y) * side));
  return rgb.slice(3 * (row * side + column), 3 * (row * side + column) + 3);
}

/** The map on its canvas, with marks. */
export class MapView {
  #canvas;
  #mirror = svg("circle", { class: "mirror", r: 0.045 });
  #read = svg("path", { class: "read", d: "M-.08 0H.08M0-.08V.08" });
  #half = svg("path", { class: "half", d: "M0-.055 .055 0 0 .055-.055 0Z" });

  /** Draws marks into the SVG element `marks`; `read` gets the direction under the pointer or chosen by keys. */
  constructor(canvas, marks, read) {
    this.#canvas = canvas;
    for (const theta of [30, 60]) marks.append(svg("circle", { class: "grid", r: Math.sin(theta * RADIAN) }));
    marks.append(svg("path", { class: "grid", d: "M-1 0H1M0-1V1" }), this.#mirror, this.#half, this.#read);
    this.mark(null, null);
    let at = [0, 0];
    const point = (event) => {
      const box = canvas.getBoundingClientRect();
      const found = directionAt((event.clientX - box.x) / box.width, (event.clientY - box.y) / box.height);
      if (found) {
        at = [found[0], found[1]];
        read(found);
      }
    };
    canvas.addEventListener("pointermove", point);
    canvas.addEventListener("pointerdown", point);
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!step) return;
      event.preventDefault();
      const size = event.shiftKey ? 0.1 : 0.02;
      const next = [at[0] + size * step[0], at[1] + size * step[1]];
      if (Math.hypot(...next) >= KEY_RADIUS_MAX) return;
      at = next;
      read([...at, Math.sqrt(1 - at[0] ** 2 - at[1] ** 2)]);
    });
  }

  /** Shows RGBA pixels, rows from the top. */
  show(rgba, side) {
    this.#canvas.width = this.#canvas.height = side;
    this.#canvas.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(rgba.buffer), side, side), 0, 0);
  }

  /** Marks the mirror direction of the light, the viewer, and the half vector of both. */
  mark(wi, wo) {
    const put = (mark, point) => {
      mark.style.display = point ? "" : "none";
      if (point) mark.setAttribute("transform", `translate(${point[0]} ${-point[1]})`);
    };
    put(this.#mirror, wi && [-wi[0], -wi[1]]);
    put(this.#read, wo);
    put(this.#half, wi && wo && halfway(wi, wo));
  }
}
