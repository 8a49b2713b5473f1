// The page's side of the messages to a Web Worker: questions, with answers as promises (answering.js is the worker's).

/** An error of a worker; its kind is one of the library's (crates/web/README.md) or "cancelled". */
export class WorkerError extends Error {
  constructor({ message, kind = "internal", parameter }) {
    super(message);
    this.kind = kind;
    this.parameter = parameter;
  }
}

/** A worker that is asked questions. */
export class Channel {
  #worker;
  /** Promises of unanswered questions, by the number of the question. */
  #waiting = new Map();
  /** Number of the last question. */
  #last = 0;

  /** Starts the worker at `url` with the compiled library; `onEvent` gets messages that answer no question. */
  constructor(url, module, onEvent = () => {}) {
    this.#worker = new Worker(url, { type: "module" });
    this.#worker.onmessage = ({ data }) => {
      const waiting = this.#waiting.get(data.id);
      if (!waiting) return onEvent(data);
      if (data.type === "progress") return waiting.progress?.(data.fraction);
      this.#waiting.delete(data.id);
      if (data.type === "error") waiting.reject(new WorkerError(data));
      else waiting.resolve(data.value);
    };
    this.#worker.onerror = (event) => {
      event.preventDefault();
      this.#end({ message: event.message || "the worker could not be started", kind: "internal" });
    };
    this.started = this.ask("start", { module });
    // A failed start is reported by every other question.
    this.started.catch(() => {});
  }

  /** Whether questions are unanswered. */
  get busy() {
    return this.#waiting.size > 0;
  }

  /** Asks a question; a promise of its answer. `transfer` lists buffers that are handed over. */
  ask(type, fields = {}, { transfer = [], progress } = {}) {
    const id = ++this.#last;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject, progress });
      this.#worker.postMessage({ ...fields, id, type }, transfer);
    });
  }

  /** Sends a message that is not answered. */
  tell(type, fields = {}) {
    this.#worker.postMessage({ ...fields, type });
  }

  /** Ends the worker; its unanswered questions fail with the kind "cancelled". */
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
