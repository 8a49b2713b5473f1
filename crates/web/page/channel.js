// The page's side of the messages to a Web Worker: questions with answers as promises. answering.js is the worker's
// side.

/**
 * An error of a worker. Its kind is one of the library's (crates/web/README.md) or "cancelled". `parameter` is the
 * missing setting of the kind "scale".
 */
export class WorkerError extends Error {
  constructor({ message, kind = "internal", parameter }) {
    super(message);
    this.kind = kind;
    this.parameter = parameter;
  }
}

/** A Web Worker that answers questions. */
export class Channel {
  #worker;
  /** Unanswered questions by number: {resolve, reject} of the promise, and the listener `progress`. */
  #waiting = new Map();
  /** Number of the last question. */
  #last = 0;
  /** Fields of the error with which the worker was ended; null while it runs. */
  #ended = null;

  /** Starts the worker at `url` with the compiled library `module`. `onEvent` gets messages that answer no question. */
  constructor(url, module, onEvent = () => {}) {
    this.#worker = new Worker(url, { type: "module" });
    this.#worker.onmessage = ({ data }) => {
      const question = this.#waiting.get(data.id);
      if (!question) return onEvent(data);
      if (data.type === "progress") return question.progress?.(data.fraction);
      this.#waiting.delete(data.id);
      if (data.type === "error") question.reject(new WorkerError(data));
      else question.resolve(data.value);
    };
    this.#worker.onerror = (event) => {
      event.preventDefault();
      this.#terminate({ message: event.message || "the worker could not be started", kind: "internal" });
    };
    // After a failed start every other question fails, too, and reports the reason.
    this.ask("start", { module }).catch(() => {});
  }

  /** Whether questions are unanswered. */
  get busy() {
    return this.#waiting.size > 0;
  }

  /**
   * Sends a question of a type with its fields. Returns the promise of the answer. `transfer` lists objects that are
   * transferred instead of copied. `progress` is called with the finished fraction, from 0 to 1.
   */
  ask(type, fields = {}, { transfer = [], progress } = {}) {
    // An ended worker would never answer.
    if (this.#ended) return Promise.reject(new WorkerError(this.#ended));
    const id = ++this.#last;
    return new Promise((resolve, reject) => {
      // Fields that cannot be sent throw here, which fails the promise before the question counts as unanswered.
      this.#worker.postMessage({ ...fields, id, type }, transfer);
      this.#waiting.set(id, { resolve, reject, progress });
    });
  }

  /** Sends a message that is not answered. */
  tell(type, fields = {}) {
    this.#worker.postMessage({ ...fields, type });
  }

  /** Ends the worker; its unanswered and all later questions fail with the kind "cancelled". */
  end() {
    this.#terminate({ message: "cancelled", kind: "cancelled" });
  }

  /** Ends the worker; its unanswered and all later questions fail with this error. */
  #terminate(error) {
    this.#ended = error;
    this.#worker.terminate();
    const waiting = [...this.#waiting.values()];
    this.#waiting.clear();
    for (const { reject } of waiting) reject(new WorkerError(error));
  }
}
