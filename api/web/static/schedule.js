// Schedule a campaign: fill in tests or take a plan file; every change is drawn and checked before it is submitted.

import { at, make, set, show } from "./dom.js";
import { put, store } from "./feed.js";
import { chart, lineOf } from "./charts.js";
import { chooseCampaign, chosenRig } from "./choice.js";
import { act, oneAtATime } from "./orders.js";
import { Refused, create, createFromFile, get, postLong } from "./send.js";
import { testCard } from "./card.js";
import { degrees, force, length, number, seconds } from "./words.js";

const CHECK_MS = 400;
const TICK_MS = 2000; // a check that takes longer says for how long
const cards = [];
let changes = 0; // of the form: a check of what stands no longer there says nothing
let timer = null;
let warmUp = null; // of a plan file
let drawn = null; // the card whose test is drawn
const touched = new Set(); // texts of the form that a person has begun: before, an empty one is not called wrong

const texts = ["name", "rig", "specimen", "operator"];
const field = (key) => at("new-" + key);

function campaign() {
  const body = Object.fromEntries(texts.map((key) => [key, field(key).value.trim()]));
  if (!body.operator) delete body.operator;
  body.interlocks = field("interlocks").value.split("\n").map((line) => line.trim()).filter(Boolean);
  if (warmUp) body.warm_up = warmUp;
  return { ...body, tests: cards.map((card) => card.config()) };
}

function add(options) {
  const card = testCard(options, {
    changed: () => { drawn = card; checkSoon(); },
    removed: () => { cards.splice(cards.indexOf(card), 1); card.node.remove(); number_(); checkSoon(); },
    repeated: () => add({ config: { ...card.config(), name: freeName(card.config().name) }, from: "a copy", kind: card.kind, texts: card.texts() }),
    chosen: () => { if (drawn !== card) { drawn = card; draw(); } },
  });
  cards.push(card);
  at("new-tests").append(card.node);
  drawn = card;
  number_();
  checkSoon();
}

function freeName(name) {
  const taken = new Set(cards.map((card) => card.config().name));
  const stem = name.replace(/ \d+$/, "");
  for (let n = 2; ; n++) if (!taken.has(`${stem} ${n}`)) return `${stem} ${n}`;
}

function number_() {
  cards.forEach((card, place) => card.place(place));
  show(at("no-tests"), cards.length === 0);
}

function checkSoon() {
  changes += 1;
  clearTimeout(timer);
  set(at("checked"), "checking …");
  timer = setTimeout(() => { check(); draw(); }, CHECK_MS);
}

// The service designs every test for a check: minutes, for hundreds of homogenised ones.
const check = oneAtATime(async () => {
  const mine = changes;
  const begun = performance.now();
  const tick = setInterval(() => set(at("checked"), `checking … ${seconds((performance.now() - begun) / 1e3)}`), TICK_MS);
  try {
    const found = await postLong("/v1/campaigns/check", campaign());
    if (mine !== changes) return;
    clearErrors();
    fits(found);
  } catch (error) {
    if (mine !== changes) return;
    clearErrors();
    if (error instanceof Refused) place(error);
    else set(at("checked"), error.message);
  } finally {
    clearInterval(tick);
  }
});

function fits(found) {
  const heat = found.highest_degc === null ? "" : `, the damper gets ${degrees(found.highest_degc)} warm`;
  const notes = found.warnings.map((text) => ` Note: ${text}.`).join("");
  set(at("checked"), `It fits: ${seconds(found.duration_s)} of rig time${heat}.${notes}`);
  found.tests.forEach((one, place) => cards[place] && cards[place].say([
    seconds(one.duration_s), "±" + length(one.displacement_m), number(one.velocity_m_s, 2, "m/s"),
    one.force_n === null ? "" : force(one.force_n), one.temperature_rise_k === null ? "" : "+" + number(one.temperature_rise_k, 1, "K"),
  ].filter(Boolean).join(" · ")));
}

function clearErrors() {
  for (const card of cards) card.clear();
  for (const key of [...texts, "interlocks"]) wrong(field(key), at("wrong-" + key), "");
  show(at("wrong"), false);
}

export function wrong(input, line, text) {
  set(line, text);
  show(line, text);
  if (text) input.setAttribute("aria-invalid", "true");
  else input.removeAttribute("aria-invalid");
}

const waitsForText = (key) => texts.includes(key) && !field(key).value && !touched.has(key);
const labelOf = (key) => document.querySelector(`label[for="new-${key}"]`).textContent;

// Each error stands at its field; one that has none stands at its test, or under the form.
function place(refused) {
  const rest = [];
  const empty = [];
  const errors = refused.errors.length ? refused.errors : [{ pointer: "", detail: refused.message }];
  for (const error of errors) {
    const [, top, index, ...path] = error.pointer.split("/");
    if (waitsForText(top)) empty.push(labelOf(top));
    else if (top === "tests" && cards[index]) cards[index].wrong(path.join("/"), error.detail);
    else if (at("wrong-" + top)) wrong(field(top), at("wrong-" + top), error.detail);
    else rest.push(error.detail);
  }
  const wrongs = errors.length - empty.length;
  set(at("checked"), [empty.length ? `Still to fill in: ${empty.join(", ")}.` : "",
    wrongs === 1 ? "One thing must be changed." : wrongs ? `${wrongs} things must be changed.` : ""].join(" ").trim());
  show(at("wrong"), rest.length);
  set(at("wrong"), rest.join(" "));
}

const draw = oneAtATime(async () => {
  if (!drawn || !cards.includes(drawn)) drawn = cards[0] ?? null;
  show(at("drawing"), drawn);
  if (!drawn || at("schedule-view").hidden) return;
  const card = drawn;
  let motion;
  try {
    motion = await postLong("/v1/tests/draw", { test: card.config() });
  } catch {
    return; // the check says what is wrong
  }
  if (card !== drawn) return;
  const line = (x, y) => [{ x, y, mode: "lines", line: { ...lineOf(0, 1.5), simplify: false }, name: motion.name }];
  const mm = motion.displacement_m.map((value) => value * 1e3);
  const words = `${motion.name}: ${seconds(motion.duration_s)}`;
  chart(at("draw-time"), { title: `${motion.name}: displacement`, x: "Time (s)", y: "Displacement (mm)", kept: card, words,
    traces: () => line(motion.time_s, mm) });
  const currents = motion.current_a !== null;
  chart(at("draw-range"), currents
    ? { title: "Current", x: "Time (s)", y: "Current (A)", kept: card, words, traces: () => line(motion.time_s, motion.current_a) }
    : { title: "Velocity over displacement", x: "Displacement (mm)", y: "Velocity (m/s)", kept: card, words,
      traces: () => line(mm, motion.velocity_m_s) });
  set(at("draw-hint"), motion.shown_s < motion.duration_s ? `The first ${seconds(motion.shown_s)} of ${seconds(motion.duration_s)}.` : "");
});

// Tests from elsewhere become tests of the form as they are. of: the name, and perhaps the rig and the specimen.
export function takeTests(tests, of) {
  cards.splice(0).forEach((card) => card.node.remove());
  warmUp = null;
  for (const config of tests) add({ config, from: of.name });
  for (const [key, text] of Object.entries(of)) if (key !== "name" || !field(key).value) field(key).value = text;
}

// A JSON file is read here; the service reads the others, stores their tests as a design, and says what is wrong.
async function takePlan(file) {
  if (!file.name.toLowerCase().endsWith(".json")) {
    return takeDesign((await createFromFile(`/v1/designs/file?file=${encodeURIComponent(file.name)}`, file)).id);
  }
  const read = JSON.parse(await file.text());
  take(file.name, Array.isArray(read) ? read : read.tests ?? [], read.warm_up);
}

async function takeDesign(id) {
  const design = await get(`/v1/designs/${id}`);
  take(design.name, design.configurations, design.warm_up);
}

function take(name, tests, warm) {
  takeTests(tests, { name: name.replace(/\.[a-z0-9]+$/i, "") });
  warmUp = warm ?? null;
  set(at("plan-said"), `${tests.length} ${tests.length === 1 ? "test" : "tests"} from ${name}` + (warmUp ? ", with its warm-up" : ""));
}

async function listDesigns() {
  const { designs } = await get("/v1/designs?limit=200");
  const one = ({ id, name }) => make("option", { value: id, selected: id === at("design").value }, name);
  at("design").replaceChildren(at("design").options[0], ...designs.map(one));
}

async function submit(event) {
  event.preventDefault();
  const say = (text) => { show(at("wrong"), text); set(at("wrong"), text); };
  await act(at("submit"), async () => {
    set(at("checked"), "submitting …");
    try {
      return await create("/v1/campaigns", campaign());
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      clearErrors();
      texts.forEach((key) => touched.add(key));
      place(error);
      const first = document.querySelector('#schedule-view [aria-invalid="true"]');
      if (first) first.focus();
      return null;
    }
  }, (text) => { if (text) { say(text); set(at("checked"), ""); } }, (made) => {
    if (!made) return;
    set(at("checked"), `${made.name} was accepted.`);
    put(made);
    chooseCampaign(made);
    location.hash = "#live";
  });
}

export function showSchedule() {
  at("known-rigs").replaceChildren(...store.rigs.map((rig) => make("option", { value: rig.url }, rig.name || rig.model)));
  const rig = chosenRig() ?? store.rigs[0];
  if (!field("rig").value && rig) field("rig").value = rig.url;
  if (!cards.length) add({ kind: "sine" });
  else draw();
  listDesigns().catch(() => {}); // the banner says that the service is away
}

at("schedule").addEventListener("submit", submit);
at("submit").disabled = false; // before this line the browser itself would send the form, and what was typed would be lost
at("schedule").addEventListener("input", ({ target }) => {
  if (!target.id.startsWith("new-")) return;
  touched.add(target.id.slice("new-".length));
  checkSoon();
});
at("add-test").addEventListener("click", () => add({ kind: "sine", name: freeName("test") }));
const orSay = (taken) => taken.catch((error) => set(at("plan-said"), error.message));
at("plan").addEventListener("change", async () => {
  const [file] = at("plan").files;
  if (file) await orSay(takePlan(file));
  at("plan").value = "";
});
at("design").addEventListener("change", () => { if (at("design").value) orSay(takeDesign(at("design").value)); });
