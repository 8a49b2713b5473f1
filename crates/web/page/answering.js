// The workers' side of the messages between page and Web Workers. channel.js is the page's side.

import init from "./wasm/sunbeam_web.js";

/**
 * Answers each message {id, type, …fields} by the handler of its type: handlers[type](fields, progress).
 *
 * progress(fraction) sends {id, type: "progress", fraction}. The answer is {id, type: "done", value} with the handler's
 * result, or {id, type: "error", message, kind, parameter}; channel.js explains kind and parameter. A message without
 * an id gets no answer unless it fails. The first message has the type "start", which needs no handler, and the
 * compiled library as its field `module`.
 */
export function answer(handlers) {
  // Promise of the started library.
  let ready = null;
  onmessage = async ({ data }) => {
    const { id, type, ...fields } = data;
    const progress = (fraction) => postMessage({ id, type: "progress", fraction });
    try {
      // Later messages wait until the library is started.
      if (type === "start") ready = init({ module_or_path: fields.module });
      await ready;
      const value = type === "start" ? undefined : await handlers[type](fields, progress);
      if (id !== undefined) postMessage({ id, type: "done", value }, buffers(value));
    } catch (error) {
      const { message, kind, parameter } = error instanceof Error ? error : { message: String(error) };
      // The library gives each of its errors a kind. Errors without one are panics, or memory that ran out.
      postMessage({ id, type: "error", message, kind: kind ?? "internal", parameter });
    }
  };
}

/** Buffers of the typed arrays in an answer, or in the fields of one. They are transferred instead of copied. */
function buffers(value) {
  const arrays = value && typeof value === "object" && !ArrayBuffer.isView(value) ? Object.values(value) : [value];
  return arrays.filter(ArrayBuffer.isView).map((array) => array.buffer);
}
