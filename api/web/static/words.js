// Numbers, times and states in words.

export function seconds(value) {
  if (!Number.isFinite(value)) return "–";
  if (value < 100) return value.toFixed(value < 10 ? 1 : 0) + " s";
  if (value < 5940) return `${Math.floor(value / 60)} min ${String(Math.floor(value % 60)).padStart(2, "0")} s`;
  return `${Math.floor(value / 3600)} h ${String(Math.floor((value % 3600) / 60)).padStart(2, "0")} min`;
}

export function number(value, digits, unit) {
  if (!Number.isFinite(value)) return "–";
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−")) + " " + unit;
}

export const force = (newton) => Number.isFinite(newton) ? number(newton / 1e3, 2, "kN") : "–";
export const length = (metre) => Number.isFinite(metre) ? number(metre * 1e3, 1, "mm") : "–";
export const degrees = (value) => number(value, 1, "°C");
export const ampere = (value) => number(value, 2, "A");

export function bytes(value) {
  return value < 1e6 ? (value / 1e3).toFixed(0) + " kB" : (value / 1e6).toFixed(1) + " MB";
}

export const clock = (when) => new Date(when).toLocaleTimeString();
export const moment = (when) => when ? new Date(when).toLocaleString() : "–";

// How much of a test is recorded, 0 … 1.
export function part(test) {
  return test.state === "done" ? 1 : test.total_samples ? Math.min(1, test.samples / test.total_samples) : 0;
}

const ENDED = ["done", "failed", "aborted", "skipped"];

// Seconds of motion that a campaign still takes, without waiting for people or for the oil.
export function leftOf(campaign) {
  return campaign.tests.reduce((sum, test) =>
    sum + (ENDED.includes(test.state) ? 0 : test.duration_s * (1 - part(test))), 0);
}

export function shareOf(campaign) {
  const total = campaign.tests.reduce((sum, test) => sum + test.duration_s, 0);
  return total > 0 ? campaign.tests.reduce((sum, test) => sum + test.duration_s * part(test), 0) / total : 0;
}

export const ASKS = "asks its operator";

export function campaignState(campaign) {
  if (campaign.state !== "running") return campaign.state === "accepted" ? "waits" : campaign.state;
  const test = campaign.tests.find((one) => one.state === "running");
  if (campaign.question && !campaign.asked) return ASKS;
  if (campaign.asked === "hold") return test && test.phase === "hold" ? "on hold" : "holding …";
  return campaign.asked ? "stopping …" : "running";
}

const UNITS = { force: "N", displacement: "m", current: "A", temperature: "°C", pressure: "Pa" };

// An interlock as it is written (channel:low:high:action:time) in words.
export function interlock(text) {
  const [channel, low, high, action, after] = text.split(":");
  if (!action) return text;
  const end = (word, value) => Number.isFinite(Number(value)) ? `${word} ${String(Number(value)).replace("-", "−")} ${UNITS[channel] ?? ""}` : "";
  return `${channel} ${[end("from", low), end("to", high)].filter(Boolean).join(" ")}, else ${action}${after ? " after " + after + " s" : ""}`;
}
