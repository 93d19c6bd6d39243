// The runs of all campaigns: find them, draw them over one another, make sheets, read what was made of them.

import { at, keyed, make, set, show, state } from "./dom.js";
import { chart, forceScale, lineOf, peakOf, scaled, swatchOf } from "./charts.js";
import { act, sayLine } from "./orders.js";
import { create, get } from "./send.js";
import { bytes, moment, seconds } from "./words.js";

const PAGE = 50;
const MOST_CHOSEN = 16;
const JOBS_MS = 2000;

let runs = [];
let cursor = "";
const picked = new Map(); // run id -> its loops, null while they are read
const { node: said, say } = sayLine();

async function readOn() {
  const page = await get(`/v1/runs?limit=${PAGE}&specimen=${encodeURIComponent(at("runs-specimen").value)}&cursor=${cursor}`);
  runs.push(...page.runs);
  cursor = page.next_cursor ?? "";
}

function fits(run) {
  const words = at("runs-filter").value.toLowerCase().split(/\s+/).filter(Boolean);
  const text = [run.test, run.name, run.status, run.specimen, run.rig ?? "uploaded", run.held_out ? "held out" : "training"];
  return words.every((word) => text.join(" ").toLowerCase().includes(word));
}

function row(run) {
  const box = make("input", { type: "checkbox", "aria-label": `Draw ${run.test} of ${run.specimen}, ${moment(run.created)}` });
  box.addEventListener("change", () => pick(run, box));
  const swatch = make("span", { class: "swatch" });
  const word = make("span");
  state(word, run.status, run.status === "complete" ? "done" : "aborted");
  const cell = (head, ...inner) => make("td", { "data-head": head }, ...inner);
  return {
    node: make("tr", {}, cell("Test", make("label", { class: "key" }, box, swatch, make("span", {}, run.test || run.name))),
      cell("Specimen", run.specimen), cell("Rig", run.rig ?? "uploaded"), cell("Use", run.held_out ? "held out" : "training"),
      cell("Status", word), cell("Length", seconds(run.samples / run.sample_rate_hz)), cell("Recorded", moment(run.created)),
      cell("File", make("a", { href: run.file }, `HDF5, ${bytes(run.size_bytes)}`))),
    update() {
      const place = [...picked.keys()].indexOf(run.id);
      swatch.style.background = swatchOf(place);
      box.checked = place >= 0;
    },
  };
}

// The service draws the loops of captured runs; an uploaded one is ticked for a sheet only.
async function loopsOf(run) {
  return run.campaign ? get(`/v1/campaigns/${run.campaign}/runs/${run.id}/loops?points=2000`) : null;
}

async function pick(run, box) {
  if (!box.checked) picked.delete(run.id);
  else if (picked.size >= MOST_CHOSEN) {
    box.checked = false;
    return say(`At most ${MOST_CHOSEN} runs are drawn at once.`, "refused");
  } else picked.set(run.id, null);
  try {
    if (box.checked) {
      const loops = await loopsOf(run);
      if (picked.has(run.id)) picked.set(run.id, loops);
    }
    say("");
  } catch (error) {
    picked.delete(run.id);
    say(error.message, "refused");
  }
  showList();
  draw();
}

function draw() {
  const drawn = [...picked.values()].filter(Boolean);
  show(at("runs-plots"), drawn.length);
  show(at("no-picked"), !drawn.length);
  if (!drawn.length) return;
  const [scale, unit] = forceScale(Math.max(...drawn.map((one) => peakOf(one.force_n))));
  const traces = (key) => () => [...picked.values()].map((one, place) => one && ({
    name: one.test, x: scaled(one[key], 1e3), y: scaled(one.force_n, scale), mode: "lines", line: lineOf(place, 1.5) })).filter(Boolean);
  const words = (what) => `Force over ${what} of ${drawn.map((one) => one.test).join(", ")}`;
  chart(at("runs-fx"), { title: "Force over displacement", x: "Displacement (mm)", y: `Force (${unit})`, kept: "runs",
    words: words("displacement"), traces: traces("displacement_m") });
  chart(at("runs-fv"), { title: "Force over velocity", x: "Velocity (mm/s)", y: `Force (${unit})`, kept: "runs",
    words: words("velocity"), traces: traces("velocity_m_s") });
}

function showList() {
  const shown = runs.filter(fits);
  keyed(at("runs-rows"), shown, (run) => run.id, row);
  set(at("runs-count"), `${shown.length} of ${runs.length} runs`);
  show(at("runs-more"), cursor);
  show(at("no-runs"), !runs.length);
}

const KIND_WORDS = {
  explain: "Explanation", fit: "Fit", characterise: "Characteristic sheet", compare: "Comparison",
  analyse: "Linear part and distortion", identify: "Black-box model", explore: "Exploration of parameters",
  sensitivity: "Sensitivity", complexity: "Complexity", vehicle: "In the vehicle", range: "Service range",
  realtime: "Real time", multi_axis: "Multisines of several axes",
};

function titleOf(job) {
  const kind = KIND_WORDS[job.kind] ?? job.kind;
  return job.name && job.name !== kind.toLowerCase() ? `${kind}: ${job.name}` : kind;
}

function jobRow(job) {
  const word = make("span");
  const text = make("p", { class: "hint" });
  const links = make("p");
  return {
    node: make("li", { class: "explanation" }, make("div", { class: "row" },
      make("span", { class: "name" }, titleOf(job)), word), text, links),
    update(now) {
      state(word, now.state);
      set(text, now.reason || (now.state === "running" ? now.phase : moment(now.ended ?? now.created)));
      if (!links.firstChild) {
        for (const [name, href] of Object.entries(now.files)) links.append(make("a", { href, target: "_blank", rel: "noopener" }, name), " ");
      }
    },
  };
}

async function showJobs() {
  try {
    const { jobs } = await get("/v1/jobs?limit=20");
    keyed(at("jobs"), jobs, (job) => job.id, jobRow);
    show(at("no-jobs"), !jobs.length);
    return jobs.some((job) => ["accepted", "running"].includes(job.state));
  } catch {
    return true; // the banner says that the service is away
  }
}

let timer = null;

async function followJobs() {
  clearTimeout(timer);
  if (!at("runs-view").hidden && await showJobs()) timer = setTimeout(followJobs, JOBS_MS);
}

const OF_THE_TICKED = [
  ["sheet", "characterise", "The sheet is being drawn; it appears below."],
  ["analysis", "analyse", "The runs are being analysed; the page appears below."],
];

async function again() {
  runs = [];
  cursor = "";
  await readOn();
  showList();
}

async function specimens() {
  const found = (await get("/v1/specimens")).specimens;
  const known = new Set([...at("runs-specimen").options].map((option) => option.value));
  at("runs-specimen").append(...found.filter((one) => !known.has(one.name)).map((one) => make("option", { value: one.name }, one.name)));
}

export async function showRuns() {
  try {
    await specimens();
    await again();
  } catch (error) {
    say(error.message, "refused");
  }
  draw();
  followJobs();
}

at("runs-actions").after(said);
at("runs-filter").addEventListener("input", showList);
at("runs-specimen").addEventListener("change", () => again().catch((error) => say(error.message, "refused")));
at("runs-more").addEventListener("click", () => act(at("runs-more"), readOn, say, showList));
for (const [button, kind, words] of OF_THE_TICKED) {
  const ask = () => create("/v1/jobs", { kind, runs: [...picked.keys()] });
  at(button).addEventListener("click", () => act(at(button), ask, say, () => {
    say(words, "taken");
    followJobs();
  }));
}
