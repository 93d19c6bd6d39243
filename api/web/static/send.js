// Requests to the service: each ends by a deadline, each refusal is a line for a person, and what creates creates once.

import { silentMs } from "./feed.js";

const ANSWER_MS = 15000; // without a word from the service
const LOOK_MS = 500;
const SAME_CLICK_MS = 1000; // a second press within it is the same one: the slowest double click of any system takes 900
const STOP_TELL_MS = 2000; // then a person is told what to do; the request itself is waited for

export class Refused extends Error {
  constructor(problem, status) {
    super(problem.detail || `the service refused it (${status})`);
    this.status = status;
    this.errors = problem.errors || [];
  }
}

export class NoAnswer extends Error {}

async function answerOf(response) {
  const text = await response.text().catch(() => { throw new NoAnswer("The service does not answer."); });
  let body = null;
  try {
    body = text ? JSON.parse(text) : null;
  } catch {
    if (response.ok) throw new Refused({ detail: "the service answered with something else than JSON" }, response.status);
  }
  if (!response.ok) throw new Refused(body || {}, response.status);
  return body;
}

// `patient`: the service may work on the answer for as long as it takes: it is waited for while its stream is heard.
async function ask(url, options, patient = false) {
  const ends = new AbortController();
  const begun = performance.now();
  const look = setInterval(() => {
    const silent = performance.now() - begun;
    if ((patient ? Math.min(silent, silentMs()) : silent) > ANSWER_MS) ends.abort();
  }, LOOK_MS);
  try {
    return await fetch(url, { ...options, signal: ends.signal, cache: "no-store" });
  } catch {
    throw new NoAnswer("The service does not answer.");
  } finally {
    clearInterval(look);
  }
}

export async function get(url) {
  return answerOf(await ask(url));
}

export async function send(method, url, body, headers = {}, patient = false) {
  const json = body === undefined ? {} : { body: JSON.stringify(body) };
  const type = body === undefined ? {} : { "content-type": "application/json" };
  return answerOf(await ask(url, { method, headers: { ...type, ...headers }, ...json }, patient));
}

export const post = (url, body, headers) => send("POST", url, body, headers);
export const postLong = (url, body) => send("POST", url, body, {}, true);

const keys = new Map(); // what is to be created -> its Idempotency-Key, until it was created or refused

const newKey = () => Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");

// A repeated click, or one more after an answer that was lost, has the key of the first: the service creates once.
async function once(what, doing) {
  const key = keys.get(what) ?? keys.set(what, newKey()).get(what);
  const forget = () => { if (keys.get(what) === key) keys.delete(what); };
  try {
    const answer = await doing({ "idempotency-key": key });
    setTimeout(forget, SAME_CLICK_MS);
    return answer;
  } catch (error) {
    if (error instanceof NoAnswer) throw new NoAnswer("The service does not answer: perhaps it has taken this. Press again: it is done once.");
    if (error.status < 500) forget();
    throw error;
  }
}

export function create(url, body) {
  return once(`${url} ${JSON.stringify(body)}`, (headers) => send("POST", url, body, headers, true));
}

export function createFromFile(url, file) {
  return once(`${url} ${file.size} ${file.lastModified}`, async (headers) => answerOf(await ask(
    url, { method: "POST", body: file, headers: { "content-type": "application/octet-stream", ...headers } }, true)));
}

// Ends motion. `tell` gets a line at once, after two seconds without an answer, and with the answer.
export async function stopNow(url, what, tell) {
  const sent = new Date().toLocaleTimeString();
  tell(`${what} sent at ${sent} …`, "sent");
  const timer = setTimeout(() => tell(
    `${what}: no answer for 2 s. If the rig moves, press the emergency stop on the rig.`, "lost"), STOP_TELL_MS);
  try {
    const answer = await answerOf(await ask(url, { method: "POST" }));
    clearTimeout(timer);
    const said = answer && answer.text ? ` The rig: ${answer.text}.` : "";
    tell(`${what}: taken at ${new Date().toLocaleTimeString()}.${said}`, "taken");
  } catch (error) {
    clearTimeout(timer);
    if (error instanceof Refused) {
      tell(`${what} was refused: ${error.message}. If the rig moves, press the emergency stop on the rig.`, "refused");
    } else {
      tell(`${what} did not reach the service. If the rig moves, press the emergency stop on the rig.`, "lost");
    }
  }
}
