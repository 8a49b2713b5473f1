// The sky from above, with the viewer at the lower edge and a sun that can be dragged.
//
// A direction of elevation e is at cos e times the disc's radius, so the horizon is the rim and the zenith the centre.
// Azimuths are counter-clockwise; that of the camera points down. y is downwards, as in SVG.

import { svg } from "./svg.js";

/** Half the side of the drawing, in the units of its viewBox (index.html). */
const HALF = 52;
/** Radius of the horizon in the same units. */
const RADIUS = 44;
/** One degree in radians. */
const DEGREE = Math.PI / 180;

/** Drawing of the sky in an SVG element. */
export class Sky {
  #sun = svg("circle", { class: "disc", r: 5.5 });
  /** Line from the zenith to the sun. */
  #ray = svg("line", { x1: 0, y1: 0 });
  /** Azimuth of the camera in degrees. */
  #camera = 0;

  /** Calls `changed` with azimuth in [−180, 180) and elevation of the sun in degrees when it is dragged. */
  constructor(element, changed) {
    element.append(svg("circle", { class: "rim", r: RADIUS }));
    for (const elevation of [30, 60]) element.append(svg("circle", { r: RADIUS * Math.cos(elevation * DEGREE) }));
    // "you" marks the viewer. The text stands between the horizon and the lower edge.
    element.append(this.#ray, svg("text", { x: 0, y: HALF - 0.5 }, "you"), this.#sun);
    const drag = (event) => {
      // Position of the pointer from the zenith, in radii of the horizon.
      const box = element.getBoundingClientRect();
      const x = (((event.clientX - box.x) / box.width) * 2 * HALF - HALF) / RADIUS;
      const y = (((event.clientY - box.y) / box.height) * 2 * HALF - HALF) / RADIUS;
      // The angle from the downward axis, which has the camera's azimuth.
      const azimuth = Math.atan2(x, y) / DEGREE + this.#camera;
      // The operator % has the sign of its left operand.
      const wrapped = ((((azimuth + 180) % 360) + 360) % 360) - 180;
      changed(wrapped, Math.acos(Math.min(1, Math.hypot(x, y))) / DEGREE);
    };
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      drag(event);
    });
    element.addEventListener("pointermove", (event) => {
      if (element.hasPointerCapture(event.pointerId)) drag(event);
    });
  }

  /** Shows the sun, {azimuth_deg, elevation_deg}, with the camera, {azimuth_deg}, at the lower edge. */
  show(sun, camera) {
    this.#camera = camera.azimuth_deg;
    // The angle from the downward axis, as in `drag`.
    const angle = (sun.azimuth_deg - camera.azimuth_deg) * DEGREE;
    const radius = RADIUS * Math.cos(sun.elevation_deg * DEGREE);
    const [x, y] = [radius * Math.sin(angle), radius * Math.cos(angle)];
    this.#sun.setAttribute("cx", x);
    this.#sun.setAttribute("cy", y);
    this.#ray.setAttribute("x2", x);
    this.#ray.setAttribute("y2", y);
  }
}
