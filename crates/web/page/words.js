// Numbers as text, and the page's lines of text.

import { byId, page } from "./state.js";

/** The text with a minus sign that is as wide as a digit. */
export const signed = (text) => String(text).replace("-", "−");
/** The angle to two decimals. */
export const rounded = (angle) => Number(angle.toFixed(2));
/** The angle in degrees as text, to one decimal. */
export const degrees = (angle) => `${signed(angle.toFixed(1))}°`;

/** Shows a line of text that can be dismissed; null hides it. */
export function showMessage(text) {
  byId("message").hidden = !text;
  byId("message").firstElementChild.textContent = text ?? "";
}

/** Shows the work under way, with its fraction where it is known; null hides the line. */
export function showProgress(text, fraction) {
  byId("progress").hidden = text === null;
  if (text === null) return;
  byId("progress-text").textContent = fraction === undefined ? text : `${text}: ${Math.floor(100 * fraction)} %`;
  if (fraction === undefined) byId("progress-bar").removeAttribute("value");
  else byId("progress-bar").value = fraction;
}

/** Shows the method, its data, the last picture and the graphics device in one line. */
export function showStatus() {
  const { drawn, made, adapter, settings } = page;
  const parts = [settings.method];
  if (made) {
    const megabytes = (made.bytes / 1e6).toFixed(made.bytes < 1e6 ? 2 : 1);
    parts.push(`${megabytes} MB made in ${made.seconds.toFixed(1)} s`);
  }
  if (drawn) {
    const draft = drawn.finest ? "" : " (draft)";
    parts.push(`${drawn.width} × ${drawn.height} in ${Math.round(drawn.ms)} ms${draft}`);
  }
  parts.push(adapter ? adapter.name || adapter.backend : "no WebGPU");
  byId("status").textContent = parts.join(" · ");
}

/** The preset's name for readers. */
export const titleOf = (preset) => page.engine.catalogue.presets.find(({ name }) => name === preset)?.title ?? preset;
