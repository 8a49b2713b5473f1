// What both kinds of workers do with messages.

import init from "./wasm/sunbeam_web.js";

/** Answers each message by the handler of its type: {id, type: "done", value}, or an error with the library's kind. */
export function answer(handlers) {
  let ready = null;
  onmessage = async ({ data }) => {
    const { id, type, ...fields } = data;
    const progress = (share) => postMessage({ id, type: "progress", share });
    try {
      if (type === "start") ready = init({ module_or_path: fields.module });
      await ready;
      const value = type === "start" ? undefined : await handlers[type](fields, progress);
      if (id !== undefined) postMessage({ id, type: "done", value }, buffers(value));
    } catch (error) {
      const { message, kind, parameter } = error instanceof Error ? error : { message: String(error) };
      // Without a kind it is none of the library's errors: a panic, or memory that ran out.
      postMessage({ id, type: "error", message, kind: kind ?? "internal", parameter });
    }
  };
}

// Arrays are handed over instead of copied.
function buffers(value) {
  const arrays = value && typeof value === "object" && !ArrayBuffer.isView(value) ? Object.values(value) : [value];
  return arrays.filter(ArrayBuffer.isView).map((array) => array.buffer);
}
