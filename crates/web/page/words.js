// Conversion of numbers to text, and the page's lines of text.

import { byId, page } from "./state.js";

/** Text of a number with the minus sign of typography, which is as wide as a digit, instead of hyphens. */
export const signed = (number) => String(number).replaceAll("-", "−");
/** A number rounded to two decimals. */
export const rounded = (number) => Number(number.toFixed(2));
/** Text of an angle in degrees with one decimal. */
export const degrees = (angle) => `${signed(angle.toFixed(1))}°`;

/** Shows a message that the visitor can dismiss; null hides it. */
export function showMessage(text) {
  byId("message").hidden = !text;
  byId("message").firstElementChild.textContent = text ?? "";
}

/** Shows the current work, with its finished fraction if it is known; null hides the line. */
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

/** Title of a preset for readers. */
export const titleOf = (preset) => page.engine.catalogue.presets.find(({ name }) => name === preset)?.title ?? preset;
