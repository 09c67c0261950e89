// The live channel: connects, connects again, and knows whether what is shown is stale.

import { STALE, changed, chosen, rowsOf, state, stopped, take } from "./store.js";

const FIRST_PAUSE = 300; // ms until it connects again
const LAST_PAUSE = 5000;
const REFUSED = 4401;
const KEY = "rosoclingo token";

export const link = { word: "connecting", since: performance.now(), heard: 0, token: "" };

let socket = null;
let pause = FIRST_PAUSE;
let timer = 0;

/** Takes the token out of the address, where others would see it, and keeps it for this tab. */
export function begin() {
  const given = decodeURIComponent(location.hash.slice(1));
  if (given && !document.getElementById(given)) {
    sessionStorage.setItem(KEY, given);
    history.replaceState(null, "", location.pathname);
  }
  link.token = sessionStorage.getItem(KEY) ?? "";
  connect();
  setInterval(look, 500);
  window.addEventListener("online", hurry);
  document.addEventListener("visibilitychange", () => document.hidden || hurry());
}

/** Uses another token. */
export function use(token) {
  sessionStorage.setItem(KEY, token);
  link.token = token;
  socket?.close();
  socket = null;
  connect();
}

function say(word) {
  if (link.word !== word) {
    link.word = word;
    link.since = performance.now();
    changed();
  }
}

function connect() {
  clearTimeout(timer);
  timer = 0;
  const mine = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
  socket = mine;
  mine.addEventListener("open", () => mine.send(JSON.stringify({ token: link.token })));
  mine.addEventListener("message", ({ data }) => {
    if (socket !== mine) return;
    link.heard = performance.now();
    pause = FIRST_PAUSE;
    say("live");
    take(JSON.parse(data));
  });
  mine.addEventListener("close", ({ code }) => {
    if (socket !== mine) return;
    socket = null;
    if (code === REFUSED) return say("refused");
    say("lost");
    timer = setTimeout(connect, pause);
    pause = Math.min(LAST_PAUSE, 1.6 * pause);
  });
}

/** Connects now, if it would only later. */
function hurry() {
  if (timer) connect();
}

function look() {
  const silent = performance.now() - link.heard;
  if (link.word === "live" && silent > STALE) {
    say("stale");
    // A network that has gone says nothing: a new connection finds out.
    socket?.close();
    socket = null;
    timer = setTimeout(connect, pause);
  }
  changed();
}

/** Whether all of the page may be out of date. */
export const isStale = () => link.word !== "live";

/** Whether the page shows the chosen run as it was. */
export const isOver = () => isStale() || stopped() !== null;

export const mayPlay = () => Boolean(state.hello?.may_ask) && link.word === "live";
export const mayActWhenLive = () => Boolean(state.hello?.may_ask && state.hello.may_act && !state.hello.recording);
export const mayAct = () => mayPlay() && mayActWhenLive();

function isConnected() {
  const run = rowsOf(chosen(), "run").get("run");
  return Boolean(run?.connected) && run.state !== "ended";
}

/** Whether the chosen run can be told something, or asked. */
export const mayControl = () => mayAct() && isConnected();
export const mayAsk = () => mayPlay() && !state.hello.recording && isConnected();
