// Calls of which only the last one matters, such as those for every movement of the pointer.

/**
 * Wraps the asynchronous function `task` so that it runs once at a time. Of the calls during a run, only the last one
 * is made, after the run, whether or not the run failed.
 *
 * The wrapped function returns a promise of whether this call ran the task: true after all runs, or false at once if
 * the run of another call goes on. It fails with the error of the last run; earlier errors are out of date.
 */
export function onlyLatest(task) {
  let running = false;
  /** Arguments of the newest call that is not made yet; null for none. */
  let next = null;
  return async (...args) => {
    next = args;
    if (running) return false;
    running = true;
    let run;
    // A call during the run sets `next` again.
    while (next) {
      const current = next;
      next = null;
      run = task(...current);
      await run.catch(() => {});
    }
    running = false;
    await run;
    return true;
  };
}
