// Questions to a Web Worker, and its answers as promises.

/** An error with the worker's kind: the library's (see crates/web/README.md), or "cancelled". */
export class WorkerError extends Error {
  constructor({ message, kind = "internal", parameter }) {
    super(message);
    this.kind = kind;
    this.parameter = parameter;
  }
}

export class Channel {
  #worker;
  #waiting = new Map();
  #last = 0;

  /** `onEvent` gets messages that answer no question. */
  constructor(url, module, onEvent = () => {}) {
    this.#worker = new Worker(url, { type: "module" });
    this.#worker.onmessage = ({ data }) => {
      const waiting = this.#waiting.get(data.id);
      if (!waiting) return onEvent(data);
      if (data.type === "progress") return waiting.progress?.(data.share);
      this.#waiting.delete(data.id);
      if (data.type === "error") waiting.reject(new WorkerError(data));
      else waiting.resolve(data.value);
    };
    this.#worker.onerror = (event) => {
      event.preventDefault();
      this.#end({ message: event.message || "the worker could not be started", kind: "internal" });
    };
    this.started = this.ask("start", { module });
    // Whoever asks something else hears of the failure too.
    this.started.catch(() => {});
  }

  get busy() {
    return this.#waiting.size > 0;
  }

  ask(type, fields = {}, { transfer = [], progress } = {}) {
    const id = ++this.#last;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject, progress });
      this.#worker.postMessage({ ...fields, id, type }, transfer);
    });
  }

  /** Says something that is not answered. */
  tell(type, fields = {}) {
    this.#worker.postMessage({ ...fields, type });
  }

  /** Ends the worker; what it was asked fails with the kind "cancelled". */
  end() {
    this.#end({ message: "cancelled", kind: "cancelled" });
  }

  #end(error) {
    this.#worker.terminate();
    const waiting = [...this.#waiting.values()];
    this.#waiting.clear();
    for (const { reject } of waiting) reject(new WorkerError(error));
  }
}
