// Plot of the reflectance over the wavelength.

import { svg } from "./svg.js";

/** Edges of the plot area in units of the SVG element's viewBox (index.html), y downwards, with room for the labels. */
const [LEFT, RIGHT, TOP, BOTTOM] = [44, 294, 8, 128];
/** First and last wavelength, those of crates/web/src/spectra.rs. */
const [FIRST_NM, LAST_NM] = [380, 780];
/** Pairs of wavelength in nm and its approximate colour on a screen, for the area under the curve. */
const HUES = [
  [380, "#3b1a6b"], [420, "#4a32c0"], [460, "#2b62e0"], [490, "#1f9fc4"], [520, "#28a745"],
  [560, "#8fb51f"], [580, "#d8b41c"], [610, "#e0701f"], [650, "#c22b20"], [780, "#4d0f0f"],
];

/** Abscissa of a wavelength in nm. */
const abscissa = (nm) => LEFT + ((nm - FIRST_NM) / (LAST_NM - FIRST_NM)) * (RIGHT - LEFT);

/** A positive value rounded up to one significant digit. Rounding errors of 1e-9 do not raise the digit. */
function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return Math.ceil(value / power - 1e-9) * power;
}

/** Plot in an SVG element. */
export class Spectrum {
  #element;
  // Coloured area under the curve, the curve, the number at the upper end of the ordinate, and a text in the middle.
  #area = svg("path", { fill: "url(#hues)" });
  #curve = svg("path", { class: "curve" });
  #top = svg("text", { x: LEFT - 4, y: TOP + 8, "text-anchor": "end" });
  #note = svg("text", { x: (LEFT + RIGHT) / 2, y: (TOP + BOTTOM) / 2, "text-anchor": "middle" });

  constructor(element) {
    this.#element = element;
    // Offsets are fractions of the width of the filled area, which is always LEFT to RIGHT.
    const hues = svg("linearGradient", { id: "hues" });
    for (const [nm, colour] of HUES) {
      hues.append(svg("stop", { offset: (nm - FIRST_NM) / (LAST_NM - FIRST_NM), "stop-color": colour }));
    }
    const defs = svg("defs");
    defs.append(hues);
    const axes = svg("path", { class: "axis", d: `M${LEFT} ${TOP}V${BOTTOM}H${RIGHT}` });
    element.append(defs, this.#area, axes, this.#curve);
    for (const nm of [400, 500, 600, 700]) {
      element.append(svg("path", { class: "axis", d: `M${abscissa(nm)} ${BOTTOM}v4` }));
      element.append(svg("text", { x: abscissa(nm), y: BOTTOM + 15, "text-anchor": "middle" }, nm));
    }
    element.append(svg("text", { x: RIGHT, y: BOTTOM + 15, "text-anchor": "end" }, "nm"));
    element.append(svg("text", { x: LEFT - 4, y: TOP + 20, "text-anchor": "end" }, "1/sr"));
    element.append(svg("text", { x: LEFT - 4, y: BOTTOM + 3, "text-anchor": "end" }, "0"), this.#top, this.#note);
    this.say("");
  }

  /** Shows text instead of a curve; the empty text clears the plot. */
  say(text) {
    this.#area.setAttribute("d", "");
    this.#curve.setAttribute("d", "");
    this.#top.textContent = "";
    this.#note.textContent = text;
    this.#element.setAttribute("aria-label", text ? `Spectrum: ${text}` : "Spectrum");
  }

  /** Shows at least two reflectances in 1/sr, at equal steps from FIRST_NM to LAST_NM. */
  show(values) {
    // The ordinate ends at the largest value, rounded up. Negative values are drawn as 0.
    const most = Math.max(...values);
    const scale = most > 0 ? roundUp(most) : 1;
    const points = Array.from(values, (value, i) => {
      const x = LEFT + (i / (values.length - 1)) * (RIGHT - LEFT);
      return `${x.toFixed(1)} ${(BOTTOM - (Math.max(0, value) / scale) * (BOTTOM - TOP)).toFixed(1)}`;
    }).join("L");
    this.#area.setAttribute("d", `M${LEFT} ${BOTTOM}L${points}L${RIGHT} ${BOTTOM}Z`);
    this.#curve.setAttribute("d", `M${points}`);
    this.#top.textContent = Number(scale.toPrecision(1));
    this.#note.textContent = "";
    const peakNm = FIRST_NM + (values.indexOf(most) / (values.length - 1)) * (LAST_NM - FIRST_NM);
    const summary = most > 0 ? `strongest at ${Math.round(peakNm)} nm, ${most.toPrecision(3)} per steradian` : "dark";
    this.#element.setAttribute("aria-label", `Spectrum: ${summary}`);
  }
}
