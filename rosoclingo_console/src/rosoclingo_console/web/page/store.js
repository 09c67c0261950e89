// What the server has said, and who is told when that changes.

const MOST_LINES = 500;

export const STALE = 3500; // ms without a sign of life of the server

export const state = {
  hello: null, // what this page may do
  beat: null, // the server's clocks, and when they were heard
  systems: new Map(), // tables and lines of each system, by its name
  chosen: null, // the system whose details are shown
};

const views = [];
let isDue = false;

/** Has a function called before the next picture after each change, and each second. */
export function watch(view) {
  views.push(view);
}

/** Has all views drawn. */
export function changed() {
  if (isDue) return;
  isDue = true;
  requestAnimationFrame(() => {
    isDue = false;
    for (const view of views) {
      try {
        view();
      } catch (fault) {
        setTimeout(() => { throw fault; }); // for the browser's log; the other views are drawn
      }
    }
  });
}

const fresh = () => ({ tables: {}, changes: {}, lines: [], count: 0 });

/** Takes a message of the server. */
export function take(message) {
  if (message.hello) {
    state.hello = message.hello;
    state.systems = new Map(message.hello.systems.map((name) => [name, state.systems.get(name) ?? fresh()]));
    if (!state.systems.has(state.chosen)) state.chosen = message.hello.systems[0];
  } else if (message.beat) {
    state.beat = { ...message.beat, heard: performance.now() };
  } else {
    const system = message.all ? fresh() : state.systems.get(message.system);
    if (message.all) {
      system.count = (state.systems.get(message.system)?.count ?? 0) + 1; // so that lists begin anew
      state.systems.set(message.system, system);
    }
    for (const [name, rows] of Object.entries(message.tables ?? {})) {
      const table = (system.tables[name] ??= new Map());
      system.changes[name] = (system.changes[name] ?? 0) + 1;
      for (const [key, row] of Object.entries(rows)) {
        if (row === null) table.delete(key);
        else table.set(key, row);
      }
    }
    if (message.lines) system.lines = [...system.lines, ...message.lines].slice(-MOST_LINES);
  }
  changed();
}

/** The rows of a table of a system, by their keys; an empty map if there is none yet. */
export const rowsOf = (system, table) => system?.tables[table] ?? new Map();

export const chosen = () => state.systems.get(state.chosen);

/** Since when the chosen run has ended or is out of reach, in seconds; null while it goes on. A recorded run stays. */
export const stopped = () => (state.hello?.recording ? null : (rowsOf(chosen(), "run").get("run")?.stopped ?? null));

/**
 * The server's time in seconds, however this machine's clock is set. It stands still at the last moment of which something
 * is known: when the run has stopped, and without a sign of life of the server.
 */
export function now() {
  if (!state.beat) return Date.now() / 1000;
  const since = Math.min(STALE, performance.now() - state.beat.heard);
  return Math.min(state.beat.now + ((state.beat.rate ?? 1) * since) / 1000, stopped() ?? Infinity);
}
