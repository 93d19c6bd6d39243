// The live page: follows the service's events and draws what the rig captures. Text reaches the page as text only.
"use strict";

const OPEN = ["accepted", "running"];
const ORDERS = ["hold", "resume", "stop", "abort"];
const LIVE_POINTS = 2500;
const COLOURS = ["#0b63a5", "#c8572c", "#1d7a45", "#8a4fb3", "#b08900", "#2b9c9c", "#b3261e", "#5b6875"];
const BROAD = ["multisine", "homogenised", "road"]; // these cover the plane: drawn thin, below the loops of the others
const at = (id) => document.getElementById(id);

let campaigns = [];
let chosen = null; // id of the campaign on show
let followed = true; // the page shows what runs until a person chooses otherwise
let loops = new Map(); // run id -> its loops, of the campaign on show
let files = new Map(); // test name -> its newest run
let runsOf = ""; // which campaign and how much of it `files` stands for
let fetching = false;
let hidden = new Set(); // names of the tests of the campaign on show that are not drawn
let live = { test: "", x: [], f: [] };

function make(tag, className, text) {
  const node = document.createElement(tag);
  if (className) node.className = className;
  if (text !== undefined) node.textContent = text;
  return node;
}

function seconds(value) {
  return value < 100 ? value.toFixed(1) + " s" : Math.floor(value / 60) + " min " + Math.round(value % 60) + " s";
}

function share(campaign) {
  const total = campaign.tests.reduce((sum, test) => sum + test.duration_s, 0);
  const done = campaign.tests.reduce((sum, test) => sum + test.duration_s * part(test), 0);
  return total > 0 ? done / total : 0;
}

function part(test) {
  return test.state === "done" ? 1 : test.total_samples ? test.samples / test.total_samples : 0;
}

function one() {
  return campaigns.find((campaign) => campaign.id === chosen) || null;
}

function choose(id) {
  if (id === chosen) return;
  chosen = id;
  loops = new Map();
  files = new Map();
  hidden = new Set();
  runsOf = "";
  live = { test: "", x: [], f: [] };
}

function follow() {
  const running = campaigns.find((campaign) => campaign.state === "running");
  if (followed && running) choose(running.id);
  if (!one() && campaigns.length) choose(campaigns[0].id);
}

function show() {
  follow();
  at("none").hidden = campaigns.length > 0;
  at("campaigns").replaceChildren(...campaigns.map(entry));
  const campaign = one();
  const wasHidden = at("one").hidden;
  at("one").hidden = !campaign;
  if (campaign) {
    showCampaign(campaign);
    if (wasHidden) draw();
    fetchRuns(campaign);
  }
}

function entry(campaign) {
  const button = make("button");
  button.setAttribute("aria-current", String(campaign.id === chosen));
  const row = make("span", "row");
  row.append(make("span", "name", campaign.name), make("span", "state " + campaign.state, campaign.state));
  button.append(row, make("p", "hint", campaign.specimen + " on " + campaign.rig));
  if (campaign.state === "running") button.append(bar(share(campaign)));
  button.addEventListener("click", () => {
    followed = campaign.state === "running";
    choose(campaign.id);
    show();
    draw();
  });
  const item = make("li");
  item.append(button);
  return item;
}

function bar(value) {
  const node = make("progress");
  node.max = 1;
  node.value = value;
  return node;
}

function showCampaign(campaign) {
  at("name").textContent = campaign.name;
  at("state").textContent = campaign.asked === "hold" ? "on hold" : campaign.state;
  at("state").className = "state " + campaign.state;
  const rigTime = campaign.tests.reduce((sum, test) => sum + test.duration_s, 0);
  at("facts").textContent = `${campaign.specimen} on ${campaign.rig} · ${campaign.tests.length} tests, ` +
    `${seconds(rigTime)} of rig time · accepted ${new Date(campaign.created).toLocaleString()}`;
  at("reason").hidden = !campaign.reason;
  at("reason").textContent = campaign.reason;
  showOrders(campaign);
  showNow(campaign.tests.find((test) => test.state === "running"));
  at("tests").replaceChildren(...campaign.tests.map(row));
  explanationsOfCampaign();
}

function showOrders(campaign) {
  const running = campaign.state === "running";
  const ending = ["stop", "abort"].includes(campaign.asked);
  at("hold").hidden = !running || campaign.asked !== "";
  at("resume").hidden = campaign.asked !== "hold";
  at("stop").hidden = !running || ending;
  at("abort").hidden = !OPEN.includes(campaign.state);
  for (const order of ORDERS) at(order).disabled = order === "abort" && campaign.asked === "abort";
}

function showNow(test) {
  at("now").hidden = !test;
  if (!test) return;
  at("nowtest").textContent = test.name;
  at("nowphase").textContent = test.phase + (test.text ? ": " + test.text : "");
  at("nowleft").textContent = `${test.samples.toLocaleString()} of ${test.total_samples.toLocaleString()} samples`;
  at("nowbar").value = part(test);
}

function colour(name) {
  const place = one().tests.findIndex((test) => test.name === name);
  return COLOURS[Math.max(place, 0) % COLOURS.length];
}

function key(test) {
  const label = make("label", "key");
  const box = make("input");
  box.type = "checkbox";
  box.checked = !hidden.has(test.name);
  box.addEventListener("change", () => {
    if (box.checked) hidden.delete(test.name);
    else hidden.add(test.name);
    draw();
  });
  const swatch = make("span", "swatch");
  swatch.style.background = colour(test.name);
  label.append(box, swatch, make("span", "", test.name));
  return label;
}

function row(test) {
  const line = make("tr");
  const name = make("td");
  name.append(key(test));
  const state = make("td");
  state.append(make("span", "state " + test.state, test.state));
  if (test.text && ["failed", "aborted"].includes(test.state)) state.append(make("div", "text", test.text));
  const progress = make("td", "wide");
  progress.append(bar(part(test)));
  const file = make("td");
  const run = files.get(test.name);
  if (run) {
    const link = make("a", "", run.status + ", HDF5");
    link.href = run.file;
    file.append(link);
  }
  line.append(name, make("td", "", test.kind), make("td", "", test.held_out ? "held out" : "training"),
    state, progress, make("td", "number", seconds(test.duration_s)), file);
  return line;
}

async function fetchRuns(campaign) {
  const ended = campaign.tests.filter((test) => !["waiting", "running"].includes(test.state)).length;
  const stand = campaign.id + "/" + ended + campaign.state;
  if (stand === runsOf || fetching) return;
  fetching = true;
  try {
    const runs = (await get(`/v1/campaigns/${campaign.id}/runs`)).runs;
    for (const run of runs.filter((run) => !loops.has(run.id) && run.samples >= 64)) {
      const drawn = await get(run.loops + "?points=1500");
      if (campaign.id !== chosen) return;
      loops.set(run.id, drawn);
    }
    if (campaign.id !== chosen) return;
    files = new Map(runs.map((run) => [run.test, run]));
    runsOf = stand;
    show();
    draw();
  } catch (error) {
    complain(error.message);
  } finally {
    fetching = false;
  }
}

async function get(url) {
  const answer = await fetch(url);
  const body = await answer.json();
  if (!answer.ok) throw new Error(body.detail);
  return body;
}

function draw() {
  if (at("one").hidden) return; // a plot drawn while hidden would get a size of its own
  const kind = new Map(one().tests.map((test) => [test.name, test.kind]));
  const broad = (loop) => BROAD.includes(kind.get(loop.test));
  const of = [...loops.values()].filter((loop) => !hidden.has(loop.test)).sort((a, b) => broad(b) - broad(a));
  const peak = Math.max(1, ...of.map((loop) => Math.max(...loop.force_n.map(Math.abs))), ...live.f.map(Math.abs));
  const [scale, unit] = peak >= 2000 ? [1e-3, "kN"] : [1, "N"];
  const trace = (loop, key) => ({
    name: loop.test, x: loop[key].map((value) => value * 1e3), y: loop.force_n.map((value) => value * scale),
    mode: "lines", line: { width: broad(loop) ? 0.7 : 2, color: colour(loop.test) }, opacity: broad(loop) ? 0.55 : 1,
  });
  const fx = of.map((loop) => trace(loop, "displacement_m"));
  if (live.x.length) {
    fx.push({ name: live.test + " (live)", x: live.x.map((value) => value === null ? null : value * 1e3),
      y: live.f.map((value) => value === null ? null : value * scale),
      mode: "lines", line: { width: 1.4, color: "#1c2733" } });
  }
  picture("fx", fx, "Displacement (mm)", `Force (${unit})`, "Force over displacement" + (live.x.length ? ", live in black" : ""));
  picture("fv", of.map((loop) => trace(loop, "velocity_m_s")), "Velocity (mm/s)", `Force (${unit})`, "Force over velocity");
}

function picture(id, traces, xTitle, yTitle, title) {
  const axis = { zeroline: true, zerolinecolor: "#9aa6b2", gridcolor: "#e6eaee" };
  Plotly.react(id, traces, {
    title: { text: title, font: { size: 14 } }, margin: { l: 62, r: 12, t: 36, b: 44 }, showlegend: false,
    font: { family: "system-ui, sans-serif", color: "#1c2733" },
    xaxis: { ...axis, title: { text: xTitle } }, yaxis: { ...axis, title: { text: yTitle } }, uirevision: chosen,
  }, { displayModeBar: false, responsive: true, doubleClick: "reset" });
}

function complain(text) {
  at("trouble").hidden = !text;
  at("trouble").textContent = text || "";
}

function isRunning(test) {
  const campaign = one();
  return Boolean(campaign && campaign.tests.some((other) => other.state === "running" && other.name === test));
}

function take(blocks) {
  for (const block of blocks.filter((block) => block.campaign_id === chosen && isRunning(block.test))) {
    if (block.test !== live.test) live = { test: block.test, x: [], f: [] };
    live.x = live.x.concat(null, block.displacement_m).slice(-LIVE_POINTS); // null: the blocks are not adjacent
    live.f = live.f.concat(null, block.force_n).slice(-LIVE_POINTS);
  }
  draw();
}

function quietWhenNothingRuns() {
  if (live.x.length && !isRunning(live.test)) {
    live = { test: "", x: [], f: [] };
    draw();
  }
}

for (const order of ORDERS) {
  at(order).addEventListener("click", async () => {
    const campaign = one();
    if (!campaign) return;
    at(order).disabled = true; // at once and without a question: this is the way to stop a rig
    try {
      const answer = await fetch(`/v1/campaigns/${campaign.id}/${order}`, { method: "POST" });
      if (!answer.ok) complain((await answer.json()).detail);
    } catch {
      complain(`The service does not answer: nobody knows of this ${order}. Use the rig's emergency stop.`);
      at(order).disabled = false;
    }
  });
}

function connect() {
  const source = new EventSource("/v1/live");
  source.addEventListener("open", () => {
    at("link").textContent = "live";
    at("link").className = "link";
  });
  source.addEventListener("error", () => {
    at("link").textContent = "connection lost: what you see may be old; trying again …";
    at("link").className = "link lost";
  });
  source.addEventListener("campaigns", (event) => {
    campaigns = JSON.parse(event.data).campaigns;
    complain("");
    show();
    quietWhenNothingRuns();
  });
  source.addEventListener("explanations", (event) => {
    explanations = JSON.parse(event.data).explanations;
    explanationsOfCampaign();
  });
  source.addEventListener("samples", (event) => take(JSON.parse(event.data)));
  source.addEventListener("trouble", (event) => complain(JSON.parse(event.data).detail));
}

connect();
