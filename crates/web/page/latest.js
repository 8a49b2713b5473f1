// Calls of which only the last one matters, such as those for every movement of the pointer.

/**
 * Wraps the asynchronous function `task` so that it runs once at a time. Of the calls during a run, only the last one
 * is made, after the run.
 *
 * The wrapped function returns a promise of whether this call ran the task: true after all runs, or false at once if
 * the run of another call goes on. An error of the task reaches the call that ran it, and a call that waits is dropped.
 */
export function onlyLatest(task) {
  let running = false;
  /** Arguments of the newest call that is not made yet; null for none. */
  let next = null;
  return async (...args) => {
    next = args;
    if (running) return false;
    running = true;
    try {
      // A call during the run sets `next` again.
      while (next) {
        const current = next;
        next = null;
        await task(...current);
      }
    } finally {
      running = false;
    }
    return true;
  };
}
