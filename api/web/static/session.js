// Who is signed in on this page, and what they may see; back to the sign-in page when nobody is any more.

import { at, set, show } from "./dom.js";

const ASK_MS = 15000; // an open page keeps its session in use: the stop button must work

function toSignIn() {
  location.replace("/sign-in?next=" + encodeURIComponent(location.pathname));
}

async function askWho() {
  let answer;
  try {
    answer = await fetch("/v1/session");
  } catch {
    return; // the live stream says that the service is away
  }
  if (answer.status === 401) return toSignIn();
  if (!answer.ok) return;
  const who = await answer.json();
  set(at("who"), who.key_id ? `${who.name} (${who.scope})` : "");
  show(at("sign-out"), who.session);
  for (const name of ["keys", "audit"]) show(at("to-" + name), who.scope === "admin");
}

async function signOut() {
  const answer = await fetch("/v1/session", { method: "DELETE" });
  if (answer.ok || answer.status === 401) toSignIn();
}

at("sign-out").addEventListener("click", signOut);
askWho();
setInterval(askWho, ASK_MS);
