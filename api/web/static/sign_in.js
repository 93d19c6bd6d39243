// Sign-in: the key goes into one header of one request and is not kept; what stays is a cookie that no script can read.
"use strict";

const at = (id) => document.getElementById(id);

function next() {
  const wanted = new URLSearchParams(location.search).get("next") || "/";
  const there = new URL(wanted, location.origin);
  return there.origin === location.origin ? there.pathname + there.search : "/";
}

function refuse(text) {
  at("refused").textContent = text;
  at("refused").hidden = !text;
}

async function signIn(event) {
  event.preventDefault();
  const key = at("key").value.trim();
  at("go").disabled = true;
  refuse("");
  try {
    if (!/^[\x21-\x7e]+$/.test(key)) throw new Error("a key has only letters, digits, _ and -");
    const answer = await fetch("/v1/session", { method: "POST", headers: { authorization: "Bearer " + key } });
    if (!answer.ok) throw new Error((await answer.json()).detail);
    at("key").value = "";
    location.replace(next());
  } catch (error) {
    refuse(error instanceof TypeError ? "The service does not answer." : error.message);
    at("go").disabled = false;
    at("key").focus();
  }
}

async function already() {
  const answer = await fetch("/v1/session");
  if (answer.ok) location.replace(next());
}

at("sign-in").addEventListener("submit", signIn);
at("go").disabled = false; // before this line the browser itself would send the form, and the key would be lost
already().catch(() => refuse("The service does not answer."));
