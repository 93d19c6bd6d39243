// What a person asks of a rig or a campaign, and what is said about it. Stops always react, whatever else does not.

import { make, set, show } from "./dom.js";
import { post, stopNow } from "./send.js";

// A line under the buttons: it says what happened to the last order.
export function sayLine() {
  const node = make("p", { class: "said", role: "status", hidden: true });
  const say = (text, kind = "") => {
    show(node, text);
    set(node, text);
    node.className = "said " + kind;
  };
  return { node, say };
}

// Never disabled: pressing it again sends it again.
export function stopButton(label, what, title, url, say) {
  const press = () => stopNow(url(), what, say);
  return make("button", { type: "button", class: "stop", title, onclick: press }, label);
}

export function orderButton(label, url, say, { title, body, done } = {}) {
  const button = make("button", { type: "button", title });
  button.append(label);
  button.addEventListener("click", () => act(button, () => post(url(), body ? body() : undefined), say, done));
  return button;
}

// One after another, and never two at once: however often it is asked for meanwhile, it is done once more afterwards.
export function oneAtATime(doing) {
  let under = false;
  let again = false;
  return async function begin() {
    again = under;
    if (under) return;
    under = true;
    await doing().finally(() => { under = false; });
    if (again) begin();
  };
}

// Does something once at a time; its refusal is said, its focus stays.
export async function act(button, doing, say, done) {
  if (button.ariaBusy || button.ariaDisabled === "true") return;
  button.ariaBusy = "true";
  try {
    const answer = await doing();
    say("");
    if (done) done(answer);
  } catch (error) {
    say(error.message, "refused");
  } finally {
    button.ariaBusy = null;
  }
}
