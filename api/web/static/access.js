// Keys and the audit log, for administrators.

import { at, keyed, make, set, show, state } from "./dom.js";
import { act, sayLine } from "./orders.js";
import { get, post, send } from "./send.js";
import { moment } from "./words.js";

const { node: said, say } = sayLine();
const cell = (head, ...inner) => make("td", { "data-head": head }, ...inner);
let oldest = null;
let entries = [];

function keyRow(first) {
  const used = cell("Used");
  const word = make("span");
  const revoke = make("button", { type: "button", "aria-label": `Revoke the key ${first.name}` }, "Revoke");
  revoke.addEventListener("click", () => act(revoke, () => send("DELETE", `/v1/keys/${first.id}`), say, showKeys));
  return {
    node: make("tr", {}, cell("Name", first.name), cell("Scope", first.scope), cell("Made", `${moment(first.created)} by ${first.created_by || "this machine"}`),
      cell("Expires", first.expires ? moment(first.expires) : "never"), used, cell("State", word), cell("", revoke)),
    update(key) {
      set(used, key.used ? moment(key.used) : "not yet");
      const expired = key.expires && new Date(key.expires) < new Date();
      state(word, key.revoked ? "revoked" : expired ? "expired" : "valid", key.revoked || expired ? "aborted" : "done");
      show(revoke, !key.revoked);
    },
  };
}

export async function showKeys() {
  try {
    keyed(at("keys"), (await get("/v1/keys")).keys, (key) => key.id, keyRow);
    say("");
  } catch (error) {
    say(error.message, "refused");
  }
}

function auditRow(entry) {
  return {
    node: make("tr", {}, cell("When", moment(entry.at)), cell("Who", entry.who), cell("From", entry.address),
      cell("What", entry.action), cell("On what", entry.target), cell("Outcome", entry.outcome)),
    update() {},
  };
}

async function readAudit() {
  const page = await get(`/v1/audit?limit=50${oldest ? "&before=" + oldest : ""}`);
  entries = [...entries, ...page.audit];
  oldest = page.next_before;
  keyed(at("audit"), entries, (entry) => entry.number, auditRow);
  show(at("audit-more"), oldest !== null);
}

export async function showAudit() {
  entries = [];
  oldest = null;
  try {
    await readAudit();
    set(at("audit-said"), "");
  } catch (error) {
    set(at("audit-said"), error.message);
  }
}

// What is no number goes to the service as it is, which says what would be right: as a number of JSON it would be null, never.
const days = (text) => text === "" ? null : Number.isFinite(Number(text)) ? Number(text) : text;

async function makeKey(event) {
  event.preventDefault();
  await act(at("make-key"), () => post("/v1/keys", {
    name: at("key-name").value, scope: at("key-scope").value, expires_days: days(at("key-days").value.trim()) }), say, (made) => {
    show(at("new-key"), true);
    set(at("new-key-text"), made.key);
    showKeys();
  });
}

at("key-form").addEventListener("submit", makeKey);
at("make-key").disabled = false; // before this line the browser itself would send the form, and what was typed would be lost
at("key-form").after(said);
at("audit-more").addEventListener("click", () => act(at("audit-more"), readAudit, (text) => set(at("audit-said"), text)));
