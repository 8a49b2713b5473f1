// What the page says in words.

import { byId, page } from "./state.js";

/** With a minus sign that is as wide as a digit. */
export const signed = (text) => String(text).replace("-", "−");
export const rounded = (angle) => Number(angle.toFixed(2));
export const degrees = (angle) => `${signed(angle.toFixed(1))}°`;

export function say(text) {
  byId("message").hidden = !text;
  byId("message").firstElementChild.textContent = text ?? "";
}

export function progress(text, share) {
  byId("progress").hidden = text === null;
  if (text === null) return;
  byId("progress-text").textContent = share === undefined ? text : `${text}: ${Math.floor(100 * share)} %`;
  if (share === undefined) byId("progress-bar").removeAttribute("value");
  else byId("progress-bar").value = share;
}

export function showStatus() {
  const { drawn, made, adapter, settings } = page;
  const parts = [settings.method];
  if (made) parts.push(`${(made.bytes / 1e6).toFixed(made.bytes < 1e6 ? 2 : 1)} MB made in ${made.seconds.toFixed(1)} s`);
  if (drawn) parts.push(`${drawn.width} × ${drawn.height} in ${Math.round(drawn.ms)} ms${drawn.finest ? "" : " (draft)"}`);
  parts.push(adapter ? adapter.name || adapter.backend : "no WebGPU");
  byId("status").textContent = parts.join(" · ");
}

export const titleOf = (preset) => page.engine.catalogue.presets.find(({ name }) => name === preset)?.title ?? preset;
